#include "certify_options.h"

#include <mp2p_icp/version.h>
#include <mp2p_icp/yaml_tools.h>
#include <mrpt/system/os.h>

#include <CLI/CLI.hpp>
#include <ostream>
#include <stdexcept>

namespace mp2p_icp_certify
{
namespace
{
const char* const DESCRIPTION =
    "Checks a certificate: the claim that no pose aligns the given pairings better than the given one. "
    "Everything is made again from the pairings; no code is shared with what found the pose.";

const char* const EXAMPLES = R"(
Examples:
  Does the certificate hold?
    icp-certify certificate.yaml
  Does it hold for my own pairings (one a line, or a YAML file with `pairings: |`)?
    icp-certify certificate.yaml --pairings my_pairings.csv
  The findings as YAML, for other programs:
    icp-certify certificate.yaml --yaml > findings.yaml

Exit code: 0 it holds; 1 wrong usage, or a file that cannot be read (the reason is on stderr); 2 it does not hold.
)";

void declare(CLI::App& app, CertifyOptions& o)
{
    app.add_option("certificate", o.certificate, "The certificate, a YAML file")->type_name("FILE");
    app.add_option("--pairings", o.pairings,
                   "Take the pairings from this file instead: one a line, or YAML with a block `pairings`")
        ->type_name("PAIRINGS");
    app.add_flag("--yaml", o.as_yaml, "Print the findings as YAML");
}

/// `; did you mean '--x'?` for the first of the arguments that is no option.
std::string hint_for_unknown(const CLI::App& app)
{
    for (const auto& argument : app.remaining())
    {
        if (argument.rfind("--", 0) != 0) continue;
        const std::string nearest =
            mp2p_icp::nearest_name(argument, {"--pairings", "--yaml", "--help", "--version"});
        if (!nearest.empty()) return "; did you mean '" + nearest + "'?";
    }
    return {};
}
}  // namespace

std::optional<CertifyOptions> parse_certify_options(const std::vector<std::string>& arguments,
                                                    std::ostream& out)
{
    CertifyOptions options;
    CLI::App app(DESCRIPTION, "icp-certify");
    app.footer(EXAMPLES);
    app.get_formatter()->column_width(30);
    app.set_version_flag("--version",
                         "icp-certify " MP2P_ICP_VERSION " (" + mrpt::system::MRPT_getVersion() + ")");
    declare(app, options);
    try
    {
        app.parse(
            std::vector<std::string>(arguments.rbegin(), arguments.rend()));  // CLI11 wants them reversed
    }
    catch (const CLI::Success& asked)
    {
        app.exit(asked, out, out);
        return {};
    }
    catch (const CLI::ExtrasError& e)
    {
        throw std::invalid_argument(e.what() + hint_for_unknown(app));
    }
    catch (const CLI::ParseError& e)
    {
        throw std::invalid_argument(e.what());
    }
    if (options.certificate.empty())
        throw std::invalid_argument("the name of a certificate is required (see icp-certify --help)");
    return options;
}

}  // namespace mp2p_icp_certify
