#include "cloud_layer.h"

#include <mp2p_icp/errors.h>
#include <mp2p_icp/numbers.h>
#include <mrpt/maps/CColouredPointsMap.h>
#include <mrpt/maps/CPointsMapXYZI.h>
#include <mrpt/maps/CSimplePointsMap.h>

#include <cmath>
#include <limits>

#include "files.h"

namespace mp2p_icp
{
using mrpt::math::TPoint3D;

/// Float's range counts as finite: what is beyond it could not be stored.
bool is_storable(const TPoint3D& p)
{
    constexpr double largest = std::numeric_limits<float>::max();
    return std::abs(p.x) <= largest && std::abs(p.y) <= largest && std::abs(p.z) <= largest;
}

std::optional<mrpt::math::TBoundingBox> finite_box(const RawCloud& cloud)
{
    std::optional<mrpt::math::TBoundingBox> box;
    for (const auto& p : cloud.points)
    {
        if (!is_storable(p)) continue;
        if (!box) box = mrpt::math::TBoundingBox(p, p);
        box->updateWithPoint(p);
    }
    return box;
}

bool is_near(const mrpt::math::TBoundingBox& box, const TPoint3D& offset)
{
    for (const auto& corner : {box.min - offset, box.max - offset})
        if (std::max({std::abs(corner.x), std::abs(corner.y), std::abs(corner.z)}) > FAR_AWAY) return false;
    return true;
}

TPoint3D choose_offset(const RawCloud& cloud, const LoadOptions& options)
{
    if (const auto& o = options.coordinate_offset; o)
    {
        for (const double v : {o->x, o->y, o->z})
            if (!std::isfinite(v) || v != std::round(v))
                throw std::invalid_argument("coordinate_offset: must be whole numbers, not " + to_text(v));
        return *o;
    }
    if (cloud.written_offset) return *cloud.written_offset;
    const auto box = finite_box(cloud);
    if (!box || is_near(*box, {0, 0, 0})) return {0, 0, 0};
    const TPoint3D centre = (box->min + box->max) * 0.5;
    return {std::round(centre.x), std::round(centre.y), std::round(centre.z)};
}

namespace
{
struct Layer
{
    mrpt::maps::CPointsMap::Ptr points;
    mrpt::maps::CPointsMapXYZI* intensity = nullptr;
    mrpt::maps::CColouredPointsMap* colour = nullptr;
};

Layer make_layer(const RawCloud& cloud)
{
    Layer layer;
    if (!cloud.rgb.empty())
    {
        const auto points = mrpt::maps::CColouredPointsMap::Create();
        layer.points = points, layer.colour = points.get();
    }
    else if (!cloud.intensity.empty())
    {
        const auto points = mrpt::maps::CPointsMapXYZI::Create();
        layer.points = points, layer.intensity = points.get();
    }
    else
        layer.points = mrpt::maps::CSimplePointsMap::Create();
    return layer;
}

void check_memory(const RawCloud& cloud, size_t kept, const std::string& source)
{
    const uint64_t held = cloud.points.size() * sizeof(TPoint3D) + cloud.intensity.size() * sizeof(float) +
                          cloud.rgb.size() * sizeof(cloud.rgb[0]);
    const uint64_t floats = 3 + (!cloud.rgb.empty() ? 3 : !cloud.intensity.empty() ? 1 : 0);
    if (held + kept * floats * sizeof(float) > READ_MEMORY_BUDGET_BYTES)
        throw DataError(source,
                        std::to_string(kept) + " points need more than the 2 GB that reading may use");
}

void fill_layer(const RawCloud& cloud, const TPoint3D& offset, size_t kept, Layer& layer)
{
    layer.points->resize(kept);
    size_t n = 0;
    for (size_t i = 0; i < cloud.points.size(); i++)
    {
        if (!is_storable(cloud.points[i])) continue;
        const TPoint3D p = cloud.points[i] - offset;  // in double; only then rounded to float
        layer.points->setPointFast(n, static_cast<float>(p.x), static_cast<float>(p.y),
                                   static_cast<float>(p.z));
        if (layer.intensity) layer.intensity->setPointColor_fast(n, cloud.intensity[i], 0, 0);
        if (layer.colour)
            layer.colour->setPointColor_fast(n, cloud.rgb[i][0], cloud.rgb[i][1], cloud.rgb[i][2]);
        n++;
    }
    layer.points->mark_as_modified();
}
}  // namespace

LoadedMap to_map(RawCloud&& cloud, const std::string& source, const std::string& layer_name,
                 const TPoint3D& offset)
{
    LoadedMap out;
    out.report.source = source;
    out.report.kind = cloud.kind;
    out.report.notes = std::move(cloud.notes);
    out.report.points_read = cloud.points.size();
    size_t kept = 0;
    for (const auto& p : cloud.points) kept += is_storable(p) ? 1 : 0;
    out.report.points_dropped_nonfinite = cloud.points.size() - kept;
    if (kept == 0)
        throw DataError(
            source, "there is no finite point among its " + std::to_string(cloud.points.size()) + " points");
    check_memory(cloud, kept, source);

    Layer layer = make_layer(cloud);
    fill_layer(cloud, offset, kept, layer);
    if (!cloud.rgb.empty() && !cloud.intensity.empty())
        out.report.notes.push_back("intensity is left out: MRPT has no cloud with colour and intensity");
    out.map = metric_map_t::Create();
    out.map->layers[layer_name] = layer.points;
    out.map->set_coordinate_offset(offset);
    if (offset != TPoint3D(0, 0, 0))
        out.report.notes.push_back("coordinates are stored relative to (" + to_text(offset.x) + ", " +
                                   to_text(offset.y) + ", " + to_text(offset.z) + ")");
    return out;
}

}  // namespace mp2p_icp
