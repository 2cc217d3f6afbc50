#include "cost_form.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace mp2p_icp_certify
{
namespace
{
constexpr int T = 9, ONE = 12;  // where t and 1 stand in a PoseVector

/// Eigenvalues below this part of the largest one are rounding: of the data, which are doubles.
constexpr Real NO_EIGENVALUE = 1e-13L;

using EigenMat3 = Eigen::SelfAdjointEigenSolver<Mat3>;

bool is_determined(const EigenMat3& eigen, int i)
{
    return eigen.eigenvalues()[i] > NO_EIGENVALUE * eigen.eigenvalues()[2];
}

Mat3 pseudo_inverse(const Mat3& m)
{
    const EigenMat3 eigen(m);
    Mat3 inverse = Mat3::Zero();
    for (int i = 0; i < 3; i++)
        if (is_determined(eigen, i))
            inverse += eigen.eigenvectors().col(i) * eigen.eigenvectors().col(i).transpose() /
                       eigen.eigenvalues()[i];
    return inverse;
}

/// The projection to the space of the columns.
Mat3 range_of(const Mat3& m)
{
    const EigenMat3 eigen(m);
    Mat3 range = Mat3::Zero();
    for (int i = 0; i < 3; i++)
        if (is_determined(eigen, i))
            range += eigen.eigenvectors().col(i) * eigen.eigenvectors().col(i).transpose();
    return range;
}

/// The least determined eigenvalue, relative to the largest; 1 if all are 0.
Real least_share(const Mat3& m)
{
    const EigenMat3 eigen(m);
    for (int i = 0; i < 3; i++)
        if (is_determined(eigen, i)) return eigen.eigenvalues()[i] / eigen.eigenvalues()[2];
    return 1;
}

PoseVector vector_of(const Mat3& R, const Vec3& t, Real one)
{
    PoseVector u;
    u << R.col(0), R.col(1), R.col(2), t, one;
    return u;
}

// ---- Pairings ---------------------------------------------------------------------------------------------
class Rows
{
 public:
    explicit Rows(CostForm& form) : form_(form) {}

    void add(const Pairing& p)
    {
        const Vec3 g = p.global.cast<Real>() - form_.global_centre;
        const Vec3 l = p.local.cast<Real>() - form_.local_centre;
        const Real w = p.weight, wd = p.direction_weight;
        const Vec3 gd = p.global_dir.cast<Real>().normalized(), ld = p.local_dir.cast<Real>().normalized();
        const bool is_line = p.kind == PairingKind::pt2ln || p.kind == PairingKind::ln2ln;
        if (p.kind == PairingKind::pt2pt)
            add_along_axes(w, l, g, 1);
        else if (is_line)
            add_across(w, gd, l, g, 1);
        else
            add_row(w, gd, l, g, 1);
        if (p.kind != PairingKind::ln2ln && p.kind != PairingKind::pl2pl) return;
        if (p.oriented)
            add_along_axes(wd, ld, gd, 0);
        else
            add_across(wd, gd, ld, Vec3::Zero(), 0);  // 1 - cos^2 is the square of the part across
    }

    /// weight * (a . (R l + tau t - g))^2
    void add_row(Real weight, const Vec3& a, const Vec3& l, const Vec3& g, Real tau)
    {
        add_row(weight, vector_of(a * l.transpose(), a * tau, -a.dot(g)));
    }
    void add_row(Real weight, const PoseVector& row)
    {
        for (int i = 0; i < 13; i++)
        {
            const Real factor = weight * row[i];
            if (factor == 0) continue;
            for (int j = 0; j <= i; j++) form_.of_pose(i, j) += factor * row[j];
        }
    }

 private:
    void add_along_axes(Real weight, const Vec3& l, const Vec3& g, Real tau)
    {
        for (int i = 0; i < 3; i++) add_row(weight, Vec3::Unit(i), l, g, tau);
    }
    /// The part across the unit vector d.
    void add_across(Real weight, const Vec3& d, const Vec3& l, const Vec3& g, Real tau)
    {
        int least = 0;
        d.cwiseAbs().minCoeff(&least);
        const Vec3 a = d.cross(Vec3::Unit(least)).normalized();
        add_row(weight, a, l, g, tau);
        add_row(weight, d.cross(a), l, g, tau);
    }

    CostForm& form_;
};

void set_centres(CostForm& form, const std::vector<Pairing>& pairings)
{
    Real sum = 0;
    Vec3 g = Vec3::Zero(), l = Vec3::Zero();
    for (const auto& p : pairings)
    {
        const Real w = p.weight;
        sum += w, g += w * p.global.cast<Real>(), l += w * p.local.cast<Real>();
    }
    if (sum > 0) form.global_centre = g / sum, form.local_centre = l / sum;
}

// ---- The prior --------------------------------------------------------------------------------------------
void check_information(const Mat6& information)
{
    // Metres and radians: each coordinate by its own unit.
    Eigen::Matrix<Real, 6, 1> unit;
    for (int i = 0; i < 6; i++)
    {
        if (!(information(i, i) >= 0))
            throw std::invalid_argument("prior.information has a negative number on its diagonal");
        unit[i] = information(i, i) > 0 ? 1 / std::sqrt(information(i, i)) : Real(1);
    }
    const Mat6 m = unit.asDiagonal() * information * unit.asDiagonal();
    if (!((m - m.transpose()).cwiseAbs().maxCoeff() < 1e-12L))
        throw std::invalid_argument("prior.information is not symmetric");
    const Eigen::SelfAdjointEigenSolver<Mat6> eigen(m, Eigen::EigenvaluesOnly);
    if (!(eigen.eigenvalues()[0] > -1e-12L))
        throw std::invalid_argument("prior.information is not positive semidefinite");
}

/** (e + A s)' Ltt (e + A s) + 4 v' S v, with e = t - t0, D = R R0', s half the axial vector of D - D', v the
 * vector part of D's quaternion. Column k of R being r_k, and b_k that of R0:
 *   s = sum of b_k x r_k / 2
 *   v v' = (D + D') / 4 + (1 - tr D) / 4 I, so 4 v' S v = tr S + sum of (2 S b_k - tr S b_k) . r_k
 */
void add_prior(CostForm& form, const Prior& prior)
{
    check_information(prior.information);
    const Mat6 information = (prior.information + prior.information.transpose()) / 2;
    const Mat3 Ltt = information.topLeftCorner<3, 3>(), Ltw = information.topRightCorner<3, 3>();
    const Mat3 A = pseudo_inverse(Ltt) * Ltw;
    const Mat3 S = information.bottomRightCorner<3, 3>() - Ltw.transpose() * A;
    const Mat3 b = nearest_rotation(prior.mean.R);

    // t = (centred t) + global_centre - R local_centre
    const Vec3 constant = form.global_centre - prior.mean.t;
    const EigenMat3 eigen(Ltt);
    for (int i = 0; i < 3; i++)
    {
        if (!is_determined(eigen, i)) continue;
        const Vec3 a = eigen.eigenvectors().col(i), Aa = A.transpose() * a;
        Mat3 of_R = -a * form.local_centre.transpose();
        for (int k = 0; k < 3; k++) of_R.col(k) += Aa.cross(Vec3(b.col(k))) / 2;
        Rows(form).add_row(eigen.eigenvalues()[i], vector_of(of_R, a, a.dot(constant)));
    }
    for (int k = 0; k < 3; k++)
        form.of_pose.block<1, 3>(ONE, 3 * k) += (S * b.col(k) - S.trace() / 2 * b.col(k)).transpose();
    form.of_pose(ONE, ONE) += S.trace();
    form.prior_rotation = S;
}

// ---- All together -----------------------------------------------------------------------------------------
void eliminate_translation(CostForm& form)
{
    Eigen::Matrix<Real, 10, 13> select = Eigen::Matrix<Real, 10, 13>::Zero();
    select.leftCols<9>().topRows<9>().setIdentity();
    select(9, ONE) = 1;
    const RotationForm xx = select * form.of_pose * select.transpose();
    const Eigen::Matrix<Real, 10, 3> xt = select * form.of_pose.middleCols<3>(T);
    const Mat3 tt = form.of_pose.block<3, 3>(T, T);
    const RotationForm reduced = xx - xt * pseudo_inverse(tt) * xt.transpose();
    form.of_rotation = (reduced + reduced.transpose()) / 2;
    form.determined = range_of(tt), form.worst_translation = least_share(tt);
}
}  // namespace

CostForm cost_form(const std::vector<Pairing>& pairings, const std::optional<Prior>& prior)
{
    CostForm form;
    set_centres(form, pairings);
    Rows rows(form);
    for (const auto& p : pairings) rows.add(p);
    if (prior) add_prior(form, *prior);
    const PoseForm lower = form.of_pose;
    form.of_pose = lower.selfadjointView<Eigen::Lower>();
    form.size = form.of_pose.topLeftCorner<9, 9>().trace() / 3 + form.of_pose(ONE, ONE);
    eliminate_translation(form);
    return form;
}

Real CostForm::at(const Mat3& R) const
{
    RotationVector x;
    x << R.col(0), R.col(1), R.col(2), 1;
    return x.dot(of_rotation * x);
}

Real CostForm::at(const Pose& pose) const
{
    const Vec3 t = determined * (pose.t + pose.R * local_centre - global_centre);
    const PoseVector u = vector_of(pose.R, t, 1);
    return u.dot(of_pose * u);
}

Real CostForm::mean() const
{
    return of_rotation.topLeftCorner<9, 9>().trace() / 3 + of_rotation(9, 9);
}

Real CostForm::rounding_of_translation(const Pose& pose) const
{
    constexpr Real DIGITS = 4 * std::numeric_limits<double>::epsilon();
    const Real t = DIGITS * (pose.t.norm() + local_centre.norm() + global_centre.norm());
    return of_pose.block<3, 3>(T, T).trace() * t * t;
}

Real CostForm::weakest_motion(const Mat3& R) const
{
    Eigen::Matrix<Real, 13, 6> motion = Eigen::Matrix<Real, 13, 6>::Zero();
    for (int i = 0; i < 3; i++)
    {
        for (int k = 0; k < 3; k++) motion.block<3, 1>(3 * k, i) = Vec3::Unit(i).cross(Vec3(R.col(k)));
        motion(T + i, 3 + i) = 1;
    }
    Mat6 information = motion.transpose() * of_pose * motion;
    information.topLeftCorner<3, 3>() += prior_rotation;
    for (int half = 0; half < 6; half += 3)  // radians and metres, each by its own unit
    {
        const Real mean = information.block<3, 3>(half, half).trace() / 3;
        if (!(mean > 0)) return 0;
        information.middleRows<3>(half) /= std::sqrt(mean),
            information.middleCols<3>(half) /= std::sqrt(mean);
    }
    const Eigen::SelfAdjointEigenSolver<Mat6> eigen(information, Eigen::EigenvaluesOnly);
    return eigen.eigenvalues()[0] / eigen.eigenvalues()[5];
}

// ---- Rotations --------------------------------------------------------------------------------------------
Real distance_to_rotation(const Mat3& R)
{
    if (!(R.determinant() > 0)) return std::numeric_limits<Real>::infinity();
    return (R.transpose() * R - Mat3::Identity()).cwiseAbs().maxCoeff();
}

Mat3 nearest_rotation(Mat3 R)
{
    for (int i = 0; i < 3; i++) R = (R * (3 * Mat3::Identity() - R.transpose() * R) / 2).eval();
    return R;
}

Real angle_between(const Mat3& R1, const Mat3& R2)
{
    return 2 * std::asin(std::min(Real(1), (R1 - R2).norm() / std::sqrt(Real(8))));
}

}  // namespace mp2p_icp_certify
