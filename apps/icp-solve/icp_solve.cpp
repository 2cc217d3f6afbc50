#include "icp_solve.h"

#include <mp2p_icp/PoseQuadratic.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/optimal_tf_gauss_newton.h>
#include <mp2p_icp/optimal_tf_horn.h>
#include <mp2p_icp/optimal_tf_olae.h>
#include <mp2p_icp/write_certificate.h>

#include <fstream>
#include <new>
#include <ostream>
#include <sstream>
#include <stdexcept>

#include "pairings_file.h"
#include "pose_text.h"
#include "report_text.h"
#include "solve_options.h"

namespace mp2p_icp_apps
{
namespace
{
using namespace mp2p_icp;
using mrpt::poses::CPose3D;

constexpr int SOLVED = 0, WRONG_INPUT = 1, NOT_DETERMINED = 2;

WeightParameters weight_parameters(const SolveOptions& o, const PairingsFile& file)
{
    WeightParameters wp;
    wp.pair_weights = file.weights;
    if (o.outlier_threshold > 0)
        wp.outlier_rejection = OutlierRejection::GncTruncated, wp.outlier_threshold = o.outlier_threshold;
    return wp;
}

void print_solution(const OptimalTF_Result& r, std::ostream& out)
{
    out << "pose: " << pose_line(r.optimalPose) << "\n"
        << "pairings determine " << r.rank << " of 6 degrees of freedom";
    if (r.skipped > 0) out << "; " << r.skipped << " left out for numbers that are not finite";
    if (!r.outliers.empty()) out << "; " << r.outliers.size() << " outliers left out";
    out << "\n";
    for (const auto& t : r.free) print_free_motion(out, t);
}

std::string explained(GlobalVerdict verdict)
{
    switch (verdict)
    {
        case GlobalVerdict::Global:
            return "no other pose fits as well: proven";
        case GlobalVerdict::GlobalAmbiguous:
            return "no pose fits better (proven), but others fit as well";
        case GlobalVerdict::Gap:
            return "the best pose found; that none is better is not proven";
        default:
            return "no pose fits better (proven), but along some motion all fit as well";
    }
}

void print_certified(const CertifiedResult& r, std::ostream& out)
{
    out << "verdict: " << to_string(r.verdict) << ": " << explained(r.verdict) << "\n"
        << "cost: " << r.cost << " m^2; none is lower by more than " << r.gap << " m^2";
    if (r.scale > 0) out << " (" << r.gap / r.scale << " of what other rotations cost)";
    out << "\n";
    if (r.minima.size() > 1) out << "local minima, the nearest of the lowest first:\n";
    for (const auto& m : r.minima)
        if (r.minima.size() > 1) out << "  cost " << m.cost << " m^2: " << pose_line(m.pose) << "\n";
}

void write_file(const std::string& name, const std::string& text)
{
    std::ofstream file(name, std::ios::binary);
    file << text;
    if (!file.flush()) throw DataError(name, "cannot be written");
}

int solve_certified(const SolveOptions& o, const PairingsFile& file, const std::optional<CPose3D>& guess,
                    std::ostream& out)
{
    CertifiedParameters p;
    p.weights = weight_parameters(o, file), p.guess = guess, p.all_minima = o.all_minima;
    std::ostringstream certificate;
    const CertifiedResult r = write_certificate(certificate, file.pairings, p);
    print_solution(r, out), print_certified(r, out);
    if (!o.certificate.empty()) write_file(o.certificate, certificate.str());
    return r.verdict == GlobalVerdict::Global && r.rank == 6 ? SOLVED : NOT_DETERMINED;
}

int solve_by(const SolveOptions& o, const PairingsFile& file, const std::optional<CPose3D>& guess,
             std::ostream& out)
{
    OptimalTF_Result r;
    const WeightParameters wp = weight_parameters(o, file);
    if (o.solver == "horn")
        optimal_tf_horn(file.pairings, wp, r, guess);
    else if (o.solver == "olae")
        optimal_tf_olae(file.pairings, wp, r, guess);
    else
    {
        OptimalTF_GN_Parameters p;
        p.pairWeights = file.weights, p.linearizationPoint = guess, p.maxInnerLoopIterations = 100;
        optimal_tf_gauss_newton(file.pairings, r, p);
    }
    print_solution(r, out);
    return r.rank == 6 ? SOLVED : NOT_DETERMINED;
}

int run(const std::vector<std::string>& arguments, std::ostream& out)
{
    const auto options = parse_solve_options(arguments, out);
    if (!options) return SOLVED;
    std::optional<CPose3D> guess;
    if (!options->guess.empty()) guess = CPose3D(pose_from_argument("--guess", options->guess));
    const PairingsFile file = load_pairings(options->pairings);
    if (pose_quadratic(file.pairings, file.weights).empty())
        throw DataError(options->pairings, "no pairing has a positive weight");
    return options->solver == "certified" ? solve_certified(*options, file, guess, out)
                                          : solve_by(*options, file, guess, out);
}

int complain(std::ostream& err, const std::string& what)
{
    err << "icp-solve: " << what << "\n";
    return WRONG_INPUT;
}
}  // namespace

int icp_solve(const std::vector<std::string>& arguments, std::ostream& out, std::ostream& err) noexcept
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
        return complain(err, short_reason(e));
    }
}

}  // namespace mp2p_icp_apps
