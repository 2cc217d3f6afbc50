#include "plane_regions.h"

#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <cmath>

namespace mp2p_icp_filters
{
namespace
{
/// The flat cells, those with the surest normals first.
std::vector<uint32_t> seeds(const CellLevel& level, const std::vector<bool>& used)
{
    std::vector<std::pair<double, uint32_t>> sorted;
    for (uint32_t c = 0; c < level.cells().size(); c++)
    {
        const PlaneCell& cell = level.cells()[c];
        if (!used[c] && cell.flat)
            sorted.emplace_back(cell.plane.sigma / (cell.plane.spread_1 * std::sqrt(cell.moments.count)), c);
    }
    std::sort(sorted.begin(), sorted.end());
    std::vector<uint32_t> out;
    for (const auto& entry : sorted) out.push_back(entry.second);
    return out;
}

class Grower
{
 public:
    Grower(const CellLevel& level, std::vector<bool> taken, const PlaneParameters& parameters)
        : level_(level),
          taken_(std::move(taken)),
          angle_(mrpt::DEG2RAD(parameters.maximum_angle_deg)),
          maximum_noise_(parameters.maximum_noise)
    {
    }

    bool is_taken(uint32_t cell) const { return taken_[cell]; }

    PlaneRegion grow(uint32_t seed)
    {
        PlaneRegion region;
        take(seed, region);
        size_t fitted_cells = 1;
        for (size_t next = 0; next < region.cells.size(); next++)
        {
            level_.neighbours(region.cells[next], near_);
            for (const uint32_t c : near_)
                if (!taken_[c] && level_.cells()[c].flat && fits(level_.cells()[c], region)) take(c, region);
            if (region.cells.size() < fitted_cells + fitted_cells / 4 + 1) continue;
            region.plane = plane_through(region.moments);
            fitted_cells = region.cells.size();
        }
        region.plane = plane_through(region.moments);
        return region;
    }

 private:
    void take(uint32_t c, PlaneRegion& region)
    {
        taken_[c] = true;
        if (region.cells.empty()) region.plane = level_.cells()[c].plane;
        region.cells.push_back(c);
        region.moments.add(level_.cells()[c].moments);
    }

    bool fits(const PlaneCell& cell, const PlaneRegion& region) const
    {
        // What the cell's own noise adds to the angle between the normals.
        const double angle_noise = cell.plane.sigma / (cell.plane.spread_1 * std::sqrt(cell.moments.count));
        const double allowed_angle = std::min(angle_ + 2 * angle_noise, 2.5 * angle_);
        const double cosine = std::abs(cell.plane.normal.dot(region.plane.normal));
        const double noise = std::max({cell.plane.sigma, region.plane.sigma, 1e-3 * level_.side()});
        const double offset = std::abs(region.plane.normal.dot(cell.plane.centre - region.plane.centre));
        return cosine >= std::cos(allowed_angle) && offset <= 2 * std::min(noise, maximum_noise_);
    }

    const CellLevel& level_;
    std::vector<bool> taken_;
    double angle_, maximum_noise_;
    std::vector<uint32_t> near_;
};
}  // namespace

std::vector<PlaneRegion> grow_regions(const CellLevel& level, const std::vector<bool>& used,
                                      const PlaneParameters& parameters)
{
    std::vector<PlaneRegion> regions;
    Grower grower(level, used, parameters);
    for (const uint32_t seed : seeds(level, used))
        if (!grower.is_taken(seed)) regions.push_back(grower.grow(seed));
    std::stable_sort(regions.begin(), regions.end(),
                     [](const PlaneRegion& a, const PlaneRegion& b)
                     { return a.moments.count > b.moments.count; });
    return regions;
}

}  // namespace mp2p_icp_filters
