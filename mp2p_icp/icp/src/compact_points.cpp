#include "compact_points.h"

#include <mrpt/serialization/CArchive.h>

#include "compact_bytes.h"

/** \file compact_points.cpp
 * Pairs of points come in runs: pairs whose global points are all of one layer, and whose local points are.
 * A run is: u8 layer of the global points, u8 of the local points, u8 1 if the squared errors are floats, u64
 * number of pairs, and the pairs as a string. A pair is: the differences of globalIdx and localIdx to those
 * of the pair before, the coordinates of points of no layer (3 doubles), the squared error (float or double).
 */
namespace mp2p_icp
{
using mrpt::serialization::CArchive;
using Pair = mrpt::tfest::TMatchingPair_d;

namespace
{
/// What a run has in common.
struct RunKind
{
    uint8_t global = 0, local = 0, float_error = 0;
    bool operator==(const RunKind& o) const
    {
        return global == o.global && local == o.local && float_error == o.float_error;
    }
};

bool is_float(double value)
{
    const double rounded = static_cast<double>(static_cast<float>(value));
    return std::memcmp(&rounded, &value, sizeof(double)) == 0;
}

void append_pair(std::string& bytes, const RunKind& kind, const Pair& before, const Pair& pair)
{
    append_difference(bytes, before.globalIdx, pair.globalIdx);
    append_difference(bytes, before.localIdx, pair.localIdx);
    if (kind.global == 0) append_point(bytes, pair.global);
    if (kind.local == 0) append_point(bytes, pair.local);
    const double error = pair.errorSquareAfterTransformation;
    if (kind.float_error)
        append(bytes, static_cast<float>(error));
    else
        append(bytes, error);
}

void write_run(CArchive& out, const RunKind& kind, uint64_t count, const std::string& bytes)
{
    out.WriteAs<uint8_t>(kind.global), out.WriteAs<uint8_t>(kind.local);
    out.WriteAs<uint8_t>(kind.float_error);
    out.WriteAs<uint64_t>(count);
    out << bytes;
}

Pair take_pair(std::string_view& bytes, const RunKind& kind, const Pair& before, const CompactLayers& global,
               const CompactLayers& local)
{
    Pair pair;
    pair.globalIdx = take_difference(bytes, before.globalIdx);
    pair.localIdx = take_difference(bytes, before.localIdx);
    pair.global = global.take_point(bytes, kind.global, pair.globalIdx);
    pair.local = local.take_point(bytes, kind.local, pair.localIdx);
    pair.errorSquareAfterTransformation =
        kind.float_error ? static_cast<double>(take<float>(bytes)) : take<double>(bytes);
    return pair;
}
}  // namespace

void write_compact_points(CArchive& out, const MatchedPointList& pairs, const CompactLayers& global,
                          const CompactLayers& local)
{
    out.WriteAs<uint64_t>(pairs.size());
    RunKind kind;
    Pair before;
    before.globalIdx = before.localIdx = 0;
    std::string bytes;
    uint64_t count = 0;
    for (const Pair& pair : pairs)
    {
        const RunKind its = {global.layer_of(kind.global, pair.globalIdx, pair.global),
                             local.layer_of(kind.local, pair.localIdx, pair.local),
                             is_float(pair.errorSquareAfterTransformation) ? uint8_t(1) : uint8_t(0)};
        if (count > 0 && !(its == kind)) write_run(out, kind, count, bytes), bytes.clear(), count = 0;
        kind = its;
        append_pair(bytes, kind, before, pair);
        before = pair, count++;
    }
    if (count > 0) write_run(out, kind, count, bytes);
}

void read_compact_points(CArchive& in, MatchedPointList& pairs, const CompactLayers& global,
                         const CompactLayers& local)
{
    const auto total = in.ReadAs<uint64_t>();
    Pair before;
    before.globalIdx = before.localIdx = 0;
    while (pairs.size() < total)
    {
        RunKind kind;
        kind.global = in.ReadAs<uint8_t>(), kind.local = in.ReadAs<uint8_t>();
        kind.float_error = in.ReadAs<uint8_t>();
        const auto count = in.ReadAs<uint64_t>();
        const auto bytes = in.ReadAs<std::string>();
        if (count == 0 || count > total - pairs.size())
            pairings_are_damaged("a run is longer than the list, or empty");
        std::string_view left = bytes;
        for (uint64_t i = 0; i < count; i++)
            pairs.push_back(before = take_pair(left, kind, before, global, local));
        if (!left.empty()) pairings_are_damaged("a run holds more than its pairs");
    }
}

}  // namespace mp2p_icp
