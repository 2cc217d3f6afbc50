#include "command_line.h"

#include <mp2p_icp/version.h>
#include <mp2p_icp/yaml_tools.h>
#include <mrpt/system/os.h>

#include <ostream>
#include <stdexcept>

namespace mp2p_icp_apps
{
namespace
{
void add_options_of(const CLI::App& app, std::vector<std::string>& known)
{
    for (const auto* option : app.get_options())
        for (const auto& name : option->get_lnames()) known.push_back("--" + name);
}

/// `; did you mean 'x'?` for the first of the arguments that is like an option or a subcommand.
std::string hint_for_unknown(const CLI::App& app)
{
    std::vector<std::string> known;
    add_options_of(app, known);
    for (const auto* sub : app.get_subcommands([](const CLI::App*) { return true; }))
        known.push_back(sub->get_name());
    for (const auto* sub : app.get_subcommands()) add_options_of(*sub, known);
    const bool has_words = !app.get_subcommands([](const CLI::App*) { return true; }).empty();
    for (const auto& argument : app.remaining(true))
    {
        if (!has_words && argument.rfind("--", 0) != 0) continue;
        const std::string nearest = mp2p_icp::nearest_name(argument.substr(0, argument.find('=')), known);
        if (!nearest.empty()) return "; did you mean '" + nearest + "'?";
    }
    return {};
}
}  // namespace

void set_program_texts(CLI::App& app, const std::string& examples, size_t column_width)
{
    app.footer(examples);
    app.get_formatter()->column_width(column_width);
    app.set_version_flag("--version",
                         app.get_name() + " " MP2P_ICP_VERSION " (" + mrpt::system::MRPT_getVersion() + ")");
}

bool parse_command_line(CLI::App& app, const std::vector<std::string>& arguments, std::ostream& out)
{
    try
    {
        app.parse(
            std::vector<std::string>(arguments.rbegin(), arguments.rend()));  // CLI11 wants them reversed
    }
    catch (const CLI::Success& asked)
    {
        app.exit(asked, out, out);
        return false;
    }
    catch (const CLI::ExtrasError& e)
    {
        throw std::invalid_argument(e.what() + hint_for_unknown(app));
    }
    catch (const CLI::ParseError& e)
    {
        throw std::invalid_argument(e.what());
    }
    return true;
}

}  // namespace mp2p_icp_apps
