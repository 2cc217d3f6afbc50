#include "rotation_search.h"

#include <mp2p_icp/se3.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "euler_rates.h"
#include "rotation_vector.h"

namespace mp2p_icp
{
namespace
{
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Vector10 = Eigen::Matrix<double, 10, 1>;

Vector10 stacked(const Matrix3d& R)
{
    Vector10 x;
    x << R.col(0), R.col(1), R.col(2), 1;
    return x;
}

Matrix3d orthonormal(const Matrix3d& R)
{
    return Quaterniond(R).normalized().toRotationMatrix();
}

std::vector<Matrix3d> make_spread_rotations()
{
    const double golden = 0.5 * (1 + std::sqrt(5.0));
    const Quaterniond turn = Quaterniond(0.8, 0.31, -0.43, 0.27).normalized();
    std::vector<Quaterniond> group;
    const auto add = [&group](const Eigen::Vector4d& q)
    {
        const Quaterniond candidate = Quaterniond(q(0), q(1), q(2), q(3)).normalized();
        for (const auto& known : group)
            if (std::abs(known.dot(candidate)) > 1 - 1e-9) return;
        group.push_back(candidate);
    };
    for (int i = 0; i < 4; i++) add(Eigen::Vector4d::Unit(i));
    for (int signs = 0; signs < 8; signs++)
        add({1, signs & 1 ? 1. : -1., signs & 2 ? 1. : -1., signs & 4 ? 1. : -1.});
    static constexpr int even[12][4] = {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}, {1, 0, 3, 2},
                                        {1, 2, 0, 3}, {1, 3, 2, 0}, {2, 0, 1, 3}, {2, 1, 3, 0},
                                        {2, 3, 0, 1}, {3, 0, 2, 1}, {3, 1, 0, 2}, {3, 2, 1, 0}};
    for (const auto& place : even)
        for (int signs = 0; signs < 8; signs++)
        {
            Eigen::Vector4d q = Eigen::Vector4d::Zero();
            q(place[0]) = signs & 1 ? 1 : -1, q(place[1]) = (signs & 2 ? 1 : -1) * golden,
            q(place[2]) = (signs & 4 ? 1 : -1) / golden;
            add(q);
        }
    std::vector<Matrix3d> out;
    for (const auto& q : group) out.push_back((turn * q).toRotationMatrix());
    return out;
}

using SpreadColumns = Eigen::Matrix<double, 10, Eigen::Dynamic>;

SpreadColumns stacked(const std::vector<Matrix3d>& rotations)
{
    SpreadColumns out(10, static_cast<Eigen::Index>(rotations.size()));
    for (size_t i = 0; i < rotations.size(); i++)
        out.col(static_cast<Eigen::Index>(i)) = stacked(rotations[i]);
    return out;
}

/// Of a Hessian, below this part of the cost's scale: a valley, not a slope.
constexpr double FLAT = 1e-9;
constexpr int MOST_STEPS = 1000;
constexpr int MOST_VALLEY_STEPS = 200;
constexpr double SAME_ROTATION = 1e-4;  // rad

/// Newton's step, if the Hessian is clearly positive definite: most are, and this is ten times as fast as
/// what follows.
std::optional<Vector3d> newton_step(const RotationQuadratic::Derivatives& d, double scale)
{
    const Eigen::LLT<Matrix3d> convex(d.hessian - FLAT * scale * Matrix3d::Identity());
    if (convex.info() != Eigen::Success) return std::nullopt;
    return Vector3d(-d.hessian.llt().solve(d.gradient));
}

/// The step of least quadratic model within a ball. Along flat directions without slope it does not move.
Vector3d trust_region_step(const RotationQuadratic::Derivatives& d, double scale, double radius)
{
    if (const auto newton = newton_step(d, scale); newton && newton->norm() <= radius) return *newton;
    const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(d.hessian);
    const Vector3d l = eigen.eigenvalues();
    Vector3d c = eigen.eigenvectors().transpose() * d.gradient;
    for (int i = 0; i < 3; i++)
        if (std::abs(l(i)) < FLAT * scale && std::abs(c(i)) < 1e-12 * scale) c(i) = 0;
    const auto step_at = [&](double mu)
    {
        Vector3d s = Vector3d::Zero();
        for (int i = 0; i < 3; i++)
            if (c(i) != 0) s(i) = -c(i) / (l(i) + mu);
        return s;
    };
    const double least = std::max(0.0, -l(0)) * (1 + 1e-12);
    Vector3d s = step_at(l(0) > 0 ? 0 : least + 1e-12 * scale);
    if (s.norm() > radius || l(0) <= 0)
    {
        double lo = least, hi = least + c.norm() / radius + 1e-12 * scale;
        for (int k = 0; k < 60 && hi - lo > 1e-3 * (hi - least); k++)
        {
            const double mid = 0.5 * (lo + hi);
            (step_at(mid).norm() > radius ? lo : hi) = mid;
        }
        s = step_at(hi);
        // On a saddle or a ridge without slope: downhill is along the lowest eigenvector.
        if (l(0) < -FLAT * scale && s.norm() < 0.9 * radius)
            s(0) += (c(0) > 0 ? -1 : 1) * std::sqrt(std::max(0.0, radius * radius - s.squaredNorm()));
    }
    return eigen.eigenvectors() * s;
}

/// Newton's, without any part along flat directions.
Vector3d step_across_valley(const RotationQuadratic::Derivatives& d, double scale)
{
    if (const auto newton = newton_step(d, scale)) return *newton;
    const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(d.hessian);
    Vector3d step = Vector3d::Zero();
    for (int i = 0; i < 3; i++)
    {
        const Vector3d u = eigen.eigenvectors().col(i);
        if (eigen.eigenvalues()(i) > FLAT * scale) step -= u * u.dot(d.gradient) / eigen.eigenvalues()(i);
    }
    return step;
}

/// Steps that settle the gradient where the cost is already flat to rounding.
Matrix3d polished(const RotationQuadratic& q, Matrix3d R)
{
    for (int k = 0; k < 2; k++)
    {
        const auto d = q.derivatives(R);
        const Vector3d step = step_across_valley(d, q.scale(d.cost));
        if (!(step.norm() < 0.1)) break;
        R = orthonormal(rotation_by(step) * R);
    }
    return R;
}

}  // namespace

