#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

namespace mp2p_icp
{
/// A box around points, to the bit. Empty at first.
struct ElementBox
{
    float low[3] = {INF, INF, INF}, high[3] = {-INF, -INF, -INF};

    void add(float x, float y, float z)
    {
        const float p[3] = {x, y, z};
        for (int a = 0; a < 3; a++)
        {
            if (p[a] < low[a]) low[a] = p[a];
            if (p[a] > high[a]) high[a] = p[a];
        }
    }
    void add(const ElementBox& b)
    {
        for (int a = 0; a < 3; a++)
        {
            if (b.low[a] < low[a]) low[a] = b.low[a];
            if (b.high[a] > high[a]) high[a] = b.high[a];
        }
    }

 private:
    static constexpr float INF = std::numeric_limits<float>::infinity();
};

/// Eight boxes side by side, empty at first.
class BoxGroup
{
 public:
    static constexpr size_t SIZE = 8;
    BoxGroup()
    {
        for (size_t b = 0; b < SIZE; b++) set(b, ElementBox());
    }
    void set(size_t b, const ElementBox& box)
    {
        for (size_t a = 0; a < 3; a++)
            low_[a][b / 4][b % 4] = box.low[a], high_[a][b / 4][b % 4] = box.high[a];
    }
    /** The squared distances of their nearest places; infinite for empty ones. Summed as that of a point is,
     * and rounding is monotonic: no point inside has a smaller one, not in the last bit either.
     */
    void dist_sq(const float q[3], float out[SIZE]) const
    {
        for (size_t half = 0; half < 2; half++)
        {
            Float4 sum{};
            for (size_t a = 0; a < 3; a++)
            {
                const Float4 below = low_[a][half] - q[a], above = q[a] - high_[a][half];
                const Float4 outside = below > above ? below : above;
                const Float4 d = outside > 0 ? outside : Float4{};
                sum += d * d;
            }
            std::memcpy(out + 4 * half, &sum, sizeof(sum));
        }
    }

 private:
    using Float4 = float __attribute__((vector_size(16)));
    Float4 low_[3][2], high_[3][2];
};

/** Boxes around blocks, around eight boxes that follow each other, and so on up to one. As the blocks follow
 * a Morton curve, boxes of neighbours overlap little.
 */
class BoxTree
{
 public:
    /// \param leaves the boxes of the blocks
    void build(const std::vector<ElementBox>& leaves);
    bool empty() const { return height_ == 0; }
    const ElementBox& root() const { return root_; }

    /** Calls `visit(block)` for the blocks whose box is not farther from q than limit(), which may shrink
     * meanwhile, roughly nearest first. `skip(dist_sq)` is told of all others.
     */
    template <class Limit, class Visit, class Skip>
    void visit_near(const float q[3], const Limit& limit, const Visit& visit, const Skip& skip) const;

 private:
    static constexpr size_t MAX_HEIGHT = 11;  ///< 8^11 blocks

    struct Node
    {
        float dist_sq;
        uint32_t level, box;
    };
    using Stack = std::array<Node, BoxGroup::SIZE * MAX_HEIGHT>;

    /// Puts the boxes of a group upon the stack, the nearest one on top.
    template <class Skip>
    void push_group(uint32_t level, uint32_t group, const float q[3], float limit, const Skip& skip,
                    Stack& stack, size_t& count) const;

    /// Level 0 has the boxes of the blocks. Box n of a level is around group n of the one below.
    std::array<std::vector<BoxGroup>, MAX_HEIGHT> levels_;
    size_t height_ = 0;
    ElementBox root_;
};

template <class Skip>
void BoxTree::push_group(uint32_t level, uint32_t group, const float q[3], float limit, const Skip& skip,
                         Stack& stack, size_t& count) const
{
    float dist_sq[BoxGroup::SIZE];
    levels_[level][group].dist_sq(q, dist_sq);
    const size_t bottom = count;
    for (uint32_t b = 0; b < BoxGroup::SIZE; b++)
    {
        const float d = dist_sq[b];
        if (!(d <= limit))
        {
            skip(d);
            continue;
        }
        size_t place = count++;
        for (; place > bottom && stack[place - 1].dist_sq < d; place--) stack[place] = stack[place - 1];
        stack[place] = {d, level, group * uint32_t(BoxGroup::SIZE) + b};
    }
}

template <class Limit, class Visit, class Skip>
void BoxTree::visit_near(const float q[3], const Limit& limit, const Visit& visit, const Skip& skip) const
{
    if (empty()) return;
    Stack stack;
    size_t count = 0;
    push_group(static_cast<uint32_t>(height_ - 1), 0, q, limit(), skip, stack, count);
    while (count > 0)
    {
        const Node node = stack[--count];
        if (!(node.dist_sq <= limit()))
            skip(node.dist_sq);
        else if (node.level == 0)
            visit(node.box);
        else
            push_group(node.level - 1, node.box, q, limit(), skip, stack, count);
    }
}

}  // namespace mp2p_icp
