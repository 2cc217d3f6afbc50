#pragma once

#include <mp2p_icp/QualityEvaluator.h>

namespace mp2p_icp
{
/** Do both maps look alike from the local sensor? Range images of both are made as seen from there at the
 * pose. Each pixel that shows both maps scores exp(-e^2 / (2 sigma^2)), where e is the distance from the
 * local point to the global surface: along the local normal where the neighbouring pixels determine one,
 * else along the ray; the smallest to the 3 x 3 pixels around. Where the global map shows only what lies
 * farther away, the local surface may have been hidden from it: such a pixel scores no less than if e were
 * penalty_not_visible * sigma.
 *
 * The quality is the mean of the scores, weighted by the directions of the local surfaces, so that all
 * directions count the same. Pixels that show one map only do not count, but if too few show both
 * there is no overlap and the pose is discarded. What lies on the sensor or is not finite is left out.
 *
 * After Bogoslavskyi and Stachniss, "Analyzing the quality of matched 3D point clouds of objects", IROS 2017.
 * O(points + pixels).
 */
class QualityEvaluator_RangeImageSimilarity : public QualityEvaluator
{
    DEFINE_MRPT_OBJECT(QualityEvaluator_RangeImageSimilarity, mp2p_icp)

 public:
    QualityEvaluator_RangeImageSimilarity()
    {
        mrpt::system::COutputLogger::setLoggerName("QualityEvaluator_RangeImageSimilarity");
    }

    std::vector<std::string> pointLayers;  ///< of both maps; empty: all cloud layers of each
    double sigma = 0.10;                   ///< m
    double penalty_not_visible = 2.0;      ///< in sigmas
    double minimum_overlap = 0.05;         ///< share of the local pixels

    /// A spherical image. Zero, and equal limits: what the local points fill.
    double resolution_deg = 0;
    double azimuth_from_deg = 0, azimuth_to_deg = 0;
    double elevation_from_deg = 0, elevation_to_deg = 0;

    /// With a focal length: instead, that of a pinhole camera that looks along the z axis, as the original's.
    uint32_t ncols = 0, nrows = 0;
    double cx = 0, cy = 0, fx = 0, fy = 0;

    double sensor_x = 0, sensor_y = 0, sensor_z = 0;  ///< in the local frame, m

    void declare_parameters(ParameterDeclaration& declare) override;

    Result evaluate(const metric_map_t& pcGlobal, const metric_map_t& pcLocal,
                    const mrpt::poses::CPose3D& localPose, const Pairings& pairingsFromICP,
                    const MatchContext& context) const override;
};

}  // namespace mp2p_icp
