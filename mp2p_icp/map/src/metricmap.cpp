#include <mp2p_icp/errors.h>
#include <mp2p_icp/load_map.h>
#include <mp2p_icp/metricmap.h>
#include <mp2p_icp/point_fields.h>
#include <mp2p_icp/se3.h>
#include <mp2p_icp/yaml_tools.h>
#include <mrpt/core/initializer.h>
#include <mrpt/rtti/CObject.h>

#include "LayerIndexCache.h"
#include "finite_box.h"

IMPLEMENTS_MRPT_OBJECT(metric_map_t, mrpt::serialization::CSerializable, mp2p_icp)

MRPT_INITIALIZER(register_mp2p_icp_map)
{
    mrpt::rtti::registerClass(CLASS_ID(mp2p_icp::metric_map_t));
}

namespace mp2p_icp
{
using mrpt::maps::CMetricMap;
using mrpt::maps::CPointsMap;

metric_map_t::metric_map_t() : indexes_(std::make_shared<LayerIndexCache>()) {}
metric_map_t::~metric_map_t() = default;
metric_map_t::metric_map_t(const metric_map_t& o)
    : mrpt::serialization::CSerializable(o),
      std::enable_shared_from_this<metric_map_t>(),
      layers(o.layers),
      lines(o.lines),
      planes(o.planes),
      id(o.id),
      label(o.label),
      metadata(o.metadata),
      indexes_(std::make_shared<LayerIndexCache>())
{
}
metric_map_t& metric_map_t::operator=(const metric_map_t& o)
{
    layers = o.layers, lines = o.lines, planes = o.planes;
    id = o.id, label = o.label, metadata = o.metadata;
    indexes_ = std::make_shared<LayerIndexCache>();
    return *this;
}

const CPointsMap* MapToPointsMap(const CMetricMap& map)
{
    return dynamic_cast<const CPointsMap*>(&map);
}
CPointsMap* MapToPointsMap(CMetricMap& map)
{
    return dynamic_cast<CPointsMap*>(&map);
}

bool metric_map_t::empty() const
{
    return layers.empty() && lines.empty() && planes.empty();
}
size_t metric_map_t::size() const
{
    return size_points_only() + lines.size() + planes.size();
}

size_t metric_map_t::size_points_only() const
{
    size_t n = 0;
    for (const auto& [name, layer] : layers)
        if (const auto* points = MapToPointsMap(*layer)) n += points->size();
    return n;
}

void metric_map_t::clear()
{
    *this = metric_map_t();
}

std::string metric_map_t::contents_summary() const
{
    std::string out;
    const auto add = [&out](const std::string& part) { out += (out.empty() ? "" : ", ") + part; };
    if (label) add("'" + *label + "'");
    if (id) add("id " + std::to_string(*id));
    if (!planes.empty()) add(std::to_string(planes.size()) + " planes");
    if (!lines.empty()) add(std::to_string(lines.size()) + " lines");
    for (const auto& [name, layer] : layers)
    {
        const auto* points = MapToPointsMap(*layer);
        add((points ? std::to_string(points->size()) + " points"
                    : std::string(layer->GetRuntimeClass()->className)) +
            " in \"" + name + "\"");
    }
    return out.empty() ? "empty" : out;
}

CPointsMap::Ptr metric_map_t::point_layer(const layer_name_t& name) const
{
    const auto it = layers.find(name);
    if (it == layers.end())
    {
        std::string known;
        for (const auto& [n, layer] : layers) known += (known.empty() ? "'" : ", '") + n + "'";
        throw std::invalid_argument("there is no layer '" + name +
                                    "' (layers: " + (known.empty() ? "none" : known) + ")");
    }
    const auto points = std::dynamic_pointer_cast<CPointsMap>(it->second);
    if (!points)
        throw std::invalid_argument("layer '" + name + "' is not a point cloud but a " +
                                    it->second->GetRuntimeClass()->className);
    return points;
}

// Not CPointsMap::boundingBox(): that one writes a cache, so that two threads could not ask at once.
std::optional<mrpt::math::TBoundingBox> metric_map_t::bounding_box() const
{
    auto all = mrpt::math::TBoundingBox::PlusMinusInfinity();
    for (const auto& [name, layer] : layers)
    {
        const auto* points = MapToPointsMap(*layer);
        if (const auto box = points ? box_of_finite_points(*points) : std::nullopt)
            all.updateWithPoint(mrpt::math::TPoint3D(box->min)),
                all.updateWithPoint(mrpt::math::TPoint3D(box->max));
    }
    if (!(all.min.x <= all.max.x)) return {};
    return all;
}

namespace
{
/// A copy of a layer, moved by a pose.
CMetricMap::Ptr moved_copy(const CMetricMap& layer, const std::optional<mrpt::math::TPose3D>& pose,
                           const std::string& name)
{
    auto copy = std::dynamic_pointer_cast<CMetricMap>(layer.duplicateGetSmartPtr());
    if (!pose || *pose == mrpt::math::TPose3D()) return copy;
    auto* points = MapToPointsMap(*copy);
    if (!points)
        throw std::invalid_argument("merge_with: layer '" + name +
                                    "' is not a point cloud, so it cannot be moved by a pose");
    points->changeCoordinatesReference(mrpt::poses::CPose3D(*pose));
    return copy;
}

/// From the stored coordinates of `other` to those of `mine`, where both were stored with different offsets.
std::optional<mrpt::math::TPose3D> shift_between(const metric_map_t& mine, const metric_map_t& other)
{
    if (mine.empty()) return {};  // then it takes over the other's offset
    const auto shift = other.coordinate_offset() - mine.coordinate_offset();
    if (shift == mrpt::math::TPoint3D(0, 0, 0)) return {};
    return mrpt::math::TPose3D(shift.x, shift.y, shift.z, 0, 0, 0);
}
}  // namespace

void metric_map_t::merge_with(const metric_map_t& other,
                              const std::optional<mrpt::math::TPose3D>& otherRelativePose)
{
    const auto relative_pose = otherRelativePose ? otherRelativePose : shift_between(*this, other);
    const mrpt::poses::CPose3D pose(relative_pose.value_or(mrpt::math::TPose3D()));
    std::map<layer_name_t, CMetricMap::Ptr> merged = layers;  // nothing changes if something throws
    for (const auto& [name, layer] : other.layers)
    {
        const auto moved = moved_copy(*layer, relative_pose, name);
        auto& mine = merged[name];
        if (!mine)
        {
            mine = moved;
            continue;
        }
        auto* my_points = MapToPointsMap(*mine);
        const auto* new_points = MapToPointsMap(*moved);
        if (!my_points || !new_points)
            throw std::invalid_argument("merge_with: layer '" + name +
                                        "' is in both maps and is not a point cloud");
        auto joined = std::dynamic_pointer_cast<CPointsMap>(my_points->duplicateGetSmartPtr());
        joined->insertAnotherMap(new_points, mrpt::poses::CPose3D());
        mine = joined;
    }
    if (empty() && !otherRelativePose) set_coordinate_offset(other.coordinate_offset());
    layers = std::move(merged);
    const size_t n_planes = other.planes.size(), n_lines = other.lines.size();  // `other` may be this map
    for (size_t i = 0; i < n_planes; i++) planes.push_back(compose(pose, other.planes[i]));
    for (size_t i = 0; i < n_lines; i++) lines.push_back(compose(pose, other.lines[i]));
}

// ---- Coordinate offset ------------------------------------------------------------------------------------

mrpt::math::TPoint3D metric_map_t::coordinate_offset() const
{
    if (!metadata.isMap() || !metadata.has("coordinate_offset")) return {0, 0, 0};
    const auto list = metadata["coordinate_offset"];
    if (!list.isSequence() || list.size() != 3)
        throw std::invalid_argument("metadata: 'coordinate_offset' must be a list of 3 numbers");
    return {list(0).as<double>(), list(1).as<double>(), list(2).as<double>()};
}

void metric_map_t::set_coordinate_offset(const mrpt::math::TPoint3D& offset)
{
    if (!metadata.isMap()) metadata = yaml(yaml::Map());
    if (offset == mrpt::math::TPoint3D(0, 0, 0))
    {
        metadata.asMap().erase("coordinate_offset");
        return;
    }
    yaml::node_t list = yaml::Sequence();
    for (const double v : {offset.x, offset.y, offset.z}) list.asSequence().push_back(yaml::node_t(v));
    metadata.asMap()["coordinate_offset"] = list;
}

// ---- Sharing ----------------------------------------------------------------------------------------------

metric_map_t::Ptr metric_map_t::get_shared_from_this()
{
    return shared_from_this();
}
metric_map_t::ConstPtr metric_map_t::get_shared_from_this() const
{
    return shared_from_this();
}
metric_map_t::ConstPtr metric_map_t::get_shared_from_this_or_clone() const
{
    if (const auto shared = weak_from_this().lock()) return shared;
    return std::make_shared<metric_map_t>(*this);
}

bool metric_map_t::save_to_file(const std::string& file_name) const
{
    try
    {
        save_map(*this, file_name);
        return true;
    }
    catch (const DataError&)
    {
        return false;
    }
}

bool metric_map_t::load_from_file(const std::string& file_name)
{
    try
    {
        *this = *load_map(file_name).map;
        return true;
    }
    catch (const DataError&)
    {
        return false;
    }
}

}  // namespace mp2p_icp
