#include "field_columns.h"

#include <mrpt/maps/CPointsMapXYZI.h>

#include <typeinfo>

namespace mp2p_icp_filters
{
FieldColumns::FieldColumns(const mrpt::maps::CPointsMap& points)
{
    if (points.empty()) return;
    std::vector<float> fields;
    points.getPointAllFieldsFast(0, fields);
    if (fields.size() <= 3) return;
    // Not for classes derived from it, which may have more.
    if (typeid(points) == typeid(mrpt::maps::CPointsMapXYZI))
    {
        const auto& with_intensity = static_cast<const mrpt::maps::CPointsMapXYZI&>(points);
        columns_ = {with_intensity.getPointsBufferRef_intensity().data()};
        return;
    }
    copies_.assign(fields.size() - 3, std::vector<float>(points.size()));
    for (size_t i = 0; i < points.size(); i++)
    {
        points.getPointAllFieldsFast(i, fields);
        for (size_t f = 0; f < copies_.size(); f++) copies_[f][i] = fields[3 + f];
    }
    for (const auto& copy : copies_) columns_.push_back(copy.data());
}

}  // namespace mp2p_icp_filters
