#include "compact_pairings.h"

#include <mp2p_icp/point_fields.h>

#include <cstring>
#include <stdexcept>
#include <string_view>

/** \file compact_pairings.cpp
 * Pairs of points come in runs: pairs whose global points are all of one layer, and whose local points are.
 * A run is: u8 layer of the global points, u8 of the local points (the how-manieth cloud layer of the map by
 * name, counted from 1; 0: of none), u8 1 if the squared errors are floats, u64 number of pairs, and the
 * pairs as a string. A pair is: the differences of globalIdx and localIdx to those of the pair before
 * (zigzag, 7 bits a byte, the lowest first), the coordinates of points of no layer (3 doubles), the squared
 * error (float or double). Then all other kinds, as Pairings::serializeTo() writes them.
 */
namespace mp2p_icp
{
using mrpt::math::TPoint3D;
using mrpt::serialization::CArchive;
using Pair = mrpt::tfest::TMatchingPair_d;

namespace
{
using Layers = std::vector<const mrpt::maps::CPointsMap*>;

Layers cloud_layers(const metric_map_t& map)
{
    constexpr size_t most = 255;
    Layers out;
    for (const auto& [name, layer] : map.layers)
        if (const auto* points = layer ? MapToPointsMap(*layer) : nullptr; points && out.size() < most)
            out.push_back(points);
    return out;
}

template <class T>
bool same_bits(const T& a, const T& b)
{
    return std::memcmp(&a, &b, sizeof(T)) == 0;
}

TPoint3D point_of(const mrpt::maps::CPointsMap& layer, uint32_t index)
{
    return {layer.getPointsBufferRef_x()[index], layer.getPointsBufferRef_y()[index],
            layer.getPointsBufferRef_z()[index]};
}

/// What a run has in common.
struct RunKind
{
    uint8_t global = 0, local = 0, float_error = 0;
    bool operator==(const RunKind& o) const
    {
        return global == o.global && local == o.local && float_error == o.float_error;
    }
};

bool is_of(const Layers& layers, uint8_t layer, uint32_t index, const TPoint3D& point)
{
    if (layer == 0) return false;
    const auto& points = *layers[layer - 1u];
    if (index >= points.size()) return false;
    const TPoint3D stored = point_of(points, index);
    return same_bits(stored.x, point.x) && same_bits(stored.y, point.y) && same_bits(stored.z, point.z);
}

/// The layer that a point is of, the one of the pair before if it can be.
uint8_t layer_of(const Layers& layers, uint8_t before, uint32_t index, const TPoint3D& point)
{
    if (is_of(layers, before, index, point)) return before;
    for (size_t i = 1; i <= layers.size(); i++)
        if (is_of(layers, static_cast<uint8_t>(i), index, point)) return static_cast<uint8_t>(i);
    return 0;
}

bool is_float(double value)
{
    const double rounded = static_cast<double>(static_cast<float>(value));
    return same_bits(rounded, value);
}

// ---- Writing ----------------------------------------------------------------------------------------------

template <class T>
void append(std::string& bytes, const T& value)
{
    bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

void append_difference(std::string& bytes, uint32_t from, uint32_t to)
{
    const auto signed_difference = static_cast<int64_t>(to) - static_cast<int64_t>(from);
    auto left = (static_cast<uint64_t>(signed_difference) << 1) ^
                static_cast<uint64_t>(signed_difference >> 63);  // zigzag: small for both signs
    for (; left >= 0x80; left >>= 7) bytes += static_cast<char>(0x80 | (left & 0x7f));
    bytes += static_cast<char>(left);
}

void append_point(std::string& bytes, const TPoint3D& p)
{
    append(bytes, p.x), append(bytes, p.y), append(bytes, p.z);
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

void write_points(CArchive& out, const MatchedPointList& pairs, const Layers& global, const Layers& local)
{
    out.WriteAs<uint64_t>(pairs.size());
    RunKind kind;
    Pair before;
    before.globalIdx = before.localIdx = 0;
    std::string bytes;
    uint64_t count = 0;
    for (const Pair& pair : pairs)
    {
        const RunKind its = {layer_of(global, kind.global, pair.globalIdx, pair.global),
                             layer_of(local, kind.local, pair.localIdx, pair.local),
                             is_float(pair.errorSquareAfterTransformation) ? uint8_t(1) : uint8_t(0)};
        if (count > 0 && !(its == kind)) write_run(out, kind, count, bytes), bytes.clear(), count = 0;
        kind = its;
        append_pair(bytes, kind, before, pair);
        before = pair, count++;
    }
    if (count > 0) write_run(out, kind, count, bytes);
}

// ---- Reading ----------------------------------------------------------------------------------------------

[[noreturn]] void damaged(const std::string& what)
{
    throw std::runtime_error("the pairings of an iteration are damaged: " + what);
}

template <class T>
T take(std::string_view& bytes)
{
    if (bytes.size() < sizeof(T)) damaged("a run ends too early");
    T value;
    std::memcpy(&value, bytes.data(), sizeof(T));
    bytes.remove_prefix(sizeof(T));
    return value;
}

uint32_t take_difference(std::string_view& bytes, uint32_t from)
{
    uint64_t zigzag = 0;
    for (int shift = 0;; shift += 7)
    {
        if (shift > 35) damaged("a number is too long");
        const auto byte = take<uint8_t>(bytes);
        zigzag |= static_cast<uint64_t>(byte & 0x7f) << shift;
        if (byte < 0x80) break;
    }
    return static_cast<uint32_t>(from + ((zigzag >> 1) ^ (~(zigzag & 1) + 1)));
}

TPoint3D take_point(std::string_view& bytes, const Layers& layers, uint8_t layer, uint32_t index)
{
    if (layer == 0)
    {
        const auto x = take<double>(bytes), y = take<double>(bytes), z = take<double>(bytes);
        return {x, y, z};
    }
    if (layer > layers.size() || index >= layers[layer - 1u]->size()) damaged("there is no such point");
    return point_of(*layers[layer - 1u], index);
}

Pair take_pair(std::string_view& bytes, const RunKind& kind, const Pair& before, const Layers& global,
               const Layers& local)
{
    Pair pair;
    pair.globalIdx = take_difference(bytes, before.globalIdx);
    pair.localIdx = take_difference(bytes, before.localIdx);
    pair.global = take_point(bytes, global, kind.global, pair.globalIdx);
    pair.local = take_point(bytes, local, kind.local, pair.localIdx);
    pair.errorSquareAfterTransformation =
        kind.float_error ? static_cast<double>(take<float>(bytes)) : take<double>(bytes);
    return pair;
}

void read_points(CArchive& in, MatchedPointList& pairs, const Layers& global, const Layers& local)
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
        if (count == 0 || count > total - pairs.size()) damaged("a run is longer than the list, or empty");
        std::string_view left = bytes;
        for (uint64_t i = 0; i < count; i++)
            pairs.push_back(before = take_pair(left, kind, before, global, local));
        if (!left.empty()) damaged("a run holds more than its pairs");
    }
}
}  // namespace

void write_compact(CArchive& out, const Pairings& p, const metric_map_t& global, const metric_map_t& local)
{
    write_points(out, p.paired_pt2pt, cloud_layers(global), cloud_layers(local));
    Pairings rest;
    rest.paired_pt2ln = p.paired_pt2ln, rest.paired_pt2pl = p.paired_pt2pl;
    rest.paired_ln2ln = p.paired_ln2ln, rest.paired_pl2pl = p.paired_pl2pl;
    rest.point_weights = p.point_weights;
    rest.pt2ln_weights = p.pt2ln_weights, rest.pt2pl_weights = p.pt2pl_weights;
    rest.ln2ln_weights = p.ln2ln_weights, rest.pl2pl_weights = p.pl2pl_weights;
    rest.potential_pairings = p.potential_pairings;
    out << rest;
}

Pairings read_compact(CArchive& in, const metric_map_t& global, const metric_map_t& local)
{
    MatchedPointList points;
    read_points(in, points, cloud_layers(global), cloud_layers(local));
    Pairings out;
    in >> out;
    out.paired_pt2pt = std::move(points);
    return out;
}

}  // namespace mp2p_icp
