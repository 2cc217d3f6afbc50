#pragma once

#include "plane_cells.h"

namespace mp2p_icp_filters
{
/// Two unit vectors that with the (unit) normal make a right-handed frame.
std::pair<Eigen::Vector3d, Eigen::Vector3d> axes_across(const Eigen::Vector3d& normal);

/// Points nearer than so many standard deviations are in a plane.
constexpr double NEAR_SIGMAS = 4;

/// Which points are near a plane.
struct FootprintQuery
{
    Eigen::Vector3d centre, normal;
    double sigma = 0;                          ///< noise along the normal, m
    double clearance = 0;                      ///< how far what is beside the plane matters, m
    double pitch = 0;                          ///< side of the squares that hang together, m
    double clear_pitch = 0;                    ///< side of the squares that are clear or not, m
    const std::vector<bool>* taken = nullptr;  ///< points that do not count at all
};

/** The points in a plane that hang together with given ones: in squares with points in the plane, and not
 * more beside it, at most one empty square apart.
 */
struct Footprint
{
    std::vector<uint32_t> clear;  ///< those in squares where there is nothing beside the plane; increasing
    std::vector<uint32_t> clear_square;  ///< number of the (smaller) square of each of them
    std::vector<uint32_t> surface;       ///< those that may also be above or below the plane on average
    std::vector<uint32_t> claimed;       ///< all of them, and those in the squares around; increasing
    size_t inside = 0;                   ///< how many of them are not only around
    size_t uneven = 0;                   ///< of these, how many in squares not level with the plane
};
Footprint footprint(const BlockedPoints& all, const FootprintQuery& query,
                    const std::vector<uint32_t>& starts);

}  // namespace mp2p_icp_filters
