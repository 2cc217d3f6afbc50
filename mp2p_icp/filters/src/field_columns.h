#pragma once

#include <mrpt/maps/CPointsMap.h>

#include <vector>

namespace mp2p_icp_filters
{
/** What the points of a cloud have beside coordinates (intensity, colour, what a user's own class adds), one
 * array for each field, in the order of CPointsMap::getPointAllFieldsFast(). The cloud must outlive it.
 * Intensities are read in place, all others copied.
 */
class FieldColumns
{
 public:
    explicit FieldColumns(const mrpt::maps::CPointsMap& points);

    size_t count() const { return columns_.size(); }
    /// Of all points.
    const float* operator[](size_t field) const { return columns_[field]; }

 private:
    std::vector<const float*> columns_;
    std::vector<std::vector<float>> copies_;
};

}  // namespace mp2p_icp_filters
