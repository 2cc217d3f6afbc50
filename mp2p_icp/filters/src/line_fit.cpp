#include "line_fit.h"

#include <mp2p_icp/se3.h>

#include <algorithm>
#include <cmath>

#include "plane_footprint.h"

namespace mp2p_icp_filters
{
using Eigen::Matrix2d;
using Eigen::Matrix4d;
using Eigen::Vector2d;
using Eigen::Vector3d;

MomentLine line_through(const PointMoments& moments)
{
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(moments.scatter);
    const auto deviation = [&](int i)
    { return std::sqrt(std::max(0.0, eigen.eigenvalues()(i)) / std::max(1.0, moments.count)); };
    Vector3d direction = eigen.eigenvectors().col(2).normalized();
    int largest = 0;
    direction.cwiseAbs().maxCoeff(&largest);
    if (direction(largest) < 0) direction = -direction;
    return {moments.mean, direction, deviation(2), deviation(1)};
}

double distance_from(const MomentLine& line, const Vector3d& point)
{
    return line.direction.cross(point - line.centre).norm();
}

namespace
{
/// Across the line and across the view of it.
Vector3d axis_across_view(const MomentLine& line, const Vector3d& sensor)
{
    const Vector3d across = line.direction.cross(line.centre - sensor);
    const double length = across.norm();
    constexpr double ALONG = 1e-6;  // of the distance: the sensor stands on the line
    if (!(length > ALONG * (line.centre - sensor).norm())) return axes_across(line.direction).first;
    return across / length;
}

/// The blocks (i, j) of a sum of (1, s; s, s^2) kron r r'.
void add_to_blocks(double s, const Vector2d& r, Matrix4d& sum)
{
    const Matrix2d square = r * r.transpose();
    sum.topLeftCorner<2, 2>() += square;
    sum.topRightCorner<2, 2>() += s * square;
    sum.bottomLeftCorner<2, 2>() += s * square;
    sum.bottomRightCorner<2, 2>() += s * s * square;
}
}  // namespace

LineFit fit_line(const std::vector<Vector3d>& points, const std::vector<uint32_t>& which,
                 const MomentLine& line, const Vector3d& sensor)
{
    LineFit out;
    out.line.pBase = mp2p_icp::to_mrpt(line.centre);
    out.line.director = mp2p_icp::to_mrpt(line.direction);
    mp2p_icp::line_fit_t& fit = out.line.fit.emplace();
    fit.axis_a = axis_across_view(line, sensor);
    const Vector3d axis_b = line.direction.cross(fit.axis_a);
    const double count = static_cast<double>(which.size());
    double sum_a = 0, sum_b = 0, sum_s2 = 0;
    Matrix4d squares = Matrix4d::Zero();
    for (const uint32_t i : which)
    {
        const Vector3d d = points[i] - line.centre;
        const double s = line.direction.dot(d);
        const Vector2d r(fit.axis_a.dot(d), axis_b.dot(d));
        fit.begin = std::min(fit.begin, s), fit.end = std::max(fit.end, s);
        sum_a += r.x() * r.x(), sum_b += r.y() * r.y(), sum_s2 += s * s;
        add_to_blocks(s, r, squares);
    }
    fit.inliers = which.size();
    fit.sigma = std::sqrt((sum_a + sum_b) / count);
    out.thickness = std::sqrt(sum_a / count);
    // The normal equations are diag(count, sum of s^2) kron I, as s is counted from the centroid.
    const Eigen::Vector4d inverse(1 / count, 1 / count, 1 / sum_s2, 1 / sum_s2);
    fit.covariance = inverse.asDiagonal() * squares * inverse.asDiagonal();
    fit.covariance =
        (0.5 * (fit.covariance + fit.covariance.transpose())).eval();  // to the bit, as files hold one half
    fit.covariance *= count / std::max(1.0, count - 2);
    fit.covariance(0, 0) += out.thickness * out.thickness;
    fit.covariance(1, 1) += out.thickness * out.thickness;
    return out;
}

}  // namespace mp2p_icp_filters
