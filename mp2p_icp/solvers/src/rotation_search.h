#pragma once

#include <Eigen/Dense>
#include <vector>

#include "pose_quadratic.h"

namespace mp2p_icp
{
/** The cost of a rotation R alone, with the best translation for each: x' Q x with x = (columns of R, 1).
 * Olsson and Eriksson, "Solving quadratically constrained geometrical problems using Lagrangian duality",
 * 2008.
 */
class RotationQuadratic
{
 public:
    explicit RotationQuadratic(const PoseQuadratic& of);

    struct Derivatives
    {
        double cost = 0;
        Eigen::Vector3d gradient;  ///< by omega in exp([omega]x) R
        Eigen::Matrix3d hessian;
    };
    const Eigen::Matrix<double, 10, 10>& matrix() const { return Q_; }
    double cost(const Eigen::Matrix3d& R) const;
    Derivatives derivatives(const Eigen::Matrix3d& R) const;

    /// By how much costs may be off when they are compared, because of how the matrix was made.
    double rounding() const { return rounding_; }
    /// What translations could take off a cost whose information is no more than rounding.
    double unresolved() const { return unresolved_; }
    /// The mean cost over all rotations, minus `cost`: what costs are compared with.
    double scale(double cost) const { return mean_cost_ - cost; }
    /// Does the cost depend on R at all, apart from rounding?
    bool depends_on_rotation(double lowest_cost) const { return scale(lowest_cost) > 1e-12 * raw_cost_; }

 private:
    Eigen::Matrix<double, 10, 10> Q_;
    double mean_cost_ = 0, raw_cost_ = 0, rounding_ = 0, unresolved_ = 0;
};

/// A local minimum of a RotationQuadratic.
struct RotationMinimum
{
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
    double cost = 0;
};

/// Are they the same minimum (within 1e-4 rad)?
bool same_rotation(const Eigen::Matrix3d& A, const Eigen::Matrix3d& B);

/// The minimum in whose basin `start` is: Newton steps in an exact trust region.
RotationMinimum minimise_rotation(const RotationQuadratic& q, const Eigen::Matrix3d& start);

/// The 60 rotations of the icosahedron, all turned by a rotation without symmetry, so that none of them
/// stands on a saddle of data along the axes.
const std::vector<Eigen::Matrix3d>& spread_rotations();
/// Of these, the `count` with the lowest costs, the lowest first.
std::vector<Eigen::Matrix3d> lowest_spread_rotations(const RotationQuadratic& q, size_t count);

/// Adds the distinct minima in whose basins the starts are; the lowest first. A valley is represented by the
/// points where the descents came to its floor.
void add_minima(const RotationQuadratic& q, const std::vector<Eigen::Matrix3d>& starts,
                std::vector<RotationMinimum>& found);

/** The distinct local minima, the lowest first: from all spread_rotations() and from `guess`.
 * (From the 24 of them with the lowest costs alone, 1 of 1e5 sets of 2 points and 2 points on planes lost its
 * global minimum.) A quartic on the rotations has at most 40 isolated critical points; no basin of a global
 * minimum was ever seen that holds none of these starts, but that is a measurement and not a proof.
 */
std::vector<RotationMinimum> all_minima(const RotationQuadratic& q, const Eigen::Matrix3d& guess);

/// In the valley of a minimum, where the rotation is nearest to `guess`; the minimum itself if it is
/// isolated.
RotationMinimum nearest_in_valley(const RotationQuadratic& q, const RotationMinimum& minimum,
                                  const Eigen::Matrix3d& guess);

/** Those of all_minima() that may be the lowest, for all that the sums can tell (to within 1e-9 of scale());
 * `guess` itself if the cost does not depend on the rotation.
 */
std::vector<RotationMinimum> lowest_minima(const RotationQuadratic& q, const Eigen::Matrix3d& guess);

}  // namespace mp2p_icp
