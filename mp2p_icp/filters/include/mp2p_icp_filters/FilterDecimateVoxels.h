#pragma once

#include <mp2p_icp_filters/FilterBase.h>

#include <optional>

namespace mp2p_icp_filters
{
/// Which point stands for a cell.
enum class DecimateMethod : uint8_t
{
    FirstPoint,        ///< its first point, in the order of the input
    ClosestToAverage,  ///< the point nearest to the mean of its points; the first of several
    VoxelAverage,      ///< the mean of its points, in every field (intensity, colour, ...)
    RandomPoint  ///< any of its points with equal chance; the pick depends only on the seed, the cell and its
                 ///< points
};

/** Leaves one point per cubic cell of side voxel_filter_resolution (m).
 *
 * Cells are `[k*side, (k+1)*side)` on each axis for every whole k: the origin lies on a corner, and a point
 * exactly on a face belongs to the cell above it. The cells of all input layers are the same ones: points of
 * several layers in one cell leave one point. An input layer with fewer than minimum_input_points_to_filter
 * points is not thinned: all of its points are taken.
 *
 * The output is a new cloud of the class of the first input layer, with all fields, in the order of the input
 * (a cell stands where its first point stands). It replaces a layer of that name, which may be one of the
 * inputs. Points that are not finite are left out. With flatten_to, z of every output point is set to that
 * height; the cells are still those of the original points.
 *
 * No input layer at all (error_on_missing_input_layer: false) gives an empty CSimplePointsMap.
 * filter() throws std::invalid_argument also for a point too far away to be numbered (2^30
 * cells from the middle of the cloud).
 * O(points): about 0.1 microseconds each. The result is the same on every machine and for any number of
 * threads.
 */
class FilterDecimateVoxels : public FilterBase
{
    DEFINE_MRPT_OBJECT(FilterDecimateVoxels, mp2p_icp_filters)

 public:
    FilterDecimateVoxels();
    void declare_parameters(mp2p_icp::ParameterDeclaration& declare) override;
    void filter(mp2p_icp::metric_map_t& inOut) const override;

    std::vector<std::string> input_pointcloud_layer = {mp2p_icp::metric_map_t::PT_LAYER_RAW};
    std::string output_pointcloud_layer;
    mp2p_icp::Formula voxel_filter_resolution = 1.0;
    DecimateMethod decimate_method = DecimateMethod::FirstPoint;
    bool error_on_missing_input_layer = true;
    uint32_t minimum_input_points_to_filter = 0;
    std::optional<double> flatten_to;  ///< m
    uint32_t seed = 0;                 ///< of DecimateMethod::RandomPoint
};

}  // namespace mp2p_icp_filters
