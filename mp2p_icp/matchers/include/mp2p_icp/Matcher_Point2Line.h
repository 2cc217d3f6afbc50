#pragma once

#include <mp2p_icp/Matcher_Points_Base.h>
#include <mp2p_icp/local_surfaces.h>

namespace mp2p_icp
{
struct SurfaceScratch;

/** Pairs each local point with the line around its nearest global point, where the points there lie on one:
 * walls in 2-D scans, poles, edges.
 *
 * The line is the least-squares line of the `knn` global points nearest to that global point (itself
 * included) within searchRadius. There is one if they are at least minimumLinePoints, and the eigenvalues
 * e0 <= e1 <= e2 of their covariance say so: e1 <= lineEigenThreshold e2. Of the nearestPointsTried nearest
 * global points the first with a line is taken. Both the global point and the line must be nearer than
 * distanceThreshold to the local point, so that lines do not extend beyond the points that were seen.
 *
 * All lines of the layer are computed once (metric_map_t::local_surfaces()). One line may serve many local
 * points: allowMatchAlreadyMatchedGlobalPoints means nothing here.
 *
 * Local points near global points without a line say nothing: they do not count as potential pairings.
 */
class Matcher_Point2Line : public Matcher_Points_Base
{
    DEFINE_MRPT_OBJECT(Matcher_Point2Line, mp2p_icp)

 public:
    Matcher_Point2Line() { mrpt::system::COutputLogger::setLoggerName("Matcher_Point2Line"); }
    explicit Matcher_Point2Line(double distThreshold) : Matcher_Point2Line()
    {
        distanceThreshold = distThreshold;
    }

    Formula distanceThreshold = 0.50;  ///< m, > 0
    double searchRadius = 0.50;        ///< m, > 0
    uint32_t knn = 5;                  ///< >= 3
    uint32_t minimumLinePoints = 4;    ///< >= 3: two points are always on a line
    double lineEigenThreshold = 0.01;
    uint32_t nearestPointsTried = 1;

    void declare_parameters(ParameterDeclaration& declare) override;
    /// distanceThreshold now.
    std::optional<double> gate(const MatchContext& context) const override;

 protected:
    void implMatchOneLayer(const layer_name_t& globalLayer, const layer_name_t& localLayer,
                           const mrpt::poses::CPose3D& localPose, const MatchContext& context,
                           MatchState& state, Pairings& out) const override;
    void append_costs(const layer_name_t& globalLayer, const layer_name_t& localLayer,
                      const mrpt::poses::CPose3D& localPose, const MatchContext& context, MatchState& state,
                      double gate, std::vector<double>& costs) const override;

 private:
    /// Finds what each local point is paired with, if that is nearer than `distance`.
    SurfaceScratch& chosen_lines(const layer_name_t& globalLayer, const layer_name_t& localLayer,
                                 const mrpt::poses::CPose3D& localPose, double distance,
                                 MatchState& state) const;
};

}  // namespace mp2p_icp
