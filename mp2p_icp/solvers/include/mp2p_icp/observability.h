#pragma once

#include <mp2p_icp/Pairings.h>
#include <mrpt/math/CMatrixFixed.h>
#include <mrpt/poses/CPose3D.h>

#include <optional>
#include <string>
#include <vector>

namespace mp2p_icp
{
/// A motion that the pairings do not determine: along it, their residuals do not change.
struct FreeTwist
{
    enum class Kind : uint8_t
    {
        Translation,
        Rotation,
        Screw
    };
    Kind kind = Kind::Translation;
    mrpt::math::TVector3D axis;  ///< unit vector, global frame
    mrpt::math::TPoint3D
        through;  ///< a point of the rotation or screw axis, global frame, m; zero for a translation
    double sigma =
        0;  ///< predicted standard deviation along it: m for a translation, rad otherwise; may be infinite
    std::string name;  ///< `x y z` (translation) or `roll pitch yaw` (rotation) when within 5 degrees of that
                       ///< axis; else empty
};
/// `translation`, `rotation` or `screw`.
std::string to_string(FreeTwist::Kind kind);

/// What pairings say on the pose at which they were made.
struct Observability
{
    int rank = 0;                 ///< how many of the 6 degrees of freedom the pairings determine
    std::vector<FreeTwist> free;  ///< 6 - rank motions that they do not
    double residual_rms = 0;      ///< of the distances point to point, line or plane, m; 0 without pairings
    double sigma = 0;             ///< the standard deviation of one residual coordinate that was used, m

    /// Order x y z yaw pitch roll; 1/m^2, 1/(m rad), 1/rad^2. Exact also where the covariance is infinite.
    /// Zero if sigma is infinite.
    mrpt::math::CMatrixDouble66 information;
    /** Same order; m^2, m rad, rad^2. A coordinate with a component along a free motion has infinite
     * variance, and zeros beside it.
     */
    mrpt::math::CMatrixDouble66 covariance;
};

/** First-order analysis of all five kinds of pairings at `pose`: the information matrix J' J / sigma^2 of
 * their residuals (METHOD: a point on a point has 3 rows, on a line 2, on a plane 1; directions of lines and
 * planes weigh L^2 per rad^2, L the rms distance of the local points from their mean, 1 m with fewer than two
 * distinct ones; point pairings count with their weights).
 *
 * A motion is free when, in units where a rotation of 1 rad counts as L metres, its information is below
 * 1e-10 of the largest (or below what rounding of float coordinates produces), or when its predicted
 * deviation exceeds 0.5 rad.
 *
 * \param sigma Standard deviation of a residual coordinate, m. Empty: estimated from the residuals, sqrt(SS /
 * (rows - rank)), and at least the rounding of float coordinates; infinite when there are no more rows than
 * unknowns. \param coordinate_rounding Standard deviation of the rounding of coordinates, m. Empty: that of
 * float at the largest coordinate. Pairings with non-finite numbers are left out. O(N).
 */
Observability observability(const Pairings& pairings, const mrpt::poses::CPose3D& pose,
                            const std::optional<double>& sigma = std::nullopt,
                            const std::optional<double>& coordinate_rounding = std::nullopt);

/// observability().covariance: the covariance (x y z yaw pitch roll; m, rad) of the pose given its pairings.
mrpt::math::CMatrixDouble66 covariance(const Pairings& pairings, const mrpt::poses::CPose3D& pose);

}  // namespace mp2p_icp
