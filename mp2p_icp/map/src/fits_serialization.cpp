#include "fits_serialization.h"

#include <mp2p_icp/errors.h>

#include <algorithm>

namespace mp2p_icp
{
using mrpt::serialization::CArchive;

bool has_fits(const metric_map_t& map)
{
    const auto has = [](const auto& item) { return item.fit.has_value(); };
    return std::any_of(map.lines.begin(), map.lines.end(), has) ||
           std::any_of(map.planes.begin(), map.planes.end(), has);
}

namespace
{
constexpr uint8_t VERSION = 0;

/// Calls `each` for all numbers of a fit, in the order of the file.
template <class Fit, class Each>
void numbers_of_matrix(Fit& fit, const Each& each)
{
    for (Eigen::Index row = 0; row < fit.covariance.rows(); row++)
        for (Eigen::Index column = row; column < fit.covariance.cols(); column++)
            each(fit.covariance(row, column));
}
template <class Fit, class Each>
void numbers_of_plane(Fit& fit, const Each& each)
{
    for (int i = 0; i < 3; i++) each(fit.axis_u(i));
    each(fit.u_min), each(fit.u_max), each(fit.v_min), each(fit.v_max);
    each(fit.inliers), each(fit.sigma);
    numbers_of_matrix(fit, each);
}
template <class Fit, class Each>
void numbers_of_line(Fit& fit, const Each& each)
{
    for (int i = 0; i < 3; i++) each(fit.axis_a(i));
    each(fit.begin), each(fit.end);
    each(fit.inliers), each(fit.sigma);
    numbers_of_matrix(fit, each);
}

/// Of all fits; `item` reads or writes the numbers of one.
template <class Items, class Numbers>
void write_all(CArchive& out, const Items& items, const Numbers& numbers)
{
    for (const auto& item : items)
    {
        out << item.fit.has_value();
        if (item.fit) numbers(*item.fit, [&out](const auto& number) { out << number; });
    }
}
template <class Items, class Numbers>
void read_all(CArchive& in, Items& items, const Numbers& numbers)
{
    for (auto& item : items)
    {
        if (!in.ReadAs<bool>()) continue;
        item.fit.emplace();
        numbers(*item.fit, [&in](auto& number) { in >> number; });
        auto& covariance = item.fit->covariance;
        covariance.template triangularView<Eigen::StrictlyLower>() = covariance.transpose();
        if (!item.fit->is_sound())
            throw DataError("mp2p_icp::metric_map_t", "a line or plane has numbers that no fit gives");
    }
}
}  // namespace

void write_fits(const metric_map_t& map, CArchive& out)
{
    out.WriteAs<uint8_t>(VERSION);
    write_all(out, map.lines, [](const line_fit_t& f, const auto& each) { numbers_of_line(f, each); });
    write_all(out, map.planes, [](const plane_fit_t& f, const auto& each) { numbers_of_plane(f, each); });
}

void read_fits(CArchive& in, metric_map_t& map)
{
    if (const auto version = in.ReadAs<uint8_t>(); version != VERSION)
        throw DataError("mp2p_icp::metric_map_t", "version " + std::to_string(version) +
                                                      " of the fits of lines and planes is not supported");
    read_all(in, map.lines, [](line_fit_t& f, const auto& each) { numbers_of_line(f, each); });
    read_all(in, map.planes, [](plane_fit_t& f, const auto& each) { numbers_of_plane(f, each); });
}

}  // namespace mp2p_icp
