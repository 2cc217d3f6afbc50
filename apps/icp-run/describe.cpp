#include "describe.h"

#include <mp2p_icp/ICP.h>
#include <mp2p_icp/modules_from_yaml.h>
#include <mp2p_icp_filters/FilterBase.h>
#include <mp2p_icp_filters/Generator.h>

#include <algorithm>
#include <memory>
#include <stdexcept>

namespace mp2p_icp_apps
{
using mp2p_icp::Parameterizable;
using mrpt::rtti::TRuntimeClassId;

namespace
{
struct KindOfPart
{
    const char* name;
    const TRuntimeClassId* base;
};

std::vector<KindOfPart> kinds_of_parts()
{
    return {{"solver", CLASS_ID_NAMESPACE(Solver, mp2p_icp)},
            {"matcher", CLASS_ID_NAMESPACE(Matcher, mp2p_icp)},
            {"quality evaluator", CLASS_ID_NAMESPACE(QualityEvaluator, mp2p_icp)},
            {"filter", CLASS_ID_NAMESPACE(FilterBase, mp2p_icp_filters)},
            {"generator", CLASS_ID_NAMESPACE(Generator, mp2p_icp_filters)}};
}

const std::string ICP_PARAMETERS = "mp2p_icp::Parameters", ICP_CLASS = "mp2p_icp::ICP";

/// A class that can be described.
struct Entry
{
    std::string name, kind;
    const TRuntimeClassId* id = nullptr;  ///< null for the parameters of ICP
};

std::vector<Entry> entries()
{
    std::vector<Entry> all = {{ICP_CLASS, "ICP", nullptr}, {ICP_PARAMETERS, "ICP", nullptr}};
    for (const auto& kind : kinds_of_parts())
    {
        for (const auto& name : mp2p_icp::registered_classes(kind.base))
            all.push_back({name, kind.name, mrpt::rtti::findRegisteredClass(name)});
    }
    return all;
}

std::string without_namespace(const std::string& name)
{
    return name.substr(name.rfind(':') + 1);
}

std::string parameters_text(const Entry& entry)
{
    mp2p_icp::Parameters of_icp;
    if (!entry.id) return of_icp.describe_parameters();
    const auto object = entry.id->createObject();
    const auto* part = dynamic_cast<const Parameterizable*>(object.get());
    if (!part)
        throw std::invalid_argument("--describe: " + entry.name + " has no parameters that can be described");
    return part->describe_parameters();
}

std::string list_by_kind(const std::vector<Entry>& all)
{
    std::string out;
    for (size_t i = 0; i < all.size(); i++)
    {
        if (i == 0 || all[i].kind != all[i - 1].kind) out += all[i].kind + ":\n";
        out += "  " + all[i].name + "\n";
    }
    return out;
}

[[noreturn]] void throw_unknown(const std::string& name, const std::vector<Entry>& all)
{
    std::vector<std::string> short_names;
    std::string list;
    for (const auto& e : all)
    {
        short_names.push_back(without_namespace(e.name));
        list += (list.empty() ? "" : ", ") + short_names.back();
    }
    const std::string nearest = mp2p_icp::nearest_name(without_namespace(name), short_names);
    throw std::invalid_argument("--describe: there is no class '" + name + "'" +
                                (nearest.empty() ? "" : "; did you mean '" + nearest + "'?") +
                                " (known: " + list + ")");
}
}  // namespace

std::vector<std::string> describable_classes()
{
    std::vector<std::string> names;
    for (const auto& entry : entries()) names.push_back(entry.name);
    return names;
}

std::string describe_class(const std::string& name)
{
    const auto all = entries();
    if (name == "all") return list_by_kind(all);
    const bool is_short = name.find(':') == std::string::npos;
    for (const auto& entry : all)
        if (entry.name == name || (is_short && without_namespace(entry.name) == name))
            return entry.name + " (" + entry.kind + ")\n\n" + parameters_text(entry);
    throw_unknown(name, all);
}

}  // namespace mp2p_icp_apps
