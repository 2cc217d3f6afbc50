#pragma once

#include <mp2p_icp/Parameterizable.h>

#include <memory>

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

}  // namespace mp2p_icp_filters