RotationQuadratic::RotationQuadratic(const PoseQuadratic& of)
{
    const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(of.K.bottomRightCorner<3, 3>());
    Eigen::Matrix<double, 10, 3> Q_xt;
    Q_xt << of.K.topRightCorner<9, 3>(), -of.k.tail<3>().transpose();
    Q_.topLeftCorner<9, 9>() = of.K.topLeftCorner<9, 9>();
    Q_.topRightCorner<9, 1>() = -of.k.head<9>(), Q_.bottomLeftCorner<1, 9>() = -of.k.head<9>().transpose();
    Q_(9, 9) = of.qq;
    raw_cost_ = Q_.topLeftCorner<9, 9>().trace() / 3 + Q_(9, 9);
    const double largest = eigen.eigenvalues()(2);
    double amplified = 0;
    rounding_ = 16 * (4e-15 * Q_.norm() + of.rounding);  // |x|^2 is 4, and costs are compared
    for (int i = 0; i < 3 && largest > 0; i++)
    {
        const double value = eigen.eigenvalues()(i);
        const Vector10 row = Q_xt * eigen.eigenvectors().col(i);
        if (value > RESOLVED_INFORMATION * largest)
        {
            Q_ -= row * row.transpose() / value;
            // Both are as exact as the largest: that counts more where the translation is known badly.
            amplified += Q_xt.norm() * row.norm() / value + row.squaredNorm() * largest / (value * value);
        }
        else
            unresolved_ += 4 * row.squaredNorm() / std::max(value, 1e-16 * largest);
    }
    rounding_ += 2e-15 * amplified;
    Q_ = (0.5 * (Q_ + Q_.transpose())).eval();
    mean_cost_ = Q_.topLeftCorner<9, 9>().trace() / 3 + Q_(9, 9);
}

double RotationQuadratic::cost(const Matrix3d& R) const
{
    const Vector10 x = stacked(R);
    return x.dot(Q_ * x);
}

RotationQuadratic::Derivatives RotationQuadratic::derivatives(const Matrix3d& R) const
{
    const Vector10 x = stacked(R), y = Q_ * x;
    Derivatives out;
    out.cost = x.dot(y);
    const Matrix3d A = Eigen::Map<const Matrix3d>(y.data()) * R.transpose();
    out.gradient = 2 * Vector3d(A(2, 1) - A(1, 2), A(0, 2) - A(2, 0), A(1, 0) - A(0, 1));
    Eigen::Matrix<double, 9, 3> X;
    for (int j = 0; j < 3; j++) X.middleRows<3>(3 * j) = -skew(R.col(j));
    out.hessian = 2 * X.transpose() * Q_.topLeftCorner<9, 9>() * X + A + A.transpose() -
                  2 * A.trace() * Matrix3d::Identity();
    return out;
}

RotationMinimum minimise_rotation(const RotationQuadratic& q, const Matrix3d& start)
{
    Matrix3d R = start;
    auto d = q.derivatives(R);
    double radius = 0.7;
    for (int k = 0; k < MOST_STEPS; k++)
    {
        const double scale = std::max(q.scale(d.cost), 0.0);
        const Vector3d s = trust_region_step(d, scale, radius);
        const double predicted = -(d.gradient.dot(s) + 0.5 * s.dot(d.hessian * s));
        if (!(predicted > 1e-17 * scale)) break;
        const Matrix3d next = orthonormal(rotation_by(s) * R);
        const auto there = q.derivatives(next);
        const double noise = 1e-16 * scale, ratio = (d.cost - there.cost + noise) / (predicted + noise);
        if (ratio < 0.25)
            radius = 0.25 * s.norm();
        else if (ratio > 0.6 && s.norm() > 0.9 * radius)
            radius = std::min(2 * radius, 1.5);
        if (ratio > 0.05)
            R = next, d = there;
        else if (radius < 1e-12)
            break;
    }
    R = polished(q, R);
    return {R, q.cost(R)};
}

