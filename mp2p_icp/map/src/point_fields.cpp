#include <mp2p_icp/point_fields.h>
#include <mp2p_icp/yaml_tools.h>
#include <mrpt/maps/CColouredPointsMap.h>
#include <mrpt/maps/CPointsMapXYZI.h>

#include <cmath>

namespace mp2p_icp
{
using mrpt::maps::CPointsMap;

CPointsMap::Ptr new_cloud(const std::string& class_name)
{
    const auto* id = mrpt::rtti::findRegisteredClass(class_name);
    if (id && id->ptrCreateObject)
        if (const auto cloud = std::dynamic_pointer_cast<CPointsMap>(id->createObject())) return cloud;
    std::vector<std::string> known;
    for (const auto* child : mrpt::rtti::getAllRegisteredClassesChildrenOf(CLASS_ID(CPointsMap)))
        known.emplace_back(child->className);
    const std::string nearest = nearest_name(class_name, known);
    throw std::invalid_argument("'" + class_name + "' is not the name of a point cloud class" +
                                (nearest.empty() ? "" : "; did you mean '" + nearest + "'?"));
}

CPointsMap::Ptr new_cloud_like(const CPointsMap& other)
{
    const auto cloud = std::dynamic_pointer_cast<CPointsMap>(other.GetRuntimeClass()->createObject());
    cloud->insertionOptions = other.insertionOptions;
    cloud->likelihoodOptions = other.likelihoodOptions;
    cloud->renderOptions = other.renderOptions;
    return cloud;
}

namespace
{
void copy_all_fields(CPointsMap& to, size_t first, const CPointsMap& from, const std::vector<size_t>& indices)
{
    std::vector<float> fields;
    for (size_t k = 0; k < indices.size(); k++)
    {
        from.getPointAllFieldsFast(indices[k], fields);
        to.setPointAllFieldsFast(first + k, fields);
    }
}

void copy_coordinates(CPointsMap& to, size_t first, const CPointsMap& from,
                      const std::vector<size_t>& indices)
{
    float x = 0, y = 0, z = 0;
    for (size_t k = 0; k < indices.size(); k++)
    {
        from.getPointFast(indices[k], x, y, z);
        to.setPointFast(first + k, x, y, z);
    }
}

void colours_to_intensity(mrpt::maps::CPointsMapXYZI& to, size_t first,
                          const mrpt::maps::CColouredPointsMap& from, const std::vector<size_t>& indices)
{
    float r = 0, g = 0, b = 0;
    for (size_t k = 0; k < indices.size(); k++)
    {
        from.getPointColor_fast(indices[k], r, g, b);
        to.setPointIntensity(first + k, 0.299f * r + 0.587f * g + 0.114f * b);
    }
}
}  // namespace

void append_points(CPointsMap& to, const CPointsMap& from, const std::vector<size_t>& indices)
{
    const size_t first = to.size();
    to.resize(first + indices.size());
    if (to.GetRuntimeClass() == from.GetRuntimeClass())
        copy_all_fields(to, first, from, indices);
    else
    {
        copy_coordinates(to, first, from, indices);
        auto* with_intensity = dynamic_cast<mrpt::maps::CPointsMapXYZI*>(&to);
        const auto* with_colour = dynamic_cast<const mrpt::maps::CColouredPointsMap*>(&from);
        if (with_intensity && with_colour)
            colours_to_intensity(*with_intensity, first, *with_colour, indices);
    }
    to.mark_as_modified();
}

void move_points(CPointsMap& points, size_t first, const mrpt::poses::CPose3D& pose)
{
    float x = 0, y = 0, z = 0;
    for (size_t i = first; i < points.size(); i++)
    {
        points.getPointFast(i, x, y, z);
        const auto moved = pose.composePoint(mrpt::math::TPoint3D(x, y, z));
        points.setPointFast(i, static_cast<float>(moved.x), static_cast<float>(moved.y),
                            static_cast<float>(moved.z));
    }
    points.mark_as_modified();
}

bool is_finite_point(const CPointsMap& points, size_t index)
{
    float x = 0, y = 0, z = 0;
    points.getPointFast(index, x, y, z);
    return std::isfinite(x) && std::isfinite(y) && std::isfinite(z);
}

std::vector<size_t> finite_points(const CPointsMap& points)
{
    std::vector<size_t> indices;
    indices.reserve(points.size());
    for (size_t i = 0; i < points.size(); i++)
        if (is_finite_point(points, i)) indices.push_back(i);
    return indices;
}

}  // namespace mp2p_icp
