#include "report_clouds.h"

#include <mp2p_icp/point_fields.h>
#include <mp2p_icp/random.h>
#include <mp2p_icp/se3.h>

#include <algorithm>
#include <numeric>

namespace mp2p_icp
{
namespace
{
struct CloudLayer
{
    const layer_name_t* name;
    const mrpt::maps::CPointsMap* cloud;
    std::vector<size_t> finite;
};

std::vector<CloudLayer> cloud_layers(const metric_map_t& map)
{
    std::vector<CloudLayer> out;
    for (const auto& [name, layer] : map.layers)
        if (const auto* cloud = layer ? MapToPointsMap(*layer) : nullptr; cloud)
            out.push_back({&name, cloud, finite_points(*cloud)});
    return out;
}

/// How many points of each layer are drawn.
std::vector<size_t> shares_of(const std::vector<CloudLayer>& layers, size_t max_points)
{
    std::vector<size_t> smallest_first(layers.size()), shares(layers.size());
    std::iota(smallest_first.begin(), smallest_first.end(), size_t(0));
    std::sort(smallest_first.begin(), smallest_first.end(),
              [&](size_t a, size_t b) { return layers[a].finite.size() < layers[b].finite.size(); });
    size_t layers_left = layers.size();
    for (const size_t i : smallest_first)
    {
        shares[i] = std::min(layers[i].finite.size(), max_points / layers_left--);
        max_points -= shares[i];
    }
    return shares;
}

DrawnLayer drawn(const CloudLayer& layer, size_t share)
{
    DrawnLayer out{*layer.name, {}, layer.finite.size()};
    const auto& xs = layer.cloud->getPointsBufferRef_x();
    const auto& ys = layer.cloud->getPointsBufferRef_y();
    const auto& zs = layer.cloud->getPointsBufferRef_z();
    out.points.reserve(share);
    constexpr uint64_t SEED = 1;
    for (const size_t k : random_subset(layer.finite.size(), share, SEED))
    {
        const size_t i = layer.finite[k];
        out.points.emplace_back(xs[i], ys[i], zs[i]);
    }
    return out;
}

double median(std::vector<double> values)
{
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}
}  // namespace

std::vector<DrawnLayer> drawn_layers(const metric_map_t& map, size_t max_points)
{
    const auto layers = cloud_layers(map);
    const auto shares = shares_of(layers, max_points);
    std::vector<DrawnLayer> out;
    for (size_t i = 0; i < layers.size(); i++) out.push_back(drawn(layers[i], shares[i]));
    return out;
}

PointSet places_of(const metric_map_t& map, const std::vector<DrawnLayer>& layers)
{
    PointSet out;
    const auto add = [&out](const mrpt::math::TPoint3D& p)
    {
        if (to_eigen(p).allFinite()) out.push_back(p);
    };
    for (const auto& layer : layers) out.insert(out.end(), layer.points.begin(), layer.points.end());
    for (const auto& plane : map.planes) add(plane.centroid);
    for (const auto& line : map.lines) add(line.pBase);
    return out;
}

mrpt::math::TPoint3D middle_of(const PointSet& points)
{
    mrpt::math::TPoint3D middle(0, 0, 0);
    if (points.empty()) return middle;
    for (size_t axis = 0; axis < 3; axis++)
    {
        std::vector<double> values;
        values.reserve(points.size());
        for (const auto& p : points) values.push_back(p[axis]);
        middle[axis] = median(std::move(values));
    }
    return middle;
}

}  // namespace mp2p_icp
