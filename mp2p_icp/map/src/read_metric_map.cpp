#include <mp2p_icp/errors.h>

#include <cmath>

#include "archives.h"

namespace mp2p_icp
{
namespace
{
metric_map_t::Ptr parse(std::string_view bytes)
{
    const auto map = std::dynamic_pointer_cast<metric_map_t>(ArchiveReader(bytes).read());
    if (!map) throw std::runtime_error("the archive holds no map");
    return map;
}

/// \return the number of points that were taken out.
uint64_t drop_nonfinite(mrpt::maps::CPointsMap& points)
{
    const auto &x = points.getPointsBufferRef_x(), &y = points.getPointsBufferRef_y(),
               &z = points.getPointsBufferRef_z();
    std::vector<bool> bad(points.size());
    uint64_t count = 0;
    for (size_t i = 0; i < bad.size(); i++)
    {
        bad[i] = !std::isfinite(x[i]) || !std::isfinite(y[i]) || !std::isfinite(z[i]);
        count += bad[i] ? 1 : 0;
    }
    if (count > 0) points.applyDeletionMask(bad);
    return count;
}

LoadedMap parse_and_check(std::string_view bytes)
{
    LoadedMap out;
    out.map = parse(bytes);
    out.report.kind = "metric map (.mm)";
    out.report.points_read = out.map->size_points_only();
    for (const auto& [name, layer] : out.map->layers)
        if (auto* points = MapToPointsMap(*layer))
            out.report.points_dropped_nonfinite += drop_nonfinite(*points);
    if (out.report.points_read > 0 && out.report.points_read == out.report.points_dropped_nonfinite)
        throw std::runtime_error("there is no finite point among its " +
                                 std::to_string(out.report.points_read) + " points");
    (void)out.map->coordinate_offset();  // throws if it is not three numbers
    return out;
}
}  // namespace

LoadedMap read_metric_map(const std::string& source, std::string_view bytes)
{
    rehearse(source, bytes, [&] { return parse_and_check(bytes).report.kind; });
    LoadedMap out;
    perform(source, [&] { out = parse_and_check(bytes); });
    out.report.source = source;
    return out;
}

}  // namespace mp2p_icp
