#include "plane_fit.h"

#include <algorithm>
#include <cmath>

namespace mp2p_icp_filters
{
using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace
{
/// Divides the variance of the heights into that within squares and that of their means.
void measure_unevenness(const std::vector<Vector3d>& points, const std::vector<uint32_t>& which,
                        const std::vector<uint32_t>& squares, PlaneFit& fit)
{
    struct Square
    {
        double count = 0, sum = 0, sum_sq = 0;
    };
    std::vector<Square> all(*std::max_element(squares.begin(), squares.end()) + 1);
    for (size_t k = 0; k < which.size(); k++)
    {
        const double h = fit.plane.normal.dot(points[which[k]] - fit.plane.centre);
        Square& s = all[squares[k]];
        s.count += 1, s.sum += h, s.sum_sq += h * h;
    }
    double between = 0, within = 0, used = 0;
    for (const Square& s : all)
    {
        if (s.count == 0) continue;
        used += 1;
        between += s.sum * s.sum / s.count;
        within += std::max(0.0, s.sum_sq - s.sum * s.sum / s.count);
    }
    const double count = static_cast<double>(which.size()), free_within = count - used;
    constexpr double ENOUGH = 20;  // of points beyond one per square: else noise and unevenness look the same
    fit.noise = fit.plane.sigma;
    if (free_within < ENOUGH) return;
    const double variance = within / free_within, free_between = std::max(0.0, used - 3);
    fit.noise = std::sqrt(variance);
    const double beyond = between - free_between * variance;
    fit.unevenness = std::sqrt(std::max(0.0, beyond) / count);
    fit.is_uneven_by_chance = beyond <= 4 * variance * std::sqrt(2 * std::max(1.0, free_between));
}

/** How much better a quadratic surface fits than the plane. Where there are few points in each square, this
 * is what tells a bent surface.
 */
void measure_bending(const std::vector<Vector3d>& points, const std::vector<uint32_t>& which, PlaneFit& fit)
{
    using Matrix6d = Eigen::Matrix<double, 6, 6>;
    using Vector6d = Eigen::Matrix<double, 6, 1>;
    const double scale_u = std::max(fit.plane.spread_2, 1e-12), scale_v = std::max(fit.plane.spread_1, 1e-12);
    Matrix6d normal = Matrix6d::Zero();
    Vector6d right = Vector6d::Zero();
    double about_plane = 0;
    for (const uint32_t i : which)
    {
        const Vector3d d = points[i] - fit.plane.centre;
        const double u = fit.u.dot(d) / scale_u, v = fit.v.dot(d) / scale_v, h = fit.plane.normal.dot(d);
        Vector6d x;
        x << 1, u, v, u * u, u * v, v * v;
        normal += x * x.transpose();
        right += x * h;
        about_plane += h * h;
    }
    const double count = static_cast<double>(which.size());
    const double by_quadratic = right.dot(normal.ldlt().solve(right));
    const Vector3d right_3 = right.head<3>();
    const double by_plane = right_3.dot(normal.topLeftCorner<3, 3>().ldlt().solve(right_3));
    const double explained = std::max(0.0, by_quadratic - by_plane);
    const double variance = std::max(0.0, about_plane - by_quadratic) / std::max(1.0, count - 6);
    constexpr double SIGNIFICANT = 16;  // of chi2(3): 1e-3
    fit.bending = std::sqrt(explained / count);
    fit.noise = std::min(fit.noise, std::sqrt(variance));
    fit.is_bent_by_chance = explained <= SIGNIFICANT * variance;
}
}  // namespace

PlaneFit fit_plane(const std::vector<Vector3d>& points, const std::vector<uint32_t>& which,
                   const std::vector<uint32_t>& squares, const std::vector<uint32_t>& surface,
                   const Vector3d& sensor)
{
    const PointMoments moments = moments_of(points, which.data(), which.data() + which.size());
    PlaneFit fit;
    fit.plane = plane_through(moments);
    if (fit.plane.normal.dot(fit.plane.centre - sensor) > 0) fit.plane.normal = -fit.plane.normal;
    const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(moments.scatter);
    const Vector3d widest = eigen.eigenvectors().col(2);
    int largest = 0;
    widest.cwiseAbs().maxCoeff(&largest);
    fit.u = widest(largest) < 0 ? Vector3d(-widest) : widest;
    fit.u = (fit.u - fit.plane.normal * fit.plane.normal.dot(fit.u)).normalized();
    fit.v = fit.plane.normal.cross(fit.u);
    measure_unevenness(points, which, squares, fit);
    measure_bending(points, surface, fit);
    for (const uint32_t i : which)
    {
        const Vector3d ray = points[i] - sensor;
        fit.mean_incidence += std::abs(fit.plane.normal.dot(ray)) / std::max(ray.norm(), 1e-300);
    }
    fit.mean_incidence /= static_cast<double>(which.size());
    return fit;
}

Matrix3d fit_covariance(const std::vector<Vector3d>& points, const std::vector<uint32_t>& which,
                        const PlaneFit& fit)
{
    Matrix3d normal = Matrix3d::Zero(), squares = Matrix3d::Zero();
    for (const uint32_t i : which)
    {
        const Vector3d d = points[i] - fit.plane.centre, x(fit.u.dot(d), fit.v.dot(d), 1);
        const double h = fit.plane.normal.dot(d);
        normal += x * x.transpose();
        squares += h * h * x * x.transpose();
    }
    const Matrix3d inverse = normal.inverse();
    const double count = static_cast<double>(which.size());
    const Matrix3d covariance = inverse * squares * inverse * (count / (count - 3));
    return (covariance + covariance.transpose()) / 2;
}

}  // namespace mp2p_icp_filters
