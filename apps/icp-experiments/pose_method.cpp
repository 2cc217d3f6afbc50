#include "pose_method.h"

#include <mp2p_icp/PoseQuadratic.h>
#include <mp2p_icp/optimal_tf_certified.h>
#include <mp2p_icp/optimal_tf_gauss_newton.h>
#include <mp2p_icp/optimal_tf_horn.h>
#include <mp2p_icp/optimal_tf_olae.h>

#include <cmath>

namespace mp2p_icp_apps::experiments
{
using namespace mp2p_icp;

namespace
{
constexpr double SCALE_THRESHOLD = 1.2;  // the report's s_t = 0.2 bounds the ratio less 1

/// Points and directions of weight 1, positions of planes and lines without.
PairWeights directions_of(double weight)
{
    PairWeights w;
    w.pl2pl = w.ln2ln = 0;
    w.pl2pl_direction = w.ln2ln_direction = weight;
    return w;
}

/// optimal_tf_olae() weighs the unit vectors of points by L^2: with it, all unit vectors are equal.
PairWeights equal_unit_vectors(const Pairings& pairings)
{
    return directions_of(std::pow(pose_quadratic(pairings, directions_of(1)).L(), 2));
}

std::string id_of(const std::string& solver, Weighting weighting)
{
    return solver + (weighting == Weighting::Likely ? "-ml" : "");
}
std::string label_of(const std::string& solver, Weighting weighting)
{
    return solver + (weighting == Weighting::Likely ? ", ML weights" : "");
}

WeightParameters closed_form_weights(const PoseProblem& problem, Weighting weighting, bool is_olae)
{
    WeightParameters wp;
    if (weighting == Weighting::Likely)
        wp.pair_weights = problem.likely;
    else
        wp.pair_weights = is_olae ? equal_unit_vectors(problem.pairings) : directions_of(1);
    wp.use_scale_outlier_detector = problem.scale_threshold.has_value();
    if (problem.scale_threshold) wp.scale_outlier_threshold = *problem.scale_threshold;
    wp.robust_kernel = problem.kernel, wp.robust_kernel_param = problem.kernel_scale;
    wp.currentEstimateForRobust = problem.estimate;
    return wp;
}

PoseMethod olae_by(const std::string& id, const std::string& label, OlaeSystem system, Weighting weighting)
{
    return {id_of(id, weighting), label_of(label, weighting),
            [=](const PoseProblem& p, OptimalTF_Result& r)
            {
                return optimal_tf_olae(p.pairings, closed_form_weights(p, weighting, true), r, std::nullopt,
                                       {system, true});
            }};
}

}  // namespace

PoseMethod olae(Weighting weighting)
{
    return olae_by("olae", "OLAE", OlaeSystem::Report, weighting);
}
PoseMethod olae_least_squares(Weighting weighting)
{
    return olae_by("olae-least-squares", "OLAE, true least squares", OlaeSystem::LeastSquares, weighting);
}
PoseMethod olae_newton(Weighting weighting)
{
    return olae_by("olae-newton", "OLAE, Newton steps", OlaeSystem::Newton, weighting);
}

PoseMethod horn(Weighting weighting)
{
    return {id_of("horn", weighting), label_of("Horn", weighting),
            [=](const PoseProblem& p, OptimalTF_Result& r)
            { return optimal_tf_horn(p.pairings, closed_form_weights(p, weighting, false), r); }};
}

namespace
{
/// From the estimate: started at the closed form, it would not tell whether both have the same minimum.
bool solve_gauss_newton(const PoseProblem& p, const PairWeights& weights, OptimalTF_Result& r)
{
    OptimalTF_GN_Parameters gn;
    gn.linearizationPoint = p.estimate;
    gn.pairWeights = weights, gn.maxInnerLoopIterations = 200, gn.minDelta = 1e-10;
    return optimal_tf_gauss_newton(p.pairings, r, gn);
}
}  // namespace

PoseMethod gauss_newton(Weighting weighting)
{
    return {id_of("gauss-newton", weighting), label_of("Gauss–Newton", weighting),
            [=](const PoseProblem& p, OptimalTF_Result& r)
            { return solve_gauss_newton(p, closed_form_weights(p, weighting, false).pair_weights, r); }};
}

PoseMethod gauss_newton_unit()
{
    PairWeights unit;
    unit.pl2pl_direction = unit.ln2ln_direction = 1;
    return {"gauss-newton-unit", "Gauss–Newton, unit weights",
            [=](const PoseProblem& p, OptimalTF_Result& r) { return solve_gauss_newton(p, unit, r); }};
}

PoseMethod certified(Weighting weighting)
{
    return {id_of("certified", weighting), label_of("Certified", weighting),
            [=](const PoseProblem& p, OptimalTF_Result& r)
            {
                CertifiedParameters parameters;
                parameters.weights = closed_form_weights(p, weighting, false);
                CertifiedResult result;
                const bool solved = optimal_tf_certified(p.pairings, result, parameters);
                r = result;
                return solved;
            }};
}

PoseMethod with_scale_test(const PoseMethod& plain)
{
    return {plain.id + "-scale-test", plain.label + ", scale test",
            [=](PoseProblem p, OptimalTF_Result& r)
            {
                p.scale_threshold = SCALE_THRESHOLD;
                return plain.solve(p, r);
            }};
}

PoseMethod horn_with(OutlierRejection rejection)
{
    std::string id, label;
    switch (rejection)
    {
        case OutlierRejection::NoiseScale:
            id = "horn-noise-scale", label = "Horn, noise-scaled test";
            break;
        case OutlierRejection::ConsistencyGraph:
            id = "horn-consistency-graph", label = "Horn, consistency graph";
            break;
        case OutlierRejection::GncGemanMcClure:
            id = "horn-gnc-geman-mcclure", label = "Horn, GNC Geman–McClure";
            break;
        case OutlierRejection::GncTruncated:
            id = "horn-gnc-truncated", label = "Horn, GNC truncated";
            break;
        default:
            return horn(Weighting::Report);
    }
    return {id, label,
            [=](const PoseProblem& p, OptimalTF_Result& r)
            {
                WeightParameters wp = closed_form_weights(p, Weighting::Report, false);
                wp.outlier_rejection = rejection, wp.outlier_threshold = p.outlier_threshold;
                return optimal_tf_horn(p.pairings, wp, r);
            }};
}

PoseMethod with_loss(const PoseMethod& plain, int times)
{
    const std::string often = times > 1 ? ", " + std::to_string(times) + " times" : "";
    return {plain.id + "-loss" + (times > 1 ? "-iterated" : ""), plain.label + ", robust loss" + often,
            [=](PoseProblem p, OptimalTF_Result& r)
            {
                p.kernel = RobustKernel::GemanMcClure;
                bool solved = true;
                for (int k = 0; k < times && solved; k++)
                {
                    solved = plain.solve(p, r);
                    p.estimate = r.optimalPose;
                }
                return solved;
            }};
}

}  // namespace mp2p_icp_apps::experiments
