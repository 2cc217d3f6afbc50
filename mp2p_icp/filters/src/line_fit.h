#pragma once

#include <mp2p_icp/fitted_line.h>

#include "plane_cells.h"

namespace mp2p_icp_filters
{
/// A line through moments, by least squares, and the spread of the points along and across it.
struct MomentLine
{
    Eigen::Vector3d centre = Eigen::Vector3d::Zero(), direction = Eigen::Vector3d::UnitZ();
    double spread = 0, widest_across = 0;  ///< standard deviations, m
};
MomentLine line_through(const PointMoments& moments);

double distance_from(const MomentLine& line, const Eigen::Vector3d& point);

/// A fitted line; see extract_poles().
struct LineFit
{
    mp2p_icp::fitted_line_t line;
    double thickness = 0;
};
/// Of at least 3 points, along `line`, which was fitted to them. The base point is their centroid.
LineFit fit_line(const std::vector<Eigen::Vector3d>& points, const std::vector<uint32_t>& which,
                 const MomentLine& line, const Eigen::Vector3d& sensor);

}  // namespace mp2p_icp_filters
