#pragma once

#include <mp2p_icp/Matcher_Points_Base.h>
#include <mp2p_icp/local_surfaces.h>

namespace mp2p_icp
{
struct SurfaceScratch;

/** Pairs each local point with the plane around its nearest global point, where the points there lie on one.
 *
 * The plane is the least-squares plane of the `knn` global points nearest to that global point (itself
 * included) within searchRadius. There is one if they are at least minimumPlanePoints, and the eigenvalues
 * e0 <= e1 <= e2 of their covariance say so: e0 <= planeEigenThreshold e2 (not a blob) and
 * e1 >= planeWidthThreshold e2 (not a line). Of the nearestPointsTried nearest global points the first with a
 * plane is taken. Both the global point and the plane must be nearer than distanceThreshold to the local
 * point, so that planes do not extend beyond the points that were seen.
 *
 * All planes of the layer are computed once (metric_map_t::local_surfaces()); then an iteration costs one
 * search per local point. One plane may serve many local points, so that global points are not used up:
 * allowMatchAlreadyMatchedGlobalPoints means nothing here.
 *
 * Local points near global points without a plane say nothing: they do not count as potential pairings. Nor,
 * with localPointMustFitPlaneToo, do those that do not lie on a plane of their own; they are not looked for.
 */
class Matcher_Point2Plane : public Matcher_Points_Base
{
    DEFINE_MRPT_OBJECT(Matcher_Point2Plane, mp2p_icp)

 public:
    Matcher_Point2Plane() { mrpt::system::COutputLogger::setLoggerName("Matcher_Point2Plane"); }
    explicit Matcher_Point2Plane(double distThreshold) : Matcher_Point2Plane()
    {
        distanceThreshold = distThreshold;
    }

    Formula distanceThreshold = 0.50;  ///< m, > 0
    double searchRadius = 0.50;        ///< m, > 0
    uint32_t knn = 10;                 ///< >= 3
    double surfaceVoxelSize = 0;       ///< m; above 0: in place of the former two
    uint32_t minimumPlanePoints = 5;   ///< >= 3
    double planeEigenThreshold = 0.01, planeWidthThreshold = 0.1;
    uint32_t nearestPointsTried = 1;

    /** Only pair where the local points around the local point lie on a plane too (by the same parameters),
     * whose normal n fits that of the global plane: |n . n_global| >= localToGlobalPlaneMinAbsCosine at the
     * current pose. */
    bool localPointMustFitPlaneToo = false;
    double localToGlobalPlaneMinAbsCosine = 0.8;

    /** Both maps are scans, taken from the origins of their frames. Then the normals of the pairings point to
     * where the global one was taken, and with localPointMustFitPlaneToo the two sides of a wall differ:
     * n . n_global without the absolute value. Otherwise the first of the largest components of a normal is
     * positive. */
    bool sensorAtOrigin = false;

    void declare_parameters(ParameterDeclaration& declare) override;
    /// The neighbourhoods to which planes are fitted, as metric_map_t::local_surfaces() knows them.
    LocalSurfaceOptions surface_options() const;
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
    SurfaceScratch& chosen_planes(const layer_name_t& globalLayer, const layer_name_t& localLayer,
                                  const mrpt::poses::CPose3D& localPose, double distance,
                                  MatchState& state) const;
};

}  // namespace mp2p_icp
