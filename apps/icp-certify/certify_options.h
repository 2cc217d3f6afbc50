#pragma once

#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

namespace mp2p_icp_certify
{
/// The command line of icp-certify.
struct CertifyOptions
{
    std::string certificate;
    std::string pairings;  ///< empty: those in the certificate
    bool as_yaml = false;
};

/** Reads the command line.
 * \param arguments without the program's name
 * \return empty if help or the version was asked for, and written to `out`
 * \exception std::invalid_argument for anything wrong with it.
 */
std::optional<CertifyOptions> parse_certify_options(const std::vector<std::string>& arguments,
                                                    std::ostream& out);

}  // namespace mp2p_icp_certify
