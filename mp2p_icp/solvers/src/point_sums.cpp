#include "point_sums.h"

#include <mp2p_icp/parallel.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <new>

namespace mp2p_icp
{
namespace
{
using mrpt::tfest::TMatchingPair_d;

constexpr int POINT_SUMS_SIZE = 28;
constexpr size_t GLOBAL_OFFSET = offsetof(TMatchingPair_d, global),
                 LOCAL_OFFSET = offsetof(TMatchingPair_d, local);
static_assert(LOCAL_OFFSET + 4 * sizeof(double) <= sizeof(TMatchingPair_d),
              "four numbers are read from here");

/// A PointOrigin as plain numbers: the kernels call no functions, which might be compiled for another target.
struct KernelOrigin
{
    double a[3], b[3], a_mean[3], b_mean[3], shortest_sq;
};

enum class Vectors : uint8_t
{
    AsTheyAre,
    Unit,
    UnitForAttitude  ///< without the sums of a a' and b b'
};

/// The last pairs of a block, if fewer than four are left: the last four, those already summed with weight 0.
/// Of a block with fewer than four, copies fill up.
struct PointTail
{
    size_t quads = 0;
    const TMatchingPair_d* pairs = nullptr;
    double weights[4] = {0, 0, 0, 0};
    alignas(TMatchingPair_d) unsigned char copies[4 * sizeof(TMatchingPair_d)];  // used, and set, by few

