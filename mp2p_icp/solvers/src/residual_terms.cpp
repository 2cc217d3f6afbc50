#include "residual_terms.h"

#include <mp2p_icp/se3.h>

namespace mp2p_icp
{
namespace
{
/// NaN for a vector of zero length, which has no direction.
Eigen::Vector3d unit(const Eigen::Vector3d& v)
{
    return v / v.stableNorm();
}
Eigen::Vector3d direction_of(const mrpt::math::TLine3D& line)
{
    return unit(to_eigen(line.director));
}
Eigen::Vector3d normal_of(const plane_patch_t& patch)
{
    return unit({patch.plane.coefs[0], patch.plane.coefs[1], patch.plane.coefs[2]});
}

Eigen::Matrix3d across(const Eigen::Vector3d& u)
{
    return Eigen::Matrix3d::Identity() - u * u.transpose();
}

ResidualTerm on_line(const mrpt::math::TLine3D& global, const mrpt::math::TPoint3D& local)
{
    return {across(direction_of(global)), to_eigen(local), to_eigen(global.pBase)};
}
ResidualTerm on_plane(const plane_patch_t& global, const mrpt::math::TPoint3D& local)
{
    const Eigen::Vector3d n = normal_of(global);
    return {n * n.transpose(), to_eigen(local), to_eigen(global.centroid)};
}
}  // namespace

ResidualTerm position_term(const mrpt::tfest::TMatchingPair_d& p)
{
    return {Eigen::Matrix3d::Identity(), to_eigen(p.local), to_eigen(p.global)};
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

ResidualTerm direction_term(const matched_line_t& p)
{
    return {across(direction_of(p.ln_global)), direction_of(p.ln_local), Eigen::Vector3d::Zero()};
}
ResidualTerm direction_term(const matched_plane_t& p)
{
    return {Eigen::Matrix3d::Identity(), normal_of(p.p_local), normal_of(p.p_global)};
}

PairingTerms terms_of(const Pairings& in, size_t i)
{
    if (i < in.paired_pt2pt.size()) return {position_term(in.paired_pt2pt[i]), {}};
    i -= in.paired_pt2pt.size();
    if (i < in.paired_pt2ln.size()) return {position_term(in.paired_pt2ln[i]), {}};
    i -= in.paired_pt2ln.size();
    if (i < in.paired_pt2pl.size()) return {position_term(in.paired_pt2pl[i]), {}};
    i -= in.paired_pt2pl.size();
    if (i < in.paired_ln2ln.size())
        return {position_term(in.paired_ln2ln[i]), direction_term(in.paired_ln2ln[i])};
    i -= in.paired_ln2ln.size();
    return {position_term(in.paired_pl2pl[i]), direction_term(in.paired_pl2pl[i])};
}

}  // namespace mp2p_icp
