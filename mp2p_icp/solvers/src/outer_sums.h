#pragma once

#include <cstddef>

namespace mp2p_icp
{
/// How many pairings are collected before their products are summed.
constexpr size_t OUTER_BATCH = 64, OUTER_STRIDE = OUTER_BATCH + 4;

/** Vectors a (A numbers) and b (B numbers) of up to OUTER_BATCH pairings, number by number, to sum a b' over
 * them: four pairings at a time, with the fastest instructions that the processor has.
 */
template <int A, int B>
struct OuterBatch
{
    static_assert(A % 3 == 0, "the kernel takes three rows at a time");
    alignas(32) double a[A][OUTER_STRIDE];
    alignas(32) double b[B][OUTER_STRIDE];
    size_t size = 0;

    bool full() const { return size == OUTER_BATCH; }
};

/// sums[j * rows + i] += sum over k < count of a[i][k] b[j][k]. The rest of a block of four must be zero. In
/// this order on any machine: k = 0, 4, 8, ..., 1, 5, ...
void add_outer_sums(const double* a, int rows, const double* b, int columns, size_t count, double* sums);

/// Sums and empties the batch. `sums`: A x B, column by column.
template <int A, int B>
void flush(OuterBatch<A, B>& batch, double* sums)
{
    if (batch.size == 0) return;
    for (size_t k = batch.size; k % 4 != 0; k++)
    {
        for (auto& row : batch.a) row[k] = 0;
        for (auto& row : batch.b) row[k] = 0;
    }
    add_outer_sums(batch.a[0], A, batch.b[0], B, batch.size, sums);
    batch.size = 0;
}

}  // namespace mp2p_icp
