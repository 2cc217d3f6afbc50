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
    const auto to_plane = [&](const plane_patch_t& global, const mrpt::math::TPoint3D& local)
    {
        const Eigen::Vector3d n(global.plane.coefs[0], global.plane.coefs[1], global.plane.coefs[2]);
        const double along = n.dot(from(global.centroid, local));
        return along * along / n.squaredNorm();
    };
    const auto square = [](const auto& residual) { return residual.asEigen().squaredNorm(); };
    const auto to_line = [&](const mrpt::math::TLine3D& global, const mrpt::math::TPoint3D& local) {
        return square(error_point2line({global, local}, pose));
    };

    Sums all = sums_of(
        p.paired_pt2pt, p.point_weights,
        [&](const auto& pair)
        { return from(mrpt::math::TPoint3D(pair.global), mrpt::math::TPoint3D(pair.local)).squaredNorm(); });
    all += sums_of(p.paired_pt2ln, p.pt2ln_weights,
                   [&](const auto& pair) { return to_line(pair.ln_global, pair.pt_local); });
    all += sums_of(p.paired_pt2pl, p.pt2pl_weights,
                   [&](const auto& pair) { return to_plane(pair.pl_global, pair.pt_local); });
    all += sums_of(p.paired_ln2ln, p.ln2ln_weights,
                   [&](const auto& pair) { return to_line(pair.ln_global, pair.ln_local.pBase); });
    all += sums_of(p.paired_pl2pl, p.pl2pl_weights,
                   [&](const auto& pair) { return to_plane(pair.p_global, pair.p_local.centroid); });
    // Of lines, the first two rows are those of the direction.
    Sums directions = sums_of(p.paired_ln2ln, p.ln2ln_weights,
                              [&](const auto& pair)
                              { return error_line2line(pair, pose).asEigen().head(2).squaredNorm(); });
    directions += sums_of(p.paired_pl2pl, p.pl2pl_weights,
                          [&](const auto& pair) { return square(error_plane2plane(pair, pose)); });

    PairingCost out;
    out.residual_rms = all.count > 0 ? std::sqrt(all.squares / all.count) : 0;
    out.weighted = all.weighted + directions.weighted;
    return out;
}

}  // namespace mp2p_icp
