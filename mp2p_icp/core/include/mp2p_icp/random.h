#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace mp2p_icp
{
/** Random numbers from an explicit seed, the same on every machine and standard library (SplitMix64).
 * Satisfies UniformRandomBitGenerator. Not for cryptography. One object per thread.
 */
class SeededRandom
{
 public:
    using result_type = uint64_t;
    explicit SeededRandom(uint64_t seed) : state_(seed) {}

    static constexpr result_type min() { return 0; }
    static constexpr result_type max() { return UINT64_MAX; }
    result_type operator()();

    /// Uniform in [0, 1).
    double uniform();
    /// Uniform in [lo, hi).
    double uniform(double lo, double hi);
    /// Normal with mean 0 and standard deviation sigma.
    double gaussian(double sigma = 1.0);
    /// Uniform integer in [0, count), without modulo bias. count must be at least 1.
    size_t index(size_t count);

 private:
    uint64_t state_;
};

/** A uniformly random subset of `wanted` of the indices 0..count-1, in increasing order; all of them if
 * wanted >= count. Every index has the same chance (Floyd's algorithm). O(wanted log wanted).
 */
std::vector<size_t> random_subset(size_t count, size_t wanted, uint64_t seed);

}  // namespace mp2p_icp
