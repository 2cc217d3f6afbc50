#include <mp2p_icp/errors.h>
#include <mp2p_icp/modules_from_yaml.h>

#include <algorithm>

namespace mp2p_icp
{
using mrpt::rtti::TRuntimeClassId;

std::vector<std::string> registered_classes(const TRuntimeClassId* base)
{
    std::vector<std::string> names;
    if (base->ptrCreateObject) names.emplace_back(base->className);
    for (const auto* id : mrpt::rtti::getAllRegisteredClassesChildrenOf(base))
        if (id->ptrCreateObject) names.emplace_back(id->className);
    std::sort(names.begin(), names.end());
    names.erase(std::unique(names.begin(), names.end()), names.end());
    return names;
}

namespace
{
std::string without_namespace(const std::string& name)
{
    const auto at = name.rfind(':');
    return at == std::string::npos ? name : name.substr(at + 1);
}

/// `; did you mean 'x'?`, or all the names if none is near. A missing or wrong namespace is the commonest
/// slip.
std::string hint(const std::string& name, const std::vector<std::string>& known)
{
    std::vector<std::string> short_names;
    for (const auto& k : known) short_names.push_back(without_namespace(k));
    const std::string nearest = nearest_name(without_namespace(name), short_names);
    for (size_t i = 0; i < known.size(); i++)
        if (!nearest.empty() && short_names[i] == nearest) return "; did you mean '" + known[i] + "'?";
    std::string all;
    for (const auto& k : known) all += (all.empty() ? "" : ", ") + k;
    return "; known classes: " + (all.empty() ? "none" : all);
}
}  // namespace

std::shared_ptr<mrpt::rtti::CObject> object_from_yaml(const yaml::node_t& class_name, const YamlPlace& place,
                                                      const TRuntimeClassId* base, const std::string& kind)
{
    const std::string name = scalar_text(class_name, place);
    const auto refuse = [&](const std::string& problem)
    { throw ConfigError(place.text(&class_name) + ": " + problem + hint(name, registered_classes(base))); };
    const bool allow_ignore_namespace = false;
    const auto* id = mrpt::rtti::findRegisteredClass(name, allow_ignore_namespace);
    if (!id) refuse("unknown class '" + name + "'");
    if (!id->derivedFrom(base)) refuse("the class '" + name + "' is not a " + kind);
    if (!id->ptrCreateObject) refuse("the class '" + name + "' is abstract");
    return id->createObject();
}

const yaml::node_t& required_key(const yaml& map, const YamlPlace& place, const std::string& key)
{
    if (!map.has(key))
        throw ConfigError(place.text(&map.node()) + ": the required key '" + key + "' is missing");
    return map.asMap().at(key);
}

void refuse_plugin(const yaml& map, const YamlPlace& place)
{
    if (!map.has("plugin")) return;
    throw ConfigError(place.key("plugin").text(&map.asMap().at("plugin")) +
                      ": plugins are not supported; link your program with the class and register it in "
                      "MRPT's class factory "
                      "(mrpt::rtti::registerClass) instead");
}

namespace
{
ModuleEntry module_entry(const yaml& entry, const YamlPlace& place, const TRuntimeClassId* base,
                         const ModuleFormat& format)
{
    std::vector<std::string> keys = {format.class_key, "params", "plugin"};
    keys.insert(keys.end(), format.more_keys.begin(), format.more_keys.end());
    check_keys(entry, place, keys);
    refuse_plugin(entry, place);
    const auto& class_node = required_key(entry, place, format.class_key);
    const auto object = object_from_yaml(class_node, place.key(format.class_key), base, format.kind);
    const yaml params = entry.has("params") ? yaml(entry.asMap().at("params")) : yaml();
    return {class_node.as<std::string>(), object, params, place.key("params"), entry, place};
}
}  // namespace

std::vector<ModuleEntry> module_entries(const yaml& list, const YamlPlace& place, const TRuntimeClassId* base,
                                        const ModuleFormat& format)
{
    std::vector<ModuleEntry> entries;
    if (list.isNullNode()) return entries;
    if (!list.isSequence())
        throw ConfigError(place.text(&list.node()) + ": expected a list of {" + format.class_key +
                          ", params}, found a " + list.node().typeName());
    const auto& nodes = list.asSequence();
    for (size_t i = 0; i < nodes.size(); i++)
        entries.push_back(module_entry(yaml(nodes[i]), place.item(i), base, format));
    return entries;
}

bool is_list_of_modules(const yaml::node_t& node)
{
    if (!node.isSequence()) return false;
    const auto is_entry = [](const yaml::node_t& n) { return n.isMap() && yaml(n).has("class_name"); };
    return std::all_of(node.asSequence().begin(), node.asSequence().end(), is_entry);
}

yaml module_list_from_file(const std::string& file_name, const std::string& wanted)
{
    const yaml file = yaml_from_file(file_name);
    const YamlPlace place{file_name, ""};
    if (!file.isMap())
        throw ConfigError(place.text(&file.node()) + ": expected a map with the key '" + wanted +
                          "', found a " + file.node().typeName());
    for (const auto& [key, value] : file.asMap())
        if (key.internalAsStr() != wanted && !is_list_of_modules(value))
            throw_unknown_key(place, key, {wanted});
    return yaml(required_key(file, place, wanted));
}

}  // namespace mp2p_icp
