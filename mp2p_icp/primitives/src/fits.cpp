#include <mp2p_icp/fitted_line.h>
#include <mp2p_icp/plane_patch.h>

#include <algorithm>
#include <cmath>

namespace mp2p_icp
{
namespace
{
double largest_deviation(const Eigen::Matrix2d& covariance)
{
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(covariance);
    return std::sqrt(std::max(0.0, eigen.eigenvalues()(1)));
}

bool is_unit(const Eigen::Vector3d& axis)
{
    constexpr double ROUNDING = 1e-6;
    return axis.allFinite() && std::abs(axis.norm() - 1) <= ROUNDING;
}

/// Not below zero, and finite.
bool is_deviation(double value)
{
    return value >= 0 && std::isfinite(value);
}

template <class Matrix>
bool is_covariance(const Matrix& m)
{
    return m.allFinite() && m.diagonal().minCoeff() >= 0;
}
}  // namespace

double plane_fit_t::angle_deviation() const
{
    return largest_deviation(covariance.topLeftCorner<2, 2>());
}

double plane_fit_t::offset_deviation() const
{
    return std::sqrt(std::max(0.0, covariance(2, 2)));
}

bool plane_fit_t::is_sound() const
{
    return is_unit(axis_u) && u_min <= u_max && v_min <= v_max && std::isfinite(u_max - u_min) &&
           std::isfinite(v_max - v_min) && is_deviation(sigma) && is_covariance(covariance);
}

double line_fit_t::angle_deviation() const
{
    return largest_deviation(covariance.bottomRightCorner<2, 2>());
}

double line_fit_t::offset_deviation() const
{
    return largest_deviation(covariance.topLeftCorner<2, 2>());
}

bool line_fit_t::is_sound() const
{
    return is_unit(axis_a) && begin <= end && std::isfinite(end - begin) && is_deviation(sigma) &&
           is_covariance(covariance);
}

}  // namespace mp2p_icp
