#pragma once

#include <mp2p_icp/QualityEvaluator.h>

namespace mp2p_icp
{
/** Is the space that the local map occupies occupied in the global map too, and is that free through which
 * the local sensor saw? Both maps are cut into voxels about the sensor, at the pose; of each occupied local
 * voxel one point is asked:
 *
 * - where the global map is occupied nearby, it scores exp(-d^2 / 2) with its distance d from the surface in
 *   there, in sigmas of a quarter of a voxel (half a voxel along the surface, beyond its end); off a surface
 *   that covers the place, nothing;
 * - else, behind a global surface, through which the sensor could not have seen, it scores nothing;
 * - else, in front of a global surface, nothing, with half the weight: the global map may not have seen it;
 * - else the place is unknown to the global map, and does not count.
 *
 * The quality is the weighted mean; voxels weigh by the directions of the local surfaces, so that all
 * directions count the same. Where too few voxels count there is no overlap and the pose is discarded.
 * The free space is left out where the rays of the local map cross its own surfaces: then its origin is not
 * the place of a sensor. O(points + voxels along the rays).
 */
class QualityEvaluator_Voxels : public QualityEvaluator
{
    DEFINE_MRPT_OBJECT(QualityEvaluator_Voxels, mp2p_icp)

 public:
    QualityEvaluator_Voxels() { mrpt::system::COutputLogger::setLoggerName("QualityEvaluator_Voxels"); }

    std::vector<std::string> pointLayers;  ///< of both maps; empty: all cloud layers of each
    double resolution = 0;                 ///< side of a voxel, m; 0: from the local points
    bool use_free_space = true;
    double minimum_overlap = 0.05;  ///< share of the local voxels

    double sensor_x = 0, sensor_y = 0, sensor_z = 0;  ///< in the local frame, m

    void declare_parameters(ParameterDeclaration& declare) override;

    Result evaluate(const metric_map_t& pcGlobal, const metric_map_t& pcLocal,
                    const mrpt::poses::CPose3D& localPose, const Pairings& pairingsFromICP,
                    const MatchContext& context) const override;
};

}  // namespace mp2p_icp
