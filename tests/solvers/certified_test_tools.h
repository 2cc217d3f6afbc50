#pragma once

#include <mp2p_icp/optimal_tf_certified.h>

#include <algorithm>
#include <string>

#include "exact_mixes.h"

/** \file A second, slow and plain calculation of what the certified solver minimises: rows in long double,
 * one at a time, and descents of Levenberg and Marquardt. It shares no code with the library.
 */
namespace mp2p_icp_test
{
using mp2p_icp::CertifiedParameters;
using mp2p_icp::CertifiedResult;
using mp2p_icp::GlobalVerdict;
using mp2p_icp::PairWeights;
using mp2p_icp::PoseMinimum;

using Real = long double;
using RealVector3 = Eigen::Matrix<Real, 3, 1>;
using RealMatrix3 = Eigen::Matrix<Real, 3, 3>;
using Vector10 = Eigen::Matrix<double, 10, 1>;
using Matrix10 = Eigen::Matrix<double, 10, 10>;

/// weight (a' (R p + position t - q))^2
struct Row
{
    Real weight = 0;
    RealVector3 a, p, q;
    bool position = true;
};

/// The rows of pairings, and with them the cost of any pose.
class RowSet
{
 public:
    /// `L` turns the weights of positions into those of directions where these are not given.
    RowSet(const Pairings& in, const PairWeights& w, double L);

    /// By residuals.
    double cost(const CPose3D& pose) const
    {
        return static_cast<double>(cost_at(rotation(pose), translation(pose)));
    }
    /// With the best translation of all; nothing for the directions that no row determines.
    double cost_with_best_translation(const Matrix3d& R) const;
    /// x' Q x with x = (columns of R, 1): that cost, for descents.
    const Matrix10& form() const { return form_; }
    size_t size() const { return rows_.size(); }

 private:
    static RealMatrix3 rotation(const CPose3D& pose) { return mp2p_icp::rotation_of(pose).cast<Real>(); }
    static RealVector3 translation(const CPose3D& pose)
    {
        return mp2p_icp::translation_of(pose).cast<Real>();
    }
    void add_position(Real weight, const std::vector<RealVector3>& along, const mrpt::math::TPoint3D& local,
                      const mrpt::math::TPoint3D& global);
    void add_direction(Real weight, const RealVector3& global, const RealVector3& local,
                       mp2p_icp::DirectionSign sign);
    Real cost_at(const RealMatrix3& R, const RealVector3& t) const;
    void centre();
    void make_form();

