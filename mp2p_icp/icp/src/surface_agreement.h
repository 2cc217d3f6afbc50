#pragma once

#include <Eigen/Dense>
#include <optional>
#include <vector>

namespace mp2p_icp
{
/// A local point and the surface with which it is paired.
struct SurfaceDistance
{
    Eigen::Vector3d normal;  ///< unit
    double distance = 0;     ///< of the point along it, m
    double thickness = 0;    ///< of the global cloud there: rms, m
};

struct SurfaceAgreement
{
    Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
    double share = 1;
};

/** Whether paired points lie on the surfaces with which they are paired, seen by direction: of a street laid
 * on another one, half of the points lie on the ground, as they should, but the walls do not. At a right
 * pose, all directions agree.
 *
 * A point lies on a surface that is no farther than three times what both clouds are thick, or a quarter of
 * the distance between neighbours, whatever is larger. \return the principal direction of the normals that
 * agrees least, with the share of the points (weighted by how far they face it) that do; empty if too few
 * points say anything. Directions that hardly any surface faces do not count.
 */
std::optional<SurfaceAgreement> least_agreement(const std::vector<SurfaceDistance>& distances,
                                                double local_thickness, double spacing);

}  // namespace mp2p_icp
