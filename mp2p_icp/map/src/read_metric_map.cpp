#include <mp2p_icp/archive_file.h>

#include <cmath>

#include "archives.h"

namespace mp2p_icp
{
namespace
{
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

/// What the reading of a map finds: fills the report, all but its source.
void check_map(metric_map_t& map, LoadReport& report)
{
    report = LoadReport();
    report.kind = "metric map (.mm)";
    report.points_read = map.size_points_only();
    for (const auto& [name, layer] : map.layers)
        if (auto* points = MapToPointsMap(*layer)) report.points_dropped_nonfinite += drop_nonfinite(*points);
    if (report.points_read > 0 && report.points_read == report.points_dropped_nonfinite)
        throw std::runtime_error("there is no finite point among its " + std::to_string(report.points_read) +
                                 " points");
    (void)map.coordinate_offset();  // throws if it is not three numbers
}
}  // namespace

LoadedMap read_metric_map(const std::string& source, std::string_view bytes)
{
    LoadedMap out;
    const auto check = [&out](mrpt::serialization::CSerializable& object)
    {
        auto* map = dynamic_cast<metric_map_t*>(&object);
        if (!map) throw std::runtime_error("the archive holds no map");
        check_map(*map, out.report);
    };
    out.map = std::dynamic_pointer_cast<metric_map_t>(read_archive_object(source, bytes, check));
    out.report.source = source;
    return out;
}

}  // namespace mp2p_icp
