#pragma once

#include <string>
#include <vector>

namespace mp2p_icp_apps
{
/// Names of all classes that describe_class() knows: ICP's parameters, and every registered solver, matcher,
/// quality evaluator, filter and generator. Sorted by kind, then name.
std::vector<std::string> describable_classes();

/** The parameters of a class as text: name, type, unit, default, range and help of each.
 * \param name with or without its namespace; `all` gives the names by kind.
 * \exception std::invalid_argument for an unknown one, with the nearest name and the list.
 */
std::string describe_class(const std::string& name);

}  // namespace mp2p_icp_apps
