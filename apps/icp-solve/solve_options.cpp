#include "solve_options.h"

#include <ostream>
#include <stdexcept>

#include "command_line.h"

namespace mp2p_icp_apps
{
namespace
{
const char* const DESCRIPTION =
    "Finds the pose that fits pairings of points, lines and planes best, and says what is proven of it.";

const char* const EXAMPLES = R"(
Pairings are one a line (docs/formats.md), or the block `pairings` of a certificate:
  pt2pt,1, 10.0,2.0,0.5, 0.0,1.0,0.5        weight, point of the global frame, point of the local one
  pt2pl,1, 0,0,3, 0,0,1, 2,2,0              weight, point and normal of the global plane, local point

Examples:
  The best of all poses, with a proof:
    icp-solve pairings.csv
  The proof as a file, checked by another program:
    icp-solve pairings.csv --certificate proof.yaml && icp-certify proof.yaml
  All poses that fit better than those near them; wrong pairings left out (residuals above 5 cm):
    icp-solve pairings.csv --all-minima
    icp-solve pairings.csv --outlier-threshold 0.05
  Another solver:
    icp-solve pairings.csv --solver horn

Exit code: 0 solved: the pairings determine the pose, and (solver certified) no other fits as well; 1 wrong usage or input
(the reason is on stderr); 2 solved, but not that: see the verdict.
)";

void declare(CLI::App& app, SolveOptions& o)
{
    app.add_option("pairings", o.pairings, "The pairings: one a line, or a certificate")->type_name("FILE");
    app.add_option("--solver", o.solver, "certified, horn, olae or gauss-newton. Default: certified")
        ->check(CLI::IsMember({"certified", "horn", "olae", "gauss-newton"}))
        ->type_name("NAME");
    app.add_option("--guess", o.guess,
                   "\"[x y z yaw_deg pitch_deg roll_deg]\" in m and degrees, or a file with a 4x4 matrix: "
                   "chosen among "
                   "poses that fit equally well. Default: none")
        ->type_name("POSE");
    app.add_option("--certificate", o.certificate, "Write pose, proof and pairings there (solver certified)")
        ->type_name("FILE");
    app.add_flag("--all-minima", o.all_minima, "List all local minima (solver certified)");
    app.add_option("--outlier-threshold", o.outlier_threshold,
                   "Leave out pairings whose residual is above this, m, found by graduated non-convexity")
        ->check(CLI::PositiveNumber)
        ->type_name("M");
}
}  // namespace

std::optional<SolveOptions> parse_solve_options(const std::vector<std::string>& arguments, std::ostream& out)
{
    SolveOptions options;
    CLI::App app(DESCRIPTION, "icp-solve");
    set_program_texts(app, EXAMPLES, 30);
    declare(app, options);
    if (!parse_command_line(app, arguments, out)) return {};
    if (options.pairings.empty())
        throw std::invalid_argument("the name of a file with pairings is required (see icp-solve --help)");
    if (options.solver != "certified" && (!options.certificate.empty() || options.all_minima))
        throw std::invalid_argument("--certificate and --all-minima need --solver certified");
    if (options.solver == "gauss-newton" && options.outlier_threshold > 0)
        throw std::invalid_argument("--outlier-threshold needs another solver than gauss-newton");
    return options;
}

}  // namespace mp2p_icp_apps
