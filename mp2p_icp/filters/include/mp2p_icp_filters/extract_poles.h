#pragma once

#include <mp2p_icp/Parameterizable.h>
#include <mp2p_icp/fitted_line.h>
#include <mrpt/maps/CPointsMap.h>

#include <cstdint>
#include <vector>

namespace mp2p_icp_filters
{
/// What counts as a pole.
struct PoleParameters : public mp2p_icp::Parameterizable
{
    double voxel_size = 1.0;          ///< side of the cells whose points must be spread along a line, m
    double minimum_linearity = 2.0;   ///< spread along that line over the widest one across it
    double maximum_radius = 0.3;      ///< of its points from the line, m
    double minimum_length = 1.5;      ///< m
    double minimum_thickness = 0.02;  ///< m; see ExtractedPole. 0: also what one column of beams has seen
    uint32_t minimum_inliers = 30;    ///< points
    double maximum_angle_to_vertical_deg = 15;  ///< of the line from the z axis; 90: any direction
    double maximum_crowd = 0.1;  ///< points in the shell around it, and before it, over the inliers

    void declare_parameters(mp2p_icp::ParameterDeclaration& declare) override;
};

/// A pole, or a free edge, found in a cloud.
struct ExtractedPole
{
    mp2p_icp::fitted_line_t line;   ///< director with its largest component positive; axis a across the view
    double thickness = 0;           ///< rms distance of the points from the line, across the view, m
    std::vector<uint32_t> inliers;  ///< indices, increasing
};

/** Long thin things that stand free, that with most inliers first: poles, trunks, wires, free edges.
 *
 * Cells whose points are spread along a line (principal components) are merged along it; a line through the
 * points near it, by least squares across it, is fitted until its points stay the same. They must hang
 * together (gaps up to the side of a cell); the shell between 1.5 and 2.5 times maximum_radius around must be
 * nearly empty; and beside it, seen from the sensor, there must be next to nothing that is nearer: else it
 * may be a strip of a wall, seen through a gap. What is thinner than minimum_thickness may be one column of
 * beams on a wall seen at a low angle.
 *
 * The line runs through the middle of what was seen: of a pole of some thickness that is nearer to the sensor
 * than its axis. So thickness^2 is part of the variance of its place across (not of its direction), next to
 * that of the fit (as for planes, the sandwich of squared residuals); it is rather an upper bound. Scan lines
 * on a far surface look like wires: with maximum_angle_to_vertical_deg above some 30 degrees they are found,
 * too.
 *
 * A point belongs to one pole at most. Points that are not finite are left out. Reads only, in one thread.
 * \param sensor Where the cloud was seen from, in its frame, m.
 * \exception std::invalid_argument for parameters out of range.
 */
std::vector<ExtractedPole> extract_poles(const mrpt::maps::CPointsMap& cloud,
                                         const PoleParameters& parameters = {},
                                         const Eigen::Vector3d& sensor = Eigen::Vector3d::Zero());

}  // namespace mp2p_icp_filters
