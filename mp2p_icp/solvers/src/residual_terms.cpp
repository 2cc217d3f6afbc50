#include "residual_terms.h"

#include <mp2p_icp/se3.h>

#include <cmath>

namespace mp2p_icp
{
namespace
{
Eigen::Matrix3d across(const Eigen::Vector3d& u)
{
    return Eigen::Matrix3d::Identity() - u * u.transpose();
}

ResidualTerm on_line(const mrpt::math::TLine3D& global, const mrpt::math::TPoint3D& local)
{
    return {across(direction_of(global)), to_eigen(local), to_eigen(global.pBase), 2};
}
ResidualTerm on_plane(const plane_patch_t& global, const mrpt::math::TPoint3D& local)
{
    const Eigen::Vector3d n = normal_of(global);
    return {n * n.transpose(), to_eigen(local), to_eigen(global.centroid), 1};
}
}  // namespace

ResidualTerm position_term(const mrpt::tfest::TMatchingPair_d& p)
{
    return {Eigen::Matrix3d::Identity(), to_eigen(p.local), to_eigen(p.global), 3};
}
ResidualTerm position_term(const point_line_pair_t& p)
{
    return on_line(p.ln_global, p.pt_local);
}
ResidualTerm position_term(const point_plane_pair_t& p)
{
    return on_plane(p.pl_global, p.pt_local);
}
ResidualTerm position_term(const matched_line_t& p)
{
    return on_line(p.ln_global, p.ln_local.pBase);
}
ResidualTerm position_term(const matched_plane_t& p)
{
    return on_plane(p.p_global, p.p_local.centroid);
}

ResidualTerm direction_term(const DirectionPair& u, DirectionSign sign)
{
    // |u_g - R u_l|^2 has 3 rows, of which two are independent to first order.
    if (sign == DirectionSign::Oriented) return {Eigen::Matrix3d::Identity(), u.local, u.global, 2};
    return {across(u.global), u.local, Eigen::Vector3d::Zero(), 2};
}

PairingId pairing_id(const Pairings& in, size_t i)
{
    const size_t counts[] = {in.paired_pt2pt.size(), in.paired_pt2ln.size(), in.paired_pt2pl.size(),
                             in.paired_ln2ln.size()};
    uint8_t kind = 0;
    while (kind < 4 && i >= counts[kind]) i -= counts[kind++];
    return {static_cast<PairingKind>(kind), i};
}

PairingTerms terms_of(const Pairings& in, const PairingId& id, const PairWeights& kinds)
{
    switch (id.kind)
    {
        case PairingKind::Point2Point:
            return {position_term(in.paired_pt2pt[id.index]), {}};
        case PairingKind::Point2Line:
            return {position_term(in.paired_pt2ln[id.index]), {}};
        case PairingKind::Point2Plane:
            return {position_term(in.paired_pt2pl[id.index]), {}};
        case PairingKind::Line2Line:
        {
            const auto& p = in.paired_ln2ln[id.index];
            return {position_term(p), direction_term(directions_of(p), kinds.ln2ln_sign)};
        }
        default:
        {
            const auto& p = in.paired_pl2pl[id.index];
            return {position_term(p), direction_term(directions_of(p), kinds.pl2pl_sign)};
        }
    }
}

}  // namespace mp2p_icp
