#include "pairing_cost.h"

#include <mp2p_icp/errorTerms.h>
#include <mp2p_icp/parallel.h>
#include <mp2p_icp/se3.h>

#include <cmath>

namespace mp2p_icp
{
namespace
{
struct Sums
{
    double weighted = 0, squares = 0, count = 0;
    Sums& operator+=(const Sums& o)
    {
        weighted += o.weighted, squares += o.squares, count += o.count;
        return *this;
    }
};

/// \param square of the residual of a pair
template <class List, class Square>
Sums sums_of(const List& list, const WeightRuns& runs, const Square& square)
{
    const auto weights = runs.empty() ? std::vector<double>() : expanded_weights(runs, list.size());
    return block_sum<Sums>(list.size(),
                           [&](size_t first, size_t last)
                           {
                               Sums sums;
                               for (size_t i = first; i < last; i++)
                               {
                                   const double s = square(list[i]);
                                   if (!std::isfinite(s)) continue;
                                   sums += {(weights.empty() ? 1.0 : weights[i]) * s, s, 1};
                               }
                               return sums;
                           });
}
}  // namespace

PairingCost pairing_cost(const Pairings& p, const mrpt::poses::CPose3D& pose)
{
    // Of points and planes, which may be many, without the general form.
    const Eigen::Matrix3d R = rotation_of(pose);
    const Eigen::Vector3d t = translation_of(pose);
    const auto from = [&](const mrpt::math::TPoint3D& global, const mrpt::math::TPoint3D& local)
    { return Eigen::Vector3d(R * to_eigen(local) + t - to_eigen(global)); };
    const auto square = [](const auto& residual) { return residual.asEigen().squaredNorm(); };
    Sums sums = sums_of(
        p.paired_pt2pt, p.point_weights,
        [&](const auto& pair)
        { return from(mrpt::math::TPoint3D(pair.global), mrpt::math::TPoint3D(pair.local)).squaredNorm(); });
    sums += sums_of(p.paired_pt2ln, p.pt2ln_weights,
                    [&](const auto& pair) { return square(error_point2line(pair, pose)); });
    sums += sums_of(p.paired_pt2pl, p.pt2pl_weights,
                    [&](const auto& pair)
                    {
                        const auto& c = pair.pl_global.plane.coefs;
                        const Eigen::Vector3d n(c[0], c[1], c[2]);
                        const double along = n.dot(from(pair.pl_global.centroid, pair.pt_local));
                        return along * along / n.squaredNorm();
                    });
    PairingCost out;
    out.residual_rms = sums.count > 0 ? std::sqrt(sums.squares / sums.count) : 0;
    out.weighted = sums.weighted +
                   sums_of(p.paired_ln2ln, p.ln2ln_weights,
                           [&](const auto& pair) { return square(error_line2line(pair, pose)); })
                       .weighted +
                   sums_of(p.paired_pl2pl, p.pl2pl_weights,
                           [&](const auto& pair) { return square(error_plane2plane(pair, pose)); })
                       .weighted;
    return out;
}

}  // namespace mp2p_icp
