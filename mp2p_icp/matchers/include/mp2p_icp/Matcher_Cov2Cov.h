#pragma once

#include <mp2p_icp/Matcher_Points_Base.h>
#include <mp2p_icp/local_surfaces.h>

namespace mp2p_icp
{
struct SurfaceScratch;

/** Generalized ICP: pairs each local point with its nearest global point, weighted by how both clouds look
 * there. A. Segal, D. Haehnel, S. Thrun, "Generalized-ICP", RSS 2009.
 *
 * The difference d of a pair has the cost d' M d with M = 2 e (C_g + R C_l R')^-1, where R is the rotation of
 * the present pose, and C = I - (1 - e) n n' for a point in a plane of normal n: e (planeEpsilon) across, 1
 * along it. Where both normals agree, that is 1 across the plane and e along it; where they do not, less.
 * Points around which there is no plane have C = I, and hardly count.
 *
 * A pair becomes three pairings of the local point with planes through the global one: M's eigenvectors are
 * their normals and its eigenvalues their weights, whose sum of squares is d' M d to the rounding of doubles.
 * All solvers can use them.
 *
 * The normals are those of metric_map_t::local_surfaces(). One global point may serve many local ones:
 * allowMatchAlreadyMatchedGlobalPoints means nothing here. Takes about three times as long as
 * Matcher_Point2Plane.
 */
class Matcher_Cov2Cov : public Matcher_Points_Base
{
    DEFINE_MRPT_OBJECT(Matcher_Cov2Cov, mp2p_icp)

 public:
    Matcher_Cov2Cov() { mrpt::system::COutputLogger::setLoggerName("Matcher_Cov2Cov"); }
    explicit Matcher_Cov2Cov(double distThreshold) : Matcher_Cov2Cov() { distanceThreshold = distThreshold; }

    Formula distanceThreshold = 1.0;  ///< m, > 0
    double searchRadius = 1.0;        ///< m, > 0
    uint32_t knn = 20;                ///< >= 3
    double surfaceVoxelSize = 0;      ///< m; above 0: in place of searchRadius and knn
    uint32_t minimumPlanePoints = 5;  ///< >= 3
    double planeEpsilon = 1e-3;       ///< in (0, 1]; 1: plain distances between points

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
    /// Finds the neighbours nearer than `distance`.
    SurfaceScratch& nearest_points(const layer_name_t& globalLayer, const layer_name_t& localLayer,
                                   const mrpt::poses::CPose3D& localPose, double distance,
                                   MatchState& state) const;
    /// M of the k-th local point (of LocalPoints) and its neighbour.
    Eigen::Matrix3d weight_matrix(const SurfaceScratch& s, size_t k, const Eigen::Matrix3d& R) const;
};

}  // namespace mp2p_icp