    std::vector<Row> rows_;
    RealVector3 local_centre_ = RealVector3::Zero(), global_centre_ = RealVector3::Zero();
    Eigen::Matrix<Real, 3, 10> best_translation_;  ///< of the centre, by (columns of R, 1)
    Matrix10 form_ = Matrix10::Zero();
};

inline RealVector3 real(const mrpt::math::TPoint3D& p)
{
    return mp2p_icp::to_eigen(p).cast<Real>();
}
inline RealVector3 director_of(const mrpt::math::TLine3D& l)
{
    return real(mrpt::math::TPoint3D(l.director)).normalized();
}
inline RealVector3 normal_of(const mp2p_icp::plane_patch_t& p)
{
    return RealVector3(p.plane.coefs[0], p.plane.coefs[1], p.plane.coefs[2]).normalized();
}
inline std::vector<RealVector3> across(const RealVector3& u)
{
    const RealVector3 a = u.unitOrthogonal();
    return {a, u.cross(a)};
}
inline std::vector<RealVector3> all_axes()
{
    return {RealVector3::UnitX(), RealVector3::UnitY(), RealVector3::UnitZ()};
}

inline RowSet::RowSet(const Pairings& in, const PairWeights& w, double L)
{
    const auto weight = [](double kind, const std::vector<double>& own, size_t i)
    { return static_cast<Real>(kind) * static_cast<Real>(own[i]); };
    const auto own = [](const mp2p_icp::WeightRuns& runs, const auto& list)
    { return mp2p_icp::expanded_weights(runs, list.size()); };
    const auto points = own(in.point_weights, in.paired_pt2pt),
               on_lines = own(in.pt2ln_weights, in.paired_pt2ln),
               on_planes = own(in.pt2pl_weights, in.paired_pt2pl),
               lines = own(in.ln2ln_weights, in.paired_ln2ln),
               planes = own(in.pl2pl_weights, in.paired_pl2pl);
    for (size_t i = 0; i < points.size(); i++)
        add_position(weight(w.pt2pt, points, i), all_axes(), mrpt::math::TPoint3D(in.paired_pt2pt[i].local),
                     mrpt::math::TPoint3D(in.paired_pt2pt[i].global));
    for (size_t i = 0; i < on_lines.size(); i++)
    {
        const auto& p = in.paired_pt2ln[i];
        add_position(weight(w.pt2ln, on_lines, i), across(director_of(p.ln_global)), p.pt_local,
                     p.ln_global.pBase);
    }
    for (size_t i = 0; i < on_planes.size(); i++)
    {
        const auto& p = in.paired_pt2pl[i];
        add_position(weight(w.pt2pl, on_planes, i), {normal_of(p.pl_global)}, p.pt_local,
                     p.pl_global.centroid);
    }
    for (size_t i = 0; i < lines.size(); i++)
    {
        const auto& p = in.paired_ln2ln[i];
        const RealVector3 u = director_of(p.ln_global);
        add_position(weight(w.ln2ln, lines, i), across(u), p.ln_local.pBase, p.ln_global.pBase);
        add_direction(weight(w.ln2ln_direction.value_or(w.ln2ln * L * L), lines, i), u,
                      director_of(p.ln_local), w.ln2ln_sign);
    }
    for (size_t i = 0; i < planes.size(); i++)
    {
        const auto& p = in.paired_pl2pl[i];
        const RealVector3 n = normal_of(p.p_global);
        add_position(weight(w.pl2pl, planes, i), {n}, p.p_local.centroid, p.p_global.centroid);
        add_direction(weight(w.pl2pl_direction.value_or(w.pl2pl * L * L), planes, i), n, normal_of(p.p_local),
                      w.pl2pl_sign);
    }
    centre();
    make_form();
}

inline void RowSet::add_position(Real weight, const std::vector<RealVector3>& along,
                                 const mrpt::math::TPoint3D& local, const mrpt::math::TPoint3D& global)
{
    for (const auto& a : along) rows_.push_back({weight, a, real(local), real(global), true});
}

inline void RowSet::add_direction(Real weight, const RealVector3& global, const RealVector3& local,
                                  mp2p_icp::DirectionSign sign)
{
    const bool is_free = sign == mp2p_icp::DirectionSign::Free;
    for (const auto& a : is_free ? across(global) : all_axes())
        rows_.push_back({weight, a, local, is_free ? RealVector3(RealVector3::Zero()) : global, false});
}

inline Real RowSet::cost_at(const RealMatrix3& R, const RealVector3& t) const
{
    // As it was before centre(): t puts the local origin, c the local centre.
    const RealVector3 c = R * local_centre_ + t - global_centre_;
    Real sum = 0;
    for (const auto& r : rows_)
    {
        const Real residual = r.a.dot(R * r.p + (r.position ? c : RealVector3(RealVector3::Zero())) - r.q);
        sum += r.weight * residual * residual;
    }
    return sum;
}

inline void RowSet::centre()
{
    Real w = 0;
    for (const auto& r : rows_)
        if (r.position) local_centre_ += r.weight * r.p, global_centre_ += r.weight * r.q, w += r.weight;
    if (!(w > 0)) return;
    local_centre_ /= w, global_centre_ /= w;
    for (auto& r : rows_)
        if (r.position) r.p -= local_centre_, r.q -= global_centre_;
}

inline void RowSet::make_form()
{
    Eigen::Matrix<Real, 13, 13> M = Eigen::Matrix<Real, 13, 13>::Zero();  // of (columns of R, 1, c)
    for (const auto& r : rows_)
    {
        Eigen::Matrix<Real, 13, 1> j = Eigen::Matrix<Real, 13, 1>::Zero();
        for (int k = 0; k < 3; k++) j.segment<3>(3 * k) = r.p(k) * r.a;
        j(9) = -r.a.dot(r.q);
        if (r.position) j.tail<3>() = r.a;
        M += r.weight * j * j.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<RealMatrix3> eigen(RealMatrix3(M.bottomRightCorner<3, 3>()));
    best_translation_.setZero();
    for (int i = 0; i < 3; i++)
    {
        if (!(eigen.eigenvalues()(i) > 1e-14L * eigen.eigenvalues()(2))) continue;
        const RealVector3 u = eigen.eigenvectors().col(i);
        best_translation_ -= u * (u.transpose() * M.block<3, 10>(10, 0)) / eigen.eigenvalues()(i);
    }
    form_ = (M.topLeftCorner<10, 10>() + M.block<10, 3>(0, 10) * best_translation_).cast<double>();
    form_ = (0.5 * (form_ + form_.transpose())).eval();
}

inline Vector10 stacked(const Matrix3d& R)
{
    Vector10 x;
    x << R.col(0), R.col(1), R.col(2), 1;
    return x;
}

inline double RowSet::cost_with_best_translation(const Matrix3d& R) const
{
    const RealVector3 c = best_translation_ * stacked(R).cast<Real>();
    const RealMatrix3 turn = R.cast<Real>();
    return static_cast<double>(cost_at(turn, c + global_centre_ - turn * local_centre_));
}

/// The local minimum of x' Q x that steps of Levenberg and Marquardt come to, with exact second derivatives.
inline Matrix3d descended(const Matrix10& Q, Matrix3d R)
{
    double damping = 0, cost = stacked(R).dot(Q * stacked(R));
    for (int k = 0; k < 60; k++)
    {
        const Vector10 y = Q * stacked(R);
        const Matrix3d A = Eigen::Map<const Matrix3d>(y.data()) * R.transpose();
        const Vector3d g = 2 * Vector3d(A(2, 1) - A(1, 2), A(0, 2) - A(2, 0), A(1, 0) - A(0, 1));
        Eigen::Matrix<double, 9, 3> J;
        for (int j = 0; j < 3; j++) J.middleRows<3>(3 * j) = -cross_matrix(R.col(j));
        const Matrix3d H = 2 * J.transpose() * Q.topLeftCorner<9, 9>() * J + A + A.transpose() -
                           2 * A.trace() * Matrix3d::Identity();
        const double size = H.norm() + Q.norm() * 1e-16;
        bool lower = false;
        Vector3d step = Vector3d::Zero();
        for (int tries = 0; tries < 12 && !lower; tries++)
        {
            const Eigen::LLT<Matrix3d> factor(H + damping * Matrix3d::Identity());
            if (factor.info() == Eigen::Success)
            {
                step = -factor.solve(g);
                if (step.norm() < 2)
                {
                    const Matrix3d next =
                        rotation_about(step.norm() > 0 ? step : Vector3d::UnitX(), step.norm()) * R;
                    const double there = stacked(next).dot(Q * stacked(next));
                    lower = there < cost;
                    if (lower) R = next, cost = there;
                }
            }
            damping = lower ? 0.1 * damping : std::max(4 * damping, 0.02 * size);
        }
        if (!lower || step.norm() < 1e-9) break;
        if (damping < 1e-3 * size) damping = 0;
    }
    return Eigen::Quaterniond(R).normalized().toRotationMatrix();
}

/// The best of descents from so many random rotations.
inline Matrix3d best_of_descents(const Matrix10& Q, size_t starts, SeededRandom& random)
{
    Matrix3d best = Matrix3d::Identity();
    double lowest = std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < starts; i++)
    {
        const Matrix3d R = descended(Q, any_rotation(random));
        const double cost = stacked(R).dot(Q * stacked(R));
        if (cost < lowest) lowest = cost, best = R;
    }
    return best;
}

/** What rounding in double makes of a cost that is calculated from sums: some dozen roundings (1e-16) of the
 * largest products, |X|^2 |K|, |X|^2 = 4; and of what the elimination of the translation takes off, row^2 /
 * value for each of its three directions, row and value being as exact as the largest ones are.
 */
inline double sums_rounding(const mp2p_icp::PoseQuadratic& sums)
{
    const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(Matrix3d(sums.K.bottomRightCorner<3, 3>()));
    Eigen::Matrix<double, 10, 3> coupling;
    coupling << sums.K.topRightCorner<9, 3>(), sums.k.tail<3>().transpose();
    const double largest = eigen.eigenvalues()(2);
    double size = sums.K.norm() + sums.k.norm() + sums.qq;
    for (int i = 0; i < 3; i++)
        if (const double value = eigen.eigenvalues()(i); value > 1e-10 * largest)
        {
            const double row = (coupling * eigen.eigenvectors().col(i)).norm();
            size += 2 * row * coupling.norm() / value + row * row * largest / (value * value);
        }
    return 1e-14 * size;
}

inline CertifiedParameters parameters_of(const ExactMix& mix)
{
    CertifiedParameters p;
    p.weights.pair_weights.pl2pl_sign = mix.normals;
    return p;
}
inline RowSet rows_of(const Pairings& in, const PairWeights& w)
{
    return {in, w, mp2p_icp::pose_quadratic(in, w).L()};
}

/// A weight of its own for each pairing.
template <class Weight>
void weigh_at_random(Pairings& p, const Weight& weight)
{
    const auto runs = [&weight](size_t count)
    {
        mp2p_icp::WeightRuns out;
        for (size_t i = 0; i < count; i++) out.emplace_back(1, weight());
        return out;
    };
    p.point_weights = runs(p.paired_pt2pt.size()), p.pt2ln_weights = runs(p.paired_pt2ln.size());
    p.pt2pl_weights = runs(p.paired_pt2pl.size()), p.ln2ln_weights = runs(p.paired_ln2ln.size());
    p.pl2pl_weights = runs(p.paired_pl2pl.size());
}

/// Calls f(pairings, parameters, name, noise) for a set of each mix, size (minimal, one more, 10, 100) and
/// noise, relative to the half size of the scene.
template <class F>
void for_each_instance(const std::vector<double>& noises, SeededRandom& random, const F& f)
{
    constexpr double HALF_SIZE = 5;
    const auto any = [&random](const std::vector<Mix>& of) { return of[random.index(of.size())]; };
    for (const auto& mix : exact_mixes())
        for (int size = 0; size < 4; size++)
            for (const double noise : noises)
            {
                const Mix counts = size == 0   ? any(mix.minimal)
                                   : size == 1 ? any(mix.one_more)
                                   : size == 2 ? mix.ten
                                               : mix.hundred;
                Pairings pairings = random_pairings(counts, any_rotation(random), random_point(random, 20),
                                                    random, noise * HALF_SIZE, HALF_SIZE);
                weigh_at_random(pairings, [&] { return random.uniform(0.1, 3); });
                SCOPED_TRACE(std::string(mix.name) + ", size " + std::to_string(size) + ", noise " +
                             std::to_string(noise));
                f(pairings, parameters_of(mix), mix, noise);
            }
}
}  // namespace mp2p_icp_test
