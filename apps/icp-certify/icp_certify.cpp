#include "icp_certify.h"

#include <mp2p_icp/errors.h>

#include <new>
#include <ostream>
#include <stdexcept>

#include "certify_options.h"
#include "findings_text.h"

namespace mp2p_icp_certify
{
namespace
{
Findings findings_of(const CertifyOptions& options)
{
    const Certificate certificate = read_certificate(options.certificate, options.pairings);
    try
    {
        return check_certificate(certificate);
    }
    catch (const std::invalid_argument& e)
    {
        throw mp2p_icp::DataError(options.certificate, e.what());
    }
}

ExitCode run(const std::vector<std::string>& arguments, std::ostream& out)
{
    const auto options = parse_certify_options(arguments, out);
    if (!options) return EXIT_HOLDS;
    const Findings findings = findings_of(*options);
    out << (options->as_yaml ? findings_as_yaml(findings) : findings_in_words(findings));
    return findings.holds() ? EXIT_HOLDS : EXIT_DOES_NOT_HOLD;
}

int complain(std::ostream& err, const std::string& what)
{
    err << "icp-certify: " << what << "\n";
    return EXIT_WRONG_INPUT;
}
}  // namespace

int icp_certify(const std::vector<std::string>& arguments, std::ostream& out, std::ostream& err) noexcept
{
    try
    {
        return run(arguments, out);
    }
    catch (const std::bad_alloc&)
    {
        return complain(err, "not enough memory");
    }
    catch (const std::exception& e)
    {
        return complain(err, mp2p_icp::short_reason(e));
    }
}

}  // namespace mp2p_icp_certify
