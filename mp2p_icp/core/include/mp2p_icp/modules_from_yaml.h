#pragma once

#include <mp2p_icp/yaml_tools.h>
#include <mrpt/rtti/CObject.h>
#include <mrpt/system/COutputLogger.h>

#include <memory>
#include <string>
#include <vector>

namespace mp2p_icp
{
/// The names of the classes in MRPT's registry that derive from `base` (itself included) and can be made.
std::vector<std::string> registered_classes(const mrpt::rtti::TRuntimeClassId* base);

/** A new object of the class that a YAML node names.
 * \param base The class that it must derive from.
 * \param kind What it is, for messages, such as `filter`.
 * \exception ConfigError for an unknown class (naming the nearest known one), or one that does not derive
 * from `base`.
 */
std::shared_ptr<mrpt::rtti::CObject> object_from_yaml(const yaml::node_t& class_name, const YamlPlace& place,
                                                      const mrpt::rtti::TRuntimeClassId* base,
                                                      const std::string& kind);

/// How the entries of a list of modules are written.
struct ModuleFormat
{
    std::string kind;  ///< what the list holds, for messages, such as `filter`
    std::string class_key = "class_name";
    std::vector<std::string> more_keys = {};  ///< allowed beside the class, `params` and `plugin`
};

/// One entry of a list of modules: a new object of its class, and the parameters that it is still to be
/// given.
struct ModuleEntry
{
    std::string class_name;
    std::shared_ptr<mrpt::rtti::CObject> object;
    yaml params;
    YamlPlace params_place;
    yaml entry;  ///< the whole entry, for ModuleFormat::more_keys
    YamlPlace place;
};

/** Makes the objects of a list of `{class_name, params}`, where params may be `~` or absent. A null list is
 * an empty one. \exception ConfigError for another structure, an unknown key, an unfit class, or the key
 * `plugin`, which is known and refused.
 */
std::vector<ModuleEntry> module_entries(const yaml& list, const YamlPlace& place,
                                        const mrpt::rtti::TRuntimeClassId* base, const ModuleFormat& format);

/// The initialized modules of a list. `Module` is an MRPT class with COutputLogger's functions and
/// initialize(params, place).
template <class Module>
std::vector<std::shared_ptr<Module>> modules_from_yaml(const yaml& list, const YamlPlace& place,
                                                       const std::string& kind,
                                                       mrpt::system::VerbosityLevel verbosity)
{
    std::vector<std::shared_ptr<Module>> modules;
    for (const ModuleEntry& entry : module_entries(list, place, CLASS_ID(Module), {kind}))
    {
        auto module = std::dynamic_pointer_cast<Module>(entry.object);
        module->setLoggerName(entry.class_name);
        module->setMinLoggingLevel(verbosity);
        module->initialize(entry.params, entry.params_place);
        modules.push_back(std::move(module));
    }
    return modules;
}

/// Is it a list whose entries all have a `class_name`?
bool is_list_of_modules(const yaml::node_t& node);

/// \exception ConfigError if the map has the key `plugin`.
void refuse_plugin(const yaml& map, const YamlPlace& place);

/// \exception ConfigError if the map lacks the key.
const yaml::node_t& required_key(const yaml& map, const YamlPlace& place, const std::string& key);

/** The list under the top key `wanted` of a file. Other top keys may only hold lists of `{class_name,
 * params}` (named lists, for other readers of the same file). \exception ConfigError, and DataError as
 * yaml_from_file().
 */
yaml module_list_from_file(const std::string& file_name, const std::string& wanted);

}  // namespace mp2p_icp
