#pragma once

#include <CLI/CLI.hpp>
#include <iosfwd>
#include <string>
#include <vector>

namespace mp2p_icp_apps
{
/// Adds the examples below the help, and --version, that of MRPT included.
void set_program_texts(CLI::App& app, const std::string& examples, size_t column_width);

/** Reads the arguments into what was declared. \return false if only help or the version was asked for: it is
 * in `out` then. \exception std::invalid_argument for what cannot be understood; of an unknown option or
 * subcommand, with the nearest known one.
 */
bool parse_command_line(CLI::App& app, const std::vector<std::string>& arguments, std::ostream& out);

}  // namespace mp2p_icp_apps
