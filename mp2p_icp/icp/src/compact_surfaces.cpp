#include "compact_surfaces.h"

#include <mrpt/serialization/CArchive.h>

#include "compact_bytes.h"

namespace mp2p_icp
{
using mrpt::math::TPoint3D;
using mrpt::serialization::CArchive;

CompactPlane::Values CompactPlane::of(const Pair& pair)
{
    const auto& [plane, c] = pair.pl_global;
    return {plane.coefs[0], plane.coefs[1], plane.coefs[2], plane.coefs[3], c.x, c.y, c.z};
}
CompactPlane::Pair CompactPlane::pair(const Values& v, const TPoint3D& local)
{
    return {{mrpt::math::TPlane(v[0], v[1], v[2], v[3]), {v[4], v[5], v[6]}}, local};
}
CompactLine::Values CompactLine::of(const Pair& pair)
{
    const auto& [p, d] = pair.ln_global;
    return {p.x, p.y, p.z, d.x, d.y, d.z};
}
CompactLine::Pair CompactLine::pair(const Values& v, const TPoint3D& local)
{
    Pair pair;
    pair.ln_global.pBase = {v[0], v[1], v[2]}, pair.ln_global.director = {v[3], v[4], v[5]};
    pair.pt_local = local;
    return pair;
}

// ---- Writing ----------------------------------------------------------------------------------------------

/// Points come in the order of their layer, mostly: the next one is found where the last one was.
template <class Kind>
bool CompactSurfaceWriter<Kind>::find_in(uint8_t layer, const TPoint3D& p, Point& found)
{
    const auto& points = local_.layer(layer);
    const auto x = static_cast<float>(p.x);
    auto at = starts_[layer];
    for (size_t tried = 0; tried < points.size && steps_left_ > 0; tried++, steps_left_--, at++)
    {
        if (at >= points.size) at = 0;
        if (points.x[at] != x || !local_.has(layer, at, p)) continue;
        starts_[layer] = at + 1;
        found = {layer, at};
        return true;
    }
    return false;
}

template <class Kind>
typename CompactSurfaceWriter<Kind>::Point CompactSurfaceWriter<Kind>::find(const TPoint3D& p,
                                                                            uint8_t layer_before)
{
    Point found;
    if (layer_before > 0 && find_in(layer_before, p, found)) return found;
    for (size_t i = 1; i <= local_.size(); i++)
        if (i != layer_before && find_in(static_cast<uint8_t>(i), p, found)) return found;
    return found;
}

/// Where the number of a surface is, or goes.
template <class Kind>
uint32_t& CompactSurfaceWriter<Kind>::slot_of(const Values& values)
{
    uint64_t hash = 0;
    for (const double v : values)
    {
        uint64_t bits;
        std::memcpy(&bits, &v, sizeof(bits));
        hash = (hash ^ bits) * 0x9e3779b97f4a7c15u;
        hash ^= hash >> 32;
    }
    const size_t mask = slots_.size() - 1;
    size_t at = hash & mask;
    while (slots_[at] != 0 && std::memcmp(&known_[slots_[at] - 1], &values, sizeof(values)) != 0)
        at = (at + 1) & mask;
    return slots_[at];
}

template <class Kind>
void CompactSurfaceWriter<Kind>::grow()
{
    slots_.assign(2 * slots_.size(), 0);
    for (uint32_t i = 0; i < known_.size(); i++) slot_of(known_[i]) = i + 1;
}

template <class Kind>
void CompactSurfaceWriter<Kind>::append_surface(const Values& values, uint32_t before, std::string& bytes,
                                                uint32_t& number)
{
    uint32_t& slot = slot_of(values);
    const bool is_new = slot == 0;
    if (is_new) known_.push_back(values), slot = static_cast<uint32_t>(known_.size());
    number = slot - 1;
    append_difference(bytes, before, number);
    if (!is_new) return;
    append(bytes, values);
    if (2 * known_.size() > slots_.size()) grow();
}

template <class Kind>
void CompactSurfaceWriter<Kind>::write(CArchive& out, const std::vector<typename Kind::Pair>& pairs)
{
    constexpr size_t times_through_all = 4;  // a list in any order could take as many times as it has pairs
    steps_left_ = times_through_all * (local_.points() + pairs.size());
    std::fill(starts_.begin(), starts_.end(), 0);
    out.WriteAs<uint64_t>(pairs.size());
    std::string bytes;
    uint64_t count = 0;
    uint32_t index = 0, next = 0;
    uint8_t layer = 0;
    const auto write_run = [&]
    {
        if (count == 0) return;
        out.WriteAs<uint8_t>(layer);
        out.WriteAs<uint64_t>(count);
        out << bytes;
        bytes.clear(), count = 0;
    };
    for (const auto& pair : pairs)
    {
        const Point point = find(pair.pt_local, layer);
        if (point.layer != layer) write_run(), layer = point.layer;
        if (layer == 0)
            append_point(bytes, pair.pt_local);
        else
            append_difference(bytes, index, point.index), index = point.index;
        uint32_t number = 0;
        append_surface(Kind::of(pair), next, bytes, number);
        next = number + 1, count++;
    }
    write_run();
}

// ---- Reading ----------------------------------------------------------------------------------------------

template <class Kind>
typename Kind::Pair CompactSurfaceReader<Kind>::take_pair(std::string_view& bytes, uint8_t layer)
{
    if (layer > 0) index_ = take_difference(bytes, index_);
    const auto local = local_.take_point(bytes, layer, index_);
    const auto number = take_difference(bytes, next_);
    if (number > known_.size()) pairings_are_damaged("there is no such surface");
    if (number == known_.size()) known_.push_back(take<typename Kind::Values>(bytes));
    next_ = number + 1;
    return Kind::pair(known_[number], local);
}

template <class Kind>
void CompactSurfaceReader<Kind>::read(CArchive& in, std::vector<typename Kind::Pair>& pairs)
{
    index_ = next_ = 0;
    const auto total = in.ReadAs<uint64_t>();
    while (pairs.size() < total)
    {
        const auto layer = in.ReadAs<uint8_t>();
        const auto count = in.ReadAs<uint64_t>();
        const auto bytes = in.ReadAs<std::string>();
        if (count == 0 || count > total - pairs.size())
            pairings_are_damaged("a run is longer than the list, or empty");
        std::string_view left = bytes;
        for (uint64_t i = 0; i < count; i++) pairs.push_back(take_pair(left, layer));
        if (!left.empty()) pairings_are_damaged("a run holds more than its pairs");
    }
}

template class CompactSurfaceWriter<CompactPlane>;
template class CompactSurfaceWriter<CompactLine>;
template class CompactSurfaceReader<CompactPlane>;
template class CompactSurfaceReader<CompactLine>;

}  // namespace mp2p_icp