bool same_rotation(const Matrix3d& A, const Matrix3d& B)
{
    return (A - B).squaredNorm() < 2 * SAME_ROTATION * SAME_ROTATION;
}

const std::vector<Matrix3d>& spread_rotations()
{
    static const std::vector<Matrix3d> all = make_spread_rotations();
    return all;
}

std::vector<Matrix3d> lowest_spread_rotations(const RotationQuadratic& q, size_t count)
{
    static const SpreadColumns X = stacked(spread_rotations());
    const Eigen::VectorXd costs = (q.matrix() * X).cwiseProduct(X).colwise().sum().transpose();
    std::vector<Eigen::Index> order(static_cast<size_t>(costs.size()));
    for (size_t i = 0; i < order.size(); i++) order[i] = static_cast<Eigen::Index>(i);
    count = std::min(count, order.size());
    std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count), order.end(),
                      [&](auto a, auto b)
                      { return std::make_pair(costs(a), a) < std::make_pair(costs(b), b); });
    std::vector<Matrix3d> out;
    for (size_t i = 0; i < count; i++) out.push_back(spread_rotations()[static_cast<size_t>(order[i])]);
    return out;
}

void add_minima(const RotationQuadratic& q, const std::vector<Matrix3d>& starts,
                std::vector<RotationMinimum>& found)
{
    for (const auto& start : starts)
    {
        const auto at = minimise_rotation(q, start);
        const bool known = std::any_of(found.begin(), found.end(),
                                       [&](const auto& other) { return same_rotation(other.R, at.R); });
        if (!known) found.push_back(at);
    }
    std::stable_sort(found.begin(), found.end(),
                     [](const auto& a, const auto& b) { return a.cost < b.cost; });
}

std::vector<RotationMinimum> all_minima(const RotationQuadratic& q, const Matrix3d& guess)
{
    std::vector<RotationMinimum> found;
    add_minima(q, {guess}, found);
    add_minima(q, spread_rotations(), found);
    return found;
}

namespace
{
/// Along flat directions, towards the guess.
Vector3d way_along_valley(const RotationQuadratic& q, const Matrix3d& R, const Vector3d& to_guess)
{
    const auto d = q.derivatives(R);
    const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(d.hessian);
    Vector3d way = Vector3d::Zero();
    for (int i = 0; i < 3; i++)
        if (const Vector3d u = eigen.eigenvectors().col(i); eigen.eigenvalues()(i) < FLAT * q.scale(d.cost))
            way += u * u.dot(to_guess);
    return way;
}
}  // namespace

RotationMinimum nearest_in_valley(const RotationQuadratic& q, const RotationMinimum& minimum,
                                  const Matrix3d& guess)
{
    RotationMinimum at = minimum;
    const double highest = minimum.cost + 1e-13 * std::max(q.scale(minimum.cost), 0.0) + q.rounding();
    // Where the ways become shorter but slowly, the curvature of the valley makes them too short.
    double stretch = 1, last_way = std::numeric_limits<double>::infinity();
    for (int k = 0; k < MOST_VALLEY_STEPS; k++)
    {
        const Vector3d to_guess = rotation_between(at.R, guess);
        Vector3d way = way_along_valley(q, at.R, to_guess);
        if (way.norm() < 1e-11) break;
        stretch = way.norm() > 0.5 * last_way ? std::min(1.5 * stretch, 20.0) : 1.0;
        last_way = way.norm();
        way *= stretch;
        bool moved = false;
        for (int halving = 0; halving < 6 && !moved; halving++, way *= 0.5)
        {
            const auto next = minimise_rotation(q, orthonormal(rotation_by(way) * at.R));
            moved = next.cost <= highest && rotation_between(next.R, guess).norm() < to_guess.norm() - 1e-14;
            if (moved) at = next, stretch *= std::pow(0.5, halving);
        }
        if (!moved) break;
    }
    return at;
}

std::vector<RotationMinimum> lowest_minima(const RotationQuadratic& q, const Matrix3d& guess)
{
    auto minima = all_minima(q, guess);
    if (!q.depends_on_rotation(minima.front().cost)) return {{guess, q.cost(guess)}};
    const double equal = minima.front().cost + 1e-9 * q.scale(minima.front().cost);
    size_t count = 1;
    while (count < minima.size() && minima[count].cost <= equal) count++;
    minima.resize(count);
    return minima;
}

}  // namespace mp2p_icp
