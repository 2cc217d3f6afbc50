#pragma once

#include <mp2p_icp/Matcher_Points_Base.h>
#include <mp2p_icp/local_surfaces.h>

namespace mp2p_icp
{
struct SurfaceScratch;

/** Pairs each local point with what is there around its nearest global point: with its plane, with its line,
 * or else with the point itself. How far that may be follows from the distances at the current pose.
 *
 * The threshold: of the n local points that have a global point nearer than absoluteMaxSearchDistance, take
 * the distances to the nearest one; the ceil(confidenceInterval n)-th smallest of them, but at least
 * minimumCorrDist and at most absoluteMaxSearchDistance, is the largest distance that is paired. So the
 * farthest fraction 1 - confidenceInterval is left out until they come within minimumCorrDist.
 *
 * Planes and lines are those of Matcher_Point2Plane and Matcher_Point2Line, of the planeSearchPoints nearest
 * points within searchRadius. They serve many local points. Point pairings are one-to-one by best pair,
 * unless allowMatchAlreadyMatchedGlobalPoints.
 */
class Matcher_Adaptive : public Matcher_Points_Base
{
    DEFINE_MRPT_OBJECT(Matcher_Adaptive, mp2p_icp)

 public:
    Matcher_Adaptive() { mrpt::system::COutputLogger::setLoggerName("Matcher_Adaptive"); }

    double confidenceInterval = 0.80;         ///< in (0, 1)
    double minimumCorrDist = 0.10;            ///< m, > 0
    Formula absoluteMaxSearchDistance = 5.0;  ///< m, > 0

    bool enableDetectPlanes = true, enableDetectLines = true;
    double searchRadius = 0.50;            ///< m, > 0
    uint32_t planeSearchPoints = 8;        ///< >= 3
    uint32_t planeMinimumFoundPoints = 4;  ///< >= 3; for lines, too
    double planeEigenThreshold = 0.01, planeWidthThreshold = 0.1, lineEigenThreshold = 0.01;
    /// Points farther from the plane or line than this (m) are paired with the global point. 0: no limit but
    /// the threshold.
    double planeMinimumDistance = 0;
    bool sensorAtOrigin = false;  ///< as for Matcher_Point2Plane: orients the normals

    /// Up to so many global points per local point, none farther than firstToSecondDistanceMax times the
    /// nearest. Planes and lines around them are looked for in the same order.
    uint32_t maxPt2PtCorrespondences = 1;
    double firstToSecondDistanceMax = 1.2;  ///< >= 1

    void declare_parameters(ParameterDeclaration& declare) override;
    /// absoluteMaxSearchDistance now.
    std::optional<double> gate(const MatchContext& context) const override;

 protected:
    void implMatchOneLayer(const layer_name_t& globalLayer, const layer_name_t& localLayer,
                           const mrpt::poses::CPose3D& localPose, const MatchContext& context,
                           MatchState& state, Pairings& out) const override;
    /// Two costs of each local point: that of its plane or line, and that of its nearest point if there is
    /// neither.
    void append_costs(const layer_name_t& globalLayer, const layer_name_t& localLayer,
                      const mrpt::poses::CPose3D& localPose, const MatchContext& context, MatchState& state,
                      double gate, std::vector<double>& costs) const override;

 private:
    /// Of each local point, the global points nearer than `distance`.
    SurfaceScratch& nearest_points(const layer_name_t& globalLayer, const layer_name_t& localLayer,
                                   const mrpt::poses::CPose3D& localPose, double distance,
                                   MatchState& state) const;
    /// The planes and lines around them, nearer than `threshold`.
    void choose(const layer_name_t& globalLayer, const layer_name_t& localLayer, double threshold,
                const MatchState& state, SurfaceScratch& s) const;
};

}  // namespace mp2p_icp
