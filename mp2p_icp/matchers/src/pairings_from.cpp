#include <mp2p_icp/pairings_from.h>

#include <stdexcept>
#include <string>

namespace mp2p_icp
{
namespace
{
mrpt::math::TPoint3D checked_point(const mrpt::maps::CPointsMap& map, size_t index, size_t pair,
                                   const char* side)
{
    if (index >= map.size())
        throw std::invalid_argument("pairings_from: pair " + std::to_string(pair) + " names " + side +
                                    " point " + std::to_string(index) + ", but there are " +
                                    std::to_string(map.size()));
    return {double(map.getPointsBufferRef_x()[index]), double(map.getPointsBufferRef_y()[index]),
            double(map.getPointsBufferRef_z()[index])};
}
}  // namespace

Pairings pairings_from(const mrpt::maps::CPointsMap& global, const mrpt::maps::CPointsMap& local,
                       const std::vector<std::pair<size_t, size_t>>& indices)
{
    Pairings out;
    out.paired_pt2pt.reserve(indices.size());
    for (size_t i = 0; i < indices.size(); i++)
    {
        const auto [g, l] = indices[i];
        const auto global_point = checked_point(global, g, i, "global");
        const auto local_point = checked_point(local, l, i, "local");
        out.paired_pt2pt.push_back(mrpt::tfest::TMatchingPair_d(
            static_cast<uint32_t>(g), static_cast<uint32_t>(l), global_point, local_point));
    }
    out.potential_pairings = indices.size();
    return out;
}

}  // namespace mp2p_icp