    PointTail(const TMatchingPair_d* block, const double* block_weights, size_t count)
        : quads(count % 4 ? 1 : 0)
    {
        const size_t rest = count % 4;
        if (rest == 0) return;
        const size_t shift = count < 4 ? 0 : 4 - rest;
        for (size_t k = 0; k < rest; k++) weights[shift + k] = block_weights[count - rest + k];
        pairs = block + count - rest - shift;
        if (count >= 4) return;
        auto* filled = reinterpret_cast<TMatchingPair_d*>(copies);
        for (size_t k = 0; k < 4; k++) new (filled + k) TMatchingPair_d(block[std::min(k, count - 1)]);
        pairs = filled;
    }
};

namespace baseline
{
#include "point_sums_kernel.inc"
}
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define MP2P_ICP_X86_KERNELS
namespace avx2
{
#pragma GCC push_options
#pragma GCC target("arch=haswell")
#include "point_sums_kernel.inc"
#pragma GCC pop_options
}  // namespace avx2
namespace avx512
{
#pragma GCC push_options
#pragma GCC target("arch=skylake-avx512")
#include "point_sums_kernel.inc"
#pragma GCC pop_options
}  // namespace avx512
#endif

using Kernel = void (*)(const TMatchingPair_d*, const double*, size_t, const PointTail&, const KernelOrigin&,
                        double*);
struct Kernels
{
    Kernel as_they_are = baseline::add_points<Vectors::AsTheyAre>, unit = baseline::add_points<Vectors::Unit>,
           unit_for_attitude = baseline::add_points<Vectors::UnitForAttitude>;
};

/// The fastest that this processor can run.
Kernels chosen_kernels()
{
#ifdef MP2P_ICP_X86_KERNELS
    __builtin_cpu_init();  // this may run before the constructors of libgcc
    if (__builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq"))
        return {avx512::add_points<Vectors::AsTheyAre>, avx512::add_points<Vectors::Unit>,
                avx512::add_points<Vectors::UnitForAttitude>};
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
        return {avx2::add_points<Vectors::AsTheyAre>, avx2::add_points<Vectors::Unit>,
                avx2::add_points<Vectors::UnitForAttitude>};
#endif
    return {};
}
const Kernels KERNELS = chosen_kernels();

struct RawSums
{
    double values[POINT_SUMS_SIZE] = {};
    RawSums& operator+=(const RawSums& o)
    {
        for (int i = 0; i < POINT_SUMS_SIZE; i++) values[i] += o.values[i];
        return *this;
    }
};

constexpr std::array<double, BLOCK_SIZE> all_ones()
{
    std::array<double, BLOCK_SIZE> ones{};
    for (size_t i = 0; i < BLOCK_SIZE; i++) ones[i] = 1;
    return ones;
}
constexpr std::array<double, BLOCK_SIZE> ONES = all_ones();

PointSums from_raw(const double* s)
{
    PointSums out;
    out.w = s[0];
    out.a << s[1], s[2], s[3];
    out.b << s[4], s[5], s[6];
    out.B << s[7], s[8], s[9], s[10], s[11], s[12], s[13], s[14], s[15];
    out.aa << s[16], s[17], s[18], s[17], s[19], s[20], s[18], s[20], s[21];
    out.bb << s[22], s[23], s[24], s[23], s[25], s[26], s[24], s[26], s[27];
    return out;
}

PointSums sums_by(Kernel kernel, const MatchedPointList& pairs, const ListWeights& weights,
                  const PointOrigin& o)
{
    KernelOrigin origin{};
    for (int i = 0; i < 3; i++)
        origin.a[i] = o.a(i), origin.b[i] = o.b(i), origin.a_mean[i] = o.a_mean(i),
        origin.b_mean[i] = o.b_mean(i);
    origin.shortest_sq = o.shortest_sq;
    const auto raw = block_sum<RawSums>(
        pairs.size(),
        [&](size_t from, size_t to)
        {
            RawSums s;
            const double* w = weights.each.empty() ? ONES.data() : weights.each.data() + from;
            const PointTail tail(pairs.data() + from, w, to - from);
            kernel(pairs.data() + from, w, (to - from) / 4, tail, origin, s.values);
            return s;
        });
    PointSums out = from_raw(raw.values);
    if (weights.common != 1) out *= weights.common;
    return out;
}
}  // namespace

PointSums& PointSums::operator+=(const PointSums& o)
{
    w += o.w, a += o.a, b += o.b, B += o.B, aa += o.aa, bb += o.bb;
    return *this;
}

PointSums& PointSums::operator*=(double factor)
{
    w *= factor, a *= factor, b *= factor, B *= factor, aa *= factor, bb *= factor;
    return *this;
}

void PointSums::add(double weight, const Eigen::Vector3d& a_, const Eigen::Vector3d& b_)
{
    w += weight, a += weight * a_, b += weight * b_;
    B += weight * a_ * b_.transpose(), aa += weight * a_ * a_.transpose(), bb += weight * b_ * b_.transpose();
}

void PointSums::centre(Eigen::Vector3d& a_mean, Eigen::Vector3d& b_mean)
{
    if (!(w > 0)) return;
    a_mean = a * (1 / w), b_mean = b * (1 / w);
    B.noalias() -= a_mean * b.transpose(), aa.noalias() -= a_mean * a.transpose(),
        bb.noalias() -= b_mean * b.transpose();
    a.setZero(), b.setZero();
}

bool PointSums::usable() const
{
    // Squares of squares are formed later on.
    return w + aa.trace() + bb.trace() + B.squaredNorm() < 1e150 && std::isfinite(a.sum() + b.sum());
}

PointSums point_sums(const MatchedPointList& pairs, const ListWeights& weights, const PointOrigin& origin)
{
    return sums_by(KERNELS.as_they_are, pairs, weights, origin);
}

PointSums unit_vector_sums(const MatchedPointList& pairs, const ListWeights& weights,
                           const PointOrigin& origin, bool with_squares)
{
    if (with_squares) return sums_by(KERNELS.unit, pairs, weights, origin);
    PointSums out = sums_by(KERNELS.unit_for_attitude, pairs, weights, origin);
    // Of unit vectors: the traces are known, the rest is not asked for.
    out.aa = out.bb = out.w / 3 * Eigen::Matrix3d::Identity();
    return out;
}

}  // namespace mp2p_icp
