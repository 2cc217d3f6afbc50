#include "finite_box.h"

#include <algorithm>
#include <cstring>
#include <limits>

namespace mp2p_icp
{
namespace
{
using Float4 = float __attribute__((vector_size(16)));

/// Boxes around every fourth point, side by side: one for each lane of a register.
class LaneBoxes
{
 public:
    void add_finite(const PointView& p)
    {
        size_t i = 0;
        for (; i + LANES <= p.size; i += LANES) add(load(p.x + i), load(p.y + i), load(p.z + i));
        for (; i < p.size; i++) add(Float4{} + p.x[i], Float4{} + p.y[i], Float4{} + p.z[i]);
    }

    std::optional<mrpt::math::TBoundingBoxf> around_all() const
    {
        mrpt::math::TPoint3Df low, high;
        for (size_t a = 0; a < 3; a++)
        {
            low[a] = low_[a][0], high[a] = high_[a][0];
            for (size_t lane = 1; lane < LANES; lane++)
                low[a] = std::min(low[a], low_[a][lane]), high[a] = std::max(high[a], high_[a][lane]);
        }
        if (!(low.x <= high.x)) return {};
        return mrpt::math::TBoundingBoxf(low, high);
    }

 private:
    static Float4 load(const float* v)
    {
        Float4 four;
        std::memcpy(&four, v, sizeof(four));
        return four;
    }

    void add(const Float4& x, const Float4& y, const Float4& z)
    {
        // NaN, which is neither smaller nor larger, unless all three are finite.
        const Float4 nothing = (x - x) + (y - y) + (z - z);
        const Float4 p[3] = {x + nothing, y + nothing, z + nothing};
        for (size_t a = 0; a < 3; a++)
        {
            low_[a] = p[a] < low_[a] ? p[a] : low_[a];
            high_[a] = p[a] > high_[a] ? p[a] : high_[a];
        }
    }

    static constexpr float INF = std::numeric_limits<float>::infinity();
    static constexpr size_t LANES = 4;
    Float4 low_[3] = {Float4{} + INF, Float4{} + INF, Float4{} + INF},
           high_[3] = {Float4{} - INF, Float4{} - INF, Float4{} - INF};
};
}  // namespace

std::optional<mrpt::math::TBoundingBoxf> box_of_finite_points(const PointView& points)
{
    LaneBoxes boxes;
    boxes.add_finite(points);
    return boxes.around_all();
}

}  // namespace mp2p_icp
