#include "finite_box.h"

#include <algorithm>
#include <array>
#include <limits>

namespace mp2p_icp
{
namespace
{
/// Boxes around every fourth point, side by side: one for each lane of a register.
class LaneBoxes
{
 public:
    LaneBoxes() { low_.fill(INF), high_.fill(-INF); }

    void add_finite(const PointView& p)
    {
        size_t i = 0;
        for (; i + LANES <= p.size; i += LANES)
            for (size_t lane = 0; lane < LANES; lane++)
                add(lane, p.x[i + lane], p.y[i + lane], p.z[i + lane]);
        for (; i < p.size; i++) add(0, p.x[i], p.y[i], p.z[i]);
    }

    std::optional<mrpt::math::TBoundingBoxf> around_all() const
    {
        mrpt::math::TPoint3Df low, high;
        for (size_t a = 0; a < 3; a++)
        {
            low[a] = *std::min_element(&low_[a * LANES], &low_[a * LANES] + LANES);
            high[a] = *std::max_element(&high_[a * LANES], &high_[a * LANES] + LANES);
        }
        if (!(low.x <= high.x)) return {};
        return mrpt::math::TBoundingBoxf(low, high);
    }

 private:
    void add(size_t lane, float x, float y, float z)
    {
        // NaN, which is neither smaller nor larger, unless all three are finite.
        const float nothing = (x - x) + (y - y) + (z - z);
        const float p[3] = {x + nothing, y + nothing, z + nothing};
        for (size_t a = 0; a < 3; a++)
        {
            float &low = low_[a * LANES + lane], &high = high_[a * LANES + lane];
            low = p[a] < low ? p[a] : low, high = p[a] > high ? p[a] : high;
        }
    }

    static constexpr float INF = std::numeric_limits<float>::infinity();
    static constexpr size_t LANES = 4;
    std::array<float, 3 * LANES> low_, high_;
};
}  // namespace

std::optional<mrpt::math::TBoundingBoxf> box_of_finite_points(const PointView& points)
{
    LaneBoxes boxes;
    boxes.add_finite(points);
    return boxes.around_all();
}

}  // namespace mp2p_icp
