#pragma once

#include <mp2p_icp/Parameterizable.h>

#include <memory>
#include <string>

namespace mp2p_icp_filters
{
/// The parameter that `declare_one(declaration)` declares, with a note in `given` when it is loaded: for
/// rules about which keys may stand together.
template <class DeclareOne>
mp2p_icp::ParameterDeclaration::Entry noted(const std::shared_ptr<bool>& given, const DeclareOne& declare_one)
{
    mp2p_icp::ParameterDeclaration one;
    declare_one(one);
    mp2p_icp::ParameterDeclaration::Entry entry = one.entries().back();
    entry.load =
        [given, load = entry.load](const mp2p_icp::yaml::node_t& node, const mp2p_icp::YamlPlace& place)
    {
        load(node, place);
        *given = true;
    };
    return entry;
}

/// As noted(), for a key of older versions: read, and never written.
template <class DeclareOne>
mp2p_icp::ParameterDeclaration::Entry older(const std::shared_ptr<bool>& given, const DeclareOne& declare_one)
{
    auto entry = noted(given, declare_one);
    entry.save = nullptr;
    return entry;
}

/// Keys that mean nothing here and stand in files for other versions: checked, and forgotten.
class KeysWithoutEffect
{
 public:
    using Declaration = mp2p_icp::ParameterDeclaration;

    void number(Declaration& declare, const std::string& name, const char* why)
    {
        add(declare, [&](Declaration& d)
            { d.number(name, forgotten_->number, "m", mp2p_icp::Range::any(), older_key(why)); });
    }
    /// x, y and z
    void position(Declaration& declare, const std::string& name, const char* why)
    {
        add(declare, [&](Declaration& d) { d.formulas(name, forgotten_->position, 3, "m", older_key(why)); });
    }
    void flag(Declaration& declare, const std::string& name, const char* why)
    {
        add(declare,
            [&](Declaration& d) { d.flag(name, forgotten_->flag, std::string("Without effect: ") + why); });
    }
    /// To be called at the end: the declaration then owns what its loaders write to.
    void keep_in(Declaration& declare)
    {
        declare.rule([forgotten = forgotten_]() { return std::string(); });
    }

 private:
    struct Forgotten
    {
        double number = 0;
        mp2p_icp::Formula position[3];
        bool flag = true;
    };

    static std::string older_key(const char* why)
    {
        return std::string("Older key (0.2.2), without effect: ") + why;
    }
    template <class DeclareOne>
    void add(Declaration& declare, const DeclareOne& declare_one)
    {
        declare.custom(older(ignored_, declare_one));
    }

    std::shared_ptr<Forgotten> forgotten_ = std::make_shared<Forgotten>();
    std::shared_ptr<bool> ignored_ = std::make_shared<bool>(false);
};
constexpr const char* HASHED = "cells are hashed and need no bounds.";
constexpr const char* ONE_HASH_MAP = "there is only one kind of hash map here.";

}  // namespace mp2p_icp_filters
