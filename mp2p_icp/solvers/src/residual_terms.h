#pragma once

#include <mp2p_icp/Pairings.h>

#include <Eigen/Dense>
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

    bool finite() const { return C.allFinite() && b.allFinite() && q.allFinite(); }
};

ResidualTerm position_term(const mrpt::tfest::TMatchingPair_d& p);
ResidualTerm position_term(const point_line_pair_t& p);
ResidualTerm position_term(const point_plane_pair_t& p);
ResidualTerm position_term(const matched_line_t& p);   ///< local base point on global line
ResidualTerm position_term(const matched_plane_t& p);  ///< local centroid on global plane

/// Across the global line: of the same norm for both signs of the local direction.
ResidualTerm direction_term(const matched_line_t& p);
/// Difference of oriented normals.
ResidualTerm direction_term(const matched_plane_t& p);

/// All that one pairing says.
struct PairingTerms
{
    ResidualTerm position;
    std::optional<ResidualTerm> direction;

    bool finite() const { return position.finite() && (!direction || direction->finite()); }
};

/// Of the i-th of `in.size()` pairings: points, point-line, point-plane, lines, planes, in their lists'
/// order.
PairingTerms terms_of(const Pairings& in, size_t i);

}  // namespace mp2p_icp
