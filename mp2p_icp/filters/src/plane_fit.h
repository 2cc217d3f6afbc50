#pragma once

#include "plane_cells.h"

namespace mp2p_icp_filters
{
/// A least-squares plane in its own frame.
struct PlaneFit
{
    MomentPlane plane;
    Eigen::Vector3d u, v;   ///< directions of the widest and the narrower spread
    double noise = 0;       ///< standard deviation of the heights about the mean of each square, m
    double unevenness = 0;  ///< rms of the mean heights of the squares beyond what noise does to them, m
    bool is_uneven_by_chance = true;  ///< may noise alone do that?
    double bending = 0;               ///< rms of the best quadratic surface about the best plane, m
    bool is_bent_by_chance = true;    ///< may noise alone do that?
    double mean_incidence = 0;        ///< mean |cosine| between the normal and the rays from the sensor
};

/// Of at least 4 points, with the normal towards the sensor; `squares` tells for each one in which square of
/// the plane it is. Bending is measured among the points `surface`.
PlaneFit fit_plane(const std::vector<Eigen::Vector3d>& points, const std::vector<uint32_t>& which,
                   const std::vector<uint32_t>& squares, const std::vector<uint32_t>& surface,
                   const Eigen::Vector3d& sensor);

/// See plane_fit_t::covariance.
Eigen::Matrix3d fit_covariance(const std::vector<Eigen::Vector3d>& points, const std::vector<uint32_t>& which,
                               const PlaneFit& fit);

}  // namespace mp2p_icp_filters
