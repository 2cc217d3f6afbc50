#pragma once

#include <mp2p_icp/Pairings.h>
#include <mp2p_icp/WeightParameters.h>

#include <Eigen/Dense>
#include <cmath>
#include <optional>

namespace mp2p_icp
{
/** A part of a pairing's residual, linear in the pose: C (R b + t - q) for a position, in metres, and
 * C (R b - q) for a direction, b and q being unit vectors. C is a projection: it keeps what the primitive
 * determines.
 */
struct ResidualTerm
{
    Eigen::Matrix3d C = Eigen::Matrix3d::Identity();
    Eigen::Vector3d b = Eigen::Vector3d::Zero(), q = Eigen::Vector3d::Zero();
    int rows = 3;  ///< rank of C

    bool finite() const { return C.allFinite() && b.allFinite() && q.allFinite(); }
};

ResidualTerm position_term(const mrpt::tfest::TMatchingPair_d& p);
ResidualTerm position_term(const point_line_pair_t& p);
ResidualTerm position_term(const point_plane_pair_t& p);
ResidualTerm position_term(const matched_line_t& p);   ///< local base point on global line
ResidualTerm position_term(const matched_plane_t& p);  ///< local centroid on global plane

/// NaN for a vector of zero length, which has no direction.
inline Eigen::Vector3d unit(const Eigen::Vector3d& v)
{
    const double square = v.squaredNorm();
    return v * (1 / (square > 1e-200 && square < 1e200 ? std::sqrt(square) : v.stableNorm()));
}
inline Eigen::Vector3d direction_of(const mrpt::math::TLine3D& line)
{
    return unit({line.director.x, line.director.y, line.director.z});
}
inline Eigen::Vector3d normal_of(const plane_patch_t& patch)
{
    return unit({patch.plane.coefs[0], patch.plane.coefs[1], patch.plane.coefs[2]});
}

/// Of a line or plane: the unit direction or normal, as seen from either side.
struct DirectionPair
{
    Eigen::Vector3d local, global;
};
inline DirectionPair directions_of(const matched_line_t& p)
{
    return {direction_of(p.ln_local), direction_of(p.ln_global)};
}
inline DirectionPair directions_of(const matched_plane_t& p)
{
    return {normal_of(p.p_local), normal_of(p.p_global)};
}

/// Oriented: the difference R u_l - u_g. Free: its part across u_g, of the same norm for both signs of u_l.
ResidualTerm direction_term(const DirectionPair& u, DirectionSign sign);

/// All that one pairing says.
struct PairingTerms
{
    ResidualTerm position;
    std::optional<ResidualTerm> direction;

    bool finite() const { return position.finite() && (!direction || direction->finite()); }
};

enum class PairingKind : uint8_t
{
    Point2Point,
    Point2Line,
    Point2Plane,
    Line2Line,
    Plane2Plane
};
/// A pairing's list and its place in it.
struct PairingId
{
    PairingKind kind;
    size_t index;
};
/// The i-th of `in.size()` pairings, in the order of PairingKind.
PairingId pairing_id(const Pairings& in, size_t i);

PairingTerms terms_of(const Pairings& in, const PairingId& id, const PairWeights& kinds);

}  // namespace mp2p_icp
