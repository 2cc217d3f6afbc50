#include "pairing_cost.h"

#include <mp2p_icp/errorTerms.h>
#include <mp2p_icp/parallel.h>

#include <cmath>

namespace mp2p_icp
{
namespace
{
template <class List, class ErrorTerm>
double cost_of(const List& list, const WeightRuns& runs, const ErrorTerm& error_term)
{
    const auto weights = runs.empty() ? std::vector<double>() : expanded_weights(runs, list.size());
    return block_sum<double>(list.size(),
                             [&](size_t first, size_t last)
                             {
                                 double sum = 0;
                                 for (size_t i = first; i < last; i++)
                                 {
                                     const double square = error_term(list[i]);
                                     if (std::isfinite(square))
                                         sum += (weights.empty() ? 1.0 : weights[i]) * square;
                                 }
                                 return sum;
                             });
}
}  // namespace

double weighted_cost(const Pairings& p, const mrpt::poses::CPose3D& pose)
{
    const auto square = [](const auto& residual) { return residual.asEigen().squaredNorm(); };
    return cost_of(p.paired_pt2pt, p.point_weights,
                   [&](const auto& pair)
                   {
                       const mrpt::math::TPoint3D local = pair.local, global = pair.global;
                       return (pose.composePoint(local) - global).sqrNorm();
                   }) +
           cost_of(p.paired_pt2ln, p.pt2ln_weights,
                   [&](const auto& pair) { return square(error_point2line(pair, pose)); }) +
           cost_of(p.paired_pt2pl, p.pt2pl_weights,
                   [&](const auto& pair) { return square(error_point2plane(pair, pose)); }) +
           cost_of(p.paired_ln2ln, p.ln2ln_weights,
                   [&](const auto& pair) { return square(error_line2line(pair, pose)); }) +
           cost_of(p.paired_pl2pl, p.pl2pl_weights,
                   [&](const auto& pair) { return square(error_plane2plane(pair, pose)); });
}

}  // namespace mp2p_icp
