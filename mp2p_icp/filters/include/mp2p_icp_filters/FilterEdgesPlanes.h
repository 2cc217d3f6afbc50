#pragma once

#include <mp2p_icp_filters/FilterBase.h>

namespace mp2p_icp_filters
{
/** Sorts the voxels of a cloud into edges and planes by the spread of their points, as the filter of this
 * name always did. FilterPlanes finds whole planes, and says how well they are known.
 *
 * Voxels are `[k*side, (k+1)*side)` on each axis for every whole k. With e0 <= e1 <= e2 the eigenvalues of
 * the covariance of its points, a voxel of at least 5 points is
 *  - a plane if its points are spread in two directions: e2 > min_e2_e0 * e0, e1 > min_e1_e0 * e0 and
 *    e1 > min_e1 (m^2);
 *  - else an edge if they are spread in one: e2 > max_e2_e0 * e0, and e1 < max_e1_e0 * e0. (The original
 * asked for e2 < max_e2_e0 * e0, which selects voxels that are round.) e0 counts as at least e2 / 1e12, so
 * that exact data have ratios, too.
 *
 * Writes, replacing what is there:
 *  - `edge_points` and `plane_points`: every voxel_filter_decimation-th point of each edge or plane voxel;
 *  - `full_decim`: every full_pointcloud_decimation-th point of the cloud;
 *  - `planes` of the map: for each plane voxel its centroid, and its normal towards the origin of the frame,
 * and `plane_centroids`. Point layers are of the class of the input, with all fields; `plane_centroids` is a
 * CSimplePointsMap. Voxels are in the order of their first points. Points that are not finite are left out.
 * One thread; O(points).
 */
class FilterEdgesPlanes : public FilterBase
{
    DEFINE_MRPT_OBJECT(FilterEdgesPlanes, mp2p_icp_filters)

 public:
    FilterEdgesPlanes();
    void declare_parameters(mp2p_icp::ParameterDeclaration& declare) override;
    void filter(mp2p_icp::metric_map_t& inOut) const override;

    std::string input_pointcloud_layer = mp2p_icp::metric_map_t::PT_LAYER_RAW;
    double voxel_filter_resolution = 0.5;      ///< side of the voxels, m
    uint32_t voxel_filter_decimation = 1;      ///< one of so many points of a voxel is kept
    uint32_t full_pointcloud_decimation = 20;  ///< one of so many points of the cloud is kept
    double voxel_filter_max_e2_e0 = 30, voxel_filter_max_e1_e0 = 30;
    double voxel_filter_min_e2_e0 = 100, voxel_filter_min_e1_e0 = 100;
    double voxel_filter_min_e1 = 0;  ///< m^2
};

}  // namespace mp2p_icp_filters
