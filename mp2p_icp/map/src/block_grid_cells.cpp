#include "block_grid_cells.h"

#include <mp2p_icp/numbers.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace mp2p_icp
{
namespace
{
/// Far below 2^53, where the whole numbers end that are doubles.
constexpr double LARGEST_CORNER = 0x1.0p50;

bool is_finite_point(const PointView& points, size_t i)
{
    return std::isfinite(points.x[i]) && std::isfinite(points.y[i]) && std::isfinite(points.z[i]);
}

/** On each axis the median of up to 31 finite points, so that a few points far away, such as marks of a
 * sensor for "nothing", do not move it. Empty without finite points.
 */
std::optional<std::array<float, 3>> middle_of(const PointView& points)
{
    constexpr size_t SAMPLES = 31;
    std::array<std::vector<float>, 3> samples;
    const auto take = [&](size_t i) {
        samples[0].push_back(points.x[i]), samples[1].push_back(points.y[i]),
            samples[2].push_back(points.z[i]);
    };
    for (size_t i = 0; i < points.size; i += points.size / SAMPLES + 1)
        if (is_finite_point(points, i)) take(i);
    for (size_t i = 0; i < points.size && samples[0].empty(); i++)
        if (is_finite_point(points, i)) take(i);
    if (samples[0].empty()) return {};
    std::array<float, 3> middle;
    for (size_t a = 0; a < 3; a++)
    {
        const auto median = samples[a].begin() + static_cast<std::ptrdiff_t>(samples[a].size() / 2);
        std::nth_element(samples[a].begin(), median, samples[a].end());
        middle[a] = *median;
    }
    return middle;
}

void refuse(const PointView& points, size_t i, double side)
{
    throw std::invalid_argument("BlockGrid: point " + std::to_string(i) + ", at (" + to_text(points.x[i]) +
                                ", " + to_text(points.y[i]) + ", " + to_text(points.z[i]) +
                                "), is too far from the others (or from zero) for voxels of " +
                                to_text(side) + " m");
}
}  // namespace

CellFrame::CellFrame(double side_, const PointView& points) : side(side_), inverse_side(1 / side_)
{
    if (!(side > 0 && std::isfinite(side) && std::isfinite(inverse_side) && inverse_side > 0))
        throw std::invalid_argument("BlockGrid: voxel_size must be positive and finite, not " +
                                    to_text(side));
    const auto middle = middle_of(points);
    if (!middle) return;
    double largest = 0;
    for (size_t a = 0; a < 3; a++)
    {
        const double cell =
            std::clamp(std::floor(double((*middle)[a]) / side), -LARGEST_CORNER, LARGEST_CORNER);
        corner[a] = std::floor(cell / 4) * 4 - CELL_COUNT / 2;
        largest = std::max(largest, std::abs(corner[a]) + CELL_COUNT);
    }
    tolerance = 4 * std::numeric_limits<double>::epsilon() * largest;
    int exponent = 0;
    is_power_of_two = std::frexp(side, &exponent) == 0.5 && std::abs(exponent) < 100;
}

namespace
{
/// Vectors of float and of double, and between which coordinates their rounding can be trusted.
template <class Number>
struct Vectors;
template <>
struct Vectors<float>
{
    static constexpr size_t SIZE = 4;
    static constexpr float NO_FRACTIONS = 0x1.8p23f, LARGEST_QUOTIENT = 0x1.0p21f;
    static constexpr double LEAST_INVERSE = 1;  ///< a quotient that becomes zero loses its sign
    using Numbers = float __attribute__((vector_size(16)));
    using Coordinates = Numbers;
    using Cells = int32_t __attribute__((vector_size(16)));
};
template <>
struct Vectors<double>
{
    static constexpr size_t SIZE = 2;
    static constexpr double NO_FRACTIONS = 0x1.8p52, LARGEST_QUOTIENT = 0x1.0p29;
    static constexpr double LEAST_INVERSE = 0;
    using Numbers = double __attribute__((vector_size(16)));
    using Coordinates = float __attribute__((vector_size(8)));
    using Cells = int32_t __attribute__((vector_size(8)));
};

/** The fast way for one axis: multiplies instead of dividing, and rounds down by adding and subtracting a
 * number that leaves no room for fractions. \return whether all of the cells are surely those that division
 * would give, and numbered ones
 */
template <class Number>
bool find_cells_fast(const CellFrame& frame, const float* coordinates, int axis, size_t count, int32_t* cells)
{
    using V = Vectors<Number>;
    using Numbers = typename V::Numbers;
    if (!(std::abs(frame.corner[axis] + CELL_COUNT / 2) < 0x1.0p29) || count % V::SIZE != 0 ||
        frame.inverse_side < V::LEAST_INVERSE || frame.inverse_side > 0x1.0p100)
        return false;
    const auto corner = static_cast<int32_t>(frame.corner[axis]);
    const auto inverse = static_cast<Number>(frame.inverse_side);
    // How much the product may be off the quotient, as a part of it.
    const Number doubt = frame.is_power_of_two ? 0 : 4 * std::numeric_limits<Number>::epsilon();
    const Numbers one = Numbers{} + 1;
    Numbers sure{};  // counts
    for (size_t k = 0; k < count; k += V::SIZE)
    {
        typename V::Coordinates coordinate;
        std::memcpy(&coordinate, coordinates + k, sizeof(coordinate));
        const Numbers quotient = __builtin_convertvector(coordinate, Numbers) * inverse;
        const Numbers nearest = (quotient + V::NO_FRACTIONS) - V::NO_FRACTIONS;
        const Numbers excess = nearest - quotient, margin = doubt * nearest;
        // All comparisons with NaN are false.
        sure += (excess * excess >= margin * margin) &
                        (quotient * quotient < V::LARGEST_QUOTIENT * V::LARGEST_QUOTIENT)
                    ? one
                    : Numbers{};
        const Numbers rounded_down = nearest - (excess > 0 ? one : Numbers{});
        const typename V::Cells cell = __builtin_convertvector(rounded_down, typename V::Cells) - corner;
        std::memcpy(cells + k, &cell, sizeof(cell));
    }
    Number total = 0;
    for (size_t lane = 0; lane < V::SIZE; lane++) total += sure[lane];
    return total == static_cast<Number>(count);
}

/// The cell that division and std::floor() say. \return whether it is a numbered one; if not, the outermost
/// is taken
bool find_cell_exactly(const CellFrame& frame, float coordinate, int axis, int32_t& cell)
{
    const double number = std::floor(double(coordinate) / frame.side) - frame.corner[axis];
    const double limited = std::clamp(number, 0.0, CELL_COUNT - 1);
    cell = static_cast<int32_t>(limited);
    return limited == number;
}
}  // namespace

void find_cells(const CellFrame& frame, const PointView& points, size_t first, size_t count,
                FarPoints far_points, ChunkCells& out)
{
    const float* const coordinates[3] = {points.x + first, points.y + first, points.z + first};
    bool sure = true;
    for (int a = 0; a < 3 && sure; a++)
        sure = find_cells_fast<float>(frame, coordinates[a], a, count, out.cell[a]) ||
               find_cells_fast<double>(frame, coordinates[a], a, count, out.cell[a]);
    if (sure) return;
    for (size_t k = 0; k < count; k++)
    {
        if (!is_finite_point(points, first + k))
        {
            out.cell[0][k] = NO_CELL;
            continue;
        }
        for (int a = 0; a < 3; a++)
            if (!find_cell_exactly(frame, coordinates[a][k], a, out.cell[a][k]) &&
                far_points == FarPoints::Refuse)
                refuse(points, first + k, frame.side);
    }
}

}  // namespace mp2p_icp
