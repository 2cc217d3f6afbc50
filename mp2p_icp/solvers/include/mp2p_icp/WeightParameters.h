#pragma once

#include <mp2p_icp/Parameterizable.h>
#include <mp2p_icp/robust_kernels.h>
#include <mrpt/poses/CPose3D.h>

#include <optional>

namespace mp2p_icp
{
/// Does the direction of a line or of a normal have a side?
enum class DirectionSign : uint8_t
{
    Free,     ///< u and -u are the same: it costs w (1 - (u_g' R u_l)^2)
    Oriented  ///< they are opposite: it costs w |u_g - R u_l|^2
};

/** How much each kind of pairing counts, and how its directions are compared. Weights are factors on squared
 * residuals, from 0 to 1e20: of 1/m^2 for positions (points on points, lines or planes; base points of lines;
 * centroids of planes), of 1/rad^2 for directions. They multiply the pairings' own weights.
 */
struct PairWeights : public Parameterizable
{
    double pt2pt = 1, pt2ln = 1, pt2pl = 1, ln2ln = 1, pl2pl = 1;  ///< of positions

    /** Of directions. Empty: the kind's position weight times L^2, L being the rms radius of the paired local
     * points (of points, lines and planes) about their centroid, 1 m with fewer than two distinct ones. So a
     * turn by 1 rad counts as much as what it does to a typical point.
     */
    std::optional<double> ln2ln_direction, pl2pl_direction;

    DirectionSign ln2ln_sign = DirectionSign::Free;
    DirectionSign pl2pl_sign = DirectionSign::Oriented;  ///< normals point towards the sensor

    void declare_parameters(ParameterDeclaration& declare) override;
};

/// Which pairings a closed form leaves out; see WeightParameters::outlier_threshold.
enum class OutlierRejection : uint8_t
{
    None,
    NoiseScale,        ///< of the points, by noise_scale_inliers()
    ConsistencyGraph,  ///< of the points, by consistency_graph_inliers()
    /** Of all kinds, by graduated non-convexity around the solver, no estimate needed: it is solved again and
     * again while the loss of the residuals goes from squares to Geman-McClure's. H. Yang, P. Antonante,
     * V. Tzoumas, L. Carlone, "Graduated non-convexity for robust spatial perception", RA-L 5(2), 2020.
     */
    GncGemanMcClure,
    GncTruncated  ///< the same, to squares that are truncated at outlier_threshold
};

/// How a closed-form solver weighs and rejects pairings.
struct WeightParameters : public Parameterizable
{
    /** Rejects point pairings by the scale test of the OLAE-ICP report, eq. (3): a and b being the two points
     * relative to the centroids, max(|a|,|b|) / min(|a|,|b|) >= scale_outlier_threshold is an outlier.
     */
    bool use_scale_outlier_detector = false;
    double scale_outlier_threshold = 1.20;

    OutlierRejection outlier_rejection = OutlierRejection::None;
    /// The largest residual of an inlier, m: a few standard deviations of the distance between paired points.
    double outlier_threshold = 0.10;

    PairWeights pair_weights;

    RobustKernel robust_kernel = RobustKernel::None;
    double robust_kernel_param = 1.0;  ///< scale of the kernel, m

    /// Where residuals for the kernel are measured. Solvers set it to the current estimate.
    std::optional<mrpt::poses::CPose3D> currentEstimateForRobust;

    /// Standard deviation of a residual of weight 1, m; only for the predicted deviations of free motions.
    /// Empty: from the residuals.
    std::optional<double> sigma;

    void declare_parameters(ParameterDeclaration& declare) override;
};

}  // namespace mp2p_icp
