#include <mp2p_icp/Pairings.h>
#include <mp2p_icp/errors.h>

#include <algorithm>

namespace mp2p_icp
{
void MatchedPointList::push_back(const mrpt::tfest::TMatchingPair& p)
{
    mrpt::tfest::TMatchingPair_d d(p.globalIdx, p.localIdx, mrpt::math::TPoint3D(p.global),
                                   mrpt::math::TPoint3D(p.local));
    d.errorSquareAfterTransformation = static_cast<double>(p.errorSquareAfterTransformation);
    push_back(d);
}

void MatchedPointList::push_back(const mrpt::tfest::TMatchingPairList& pairs)
{
    for (const auto& p : pairs) push_back(p);
}

bool Pairings::empty() const
{
    return size() == 0;
}

size_t Pairings::size() const
{
    return paired_pt2pt.size() + paired_pt2ln.size() + paired_pt2pl.size() + paired_ln2ln.size() +
           paired_pl2pl.size();
}

std::string Pairings::contents_summary() const
{
    std::string out;
    const auto add = [&out](size_t count, const char* kind)
    {
        if (count) out += (out.empty() ? "" : ", ") + std::to_string(count) + " " + kind;
    };
    add(paired_pt2pt.size(), "point-point");
    add(paired_pt2ln.size(), "point-line");
    add(paired_pt2pl.size(), "point-plane");
    add(paired_ln2ln.size(), "line-line");
    add(paired_pl2pl.size(), "plane-plane");
    return (out.empty() ? std::string("no pairings") : out) + " out of " + std::to_string(potential_pairings);
}

// ---- Weights and merging ----------------------------------------------------------------------------------

std::vector<double> expanded_weights(const WeightRuns& runs, size_t count)
{
    std::vector<double> weights;
    weights.reserve(count);
    for (const auto& [length, weight] : runs)
        weights.insert(weights.end(), std::min(length, count - weights.size()), weight);
    weights.resize(count, 1.0);
    return weights;
}

std::vector<double> Pairings::expanded_point_weights() const
{
    return expanded_weights(point_weights, paired_pt2pt.size());
}

namespace
{
/// Calls work(list, weights) with pointers to both members of each kind, in the order of the archives.
template <class Work>
void for_each_kind(const Work& work)
{
    work(&Pairings::paired_pt2pt, &Pairings::point_weights);
    work(&Pairings::paired_pt2ln, &Pairings::pt2ln_weights);
    work(&Pairings::paired_pt2pl, &Pairings::pt2pl_weights);
    work(&Pairings::paired_ln2ln, &Pairings::ln2ln_weights);
    work(&Pairings::paired_pl2pl, &Pairings::pl2pl_weights);
}

/// The runs that cover exactly `count` pairs: cut off behind them, filled up with the default weight.
WeightRuns runs_for(const WeightRuns& runs, size_t count)
{
    WeightRuns out;
    size_t left = count;
    for (const auto& [length, weight] : runs)
    {
        if (left == 0) break;
        out.emplace_back(std::min(length, left), weight);
        left -= out.back().first;
    }
    if (left > 0) out.emplace_back(left, 1.0);
    return out;
}

template <class List>
void append(List& to, const List& from)
{
    to.insert(to.end(), from.begin(), from.end());
}

/// Appends one kind of pairings and their weights.
template <class List>
void append_weighted(List& to, WeightRuns& to_weights, const List& from, const WeightRuns& from_weights)
{
    if (!to_weights.empty() || !from_weights.empty())
    {
        to_weights = runs_for(to_weights, to.size());
        append(to_weights, runs_for(from_weights, from.size()));
    }
    append(to, from);
}
}  // namespace

void Pairings::push_back(const Pairings& other)
{
    if (&other == this) return push_back(Pairings(other));
    for_each_kind([&](auto list, auto weights)
                  { append_weighted(this->*list, this->*weights, other.*list, other.*weights); });
    potential_pairings += other.potential_pairings;
}

void Pairings::push_back(Pairings&& other)
{
    if (empty() && potential_pairings == 0)
        *this = std::move(other);
    else
        push_back(static_cast<const Pairings&>(other));
}

// ---- Serialization ----------------------------------------------------------------------------------------
namespace
{
using mrpt::serialization::CArchive;

void put(CArchive& out, const mrpt::tfest::TMatchingPair_d& p)
{
    out << p;
}
void get(CArchive& in, mrpt::tfest::TMatchingPair_d& p)
{
    in >> p;
}
void put(CArchive& out, const plane_patch_t& p)
{
    out << p.plane << p.centroid;
}
void get(CArchive& in, plane_patch_t& p)
{
    in >> p.plane >> p.centroid;
}
void put(CArchive& out, const point_line_pair_t& p)
{
    out << p.ln_global << p.pt_local;
}
void get(CArchive& in, point_line_pair_t& p)
{
    in >> p.ln_global >> p.pt_local;
}
void put(CArchive& out, const matched_line_t& p)
{
    out << p.ln_global << p.ln_local;
}
void get(CArchive& in, matched_line_t& p)
{
    in >> p.ln_global >> p.ln_local;
}
void put(CArchive& out, const point_plane_pair_t& p)
{
    put(out, p.pl_global), out << p.pt_local;
}
void get(CArchive& in, point_plane_pair_t& p)
{
    get(in, p.pl_global), in >> p.pt_local;
}
void put(CArchive& out, const matched_plane_t& p)
{
    put(out, p.p_global), put(out, p.p_local);
}
void get(CArchive& in, matched_plane_t& p)
{
    get(in, p.p_global), get(in, p.p_local);
}
void put(CArchive& out, const std::pair<size_t, double>& p)
{
    out.WriteAs<uint64_t>(p.first), out << p.second;
}
void get(CArchive& in, std::pair<size_t, double>& p)
{
    p.first = in.ReadAs<uint64_t>(), in >> p.second;
}

template <class List>
void put_list(CArchive& out, const List& list)
{
    out.WriteAs<uint64_t>(list.size());
    for (const auto& item : list) put(out, item);
}

/// The list grows as its items arrive, so that a damaged count ends at the end of the data and not in a huge
/// allocation.
template <class List>
void get_list(CArchive& in, List& list)
{
    list.clear();
    for (uint64_t left = in.ReadAs<uint64_t>(); left > 0; left--)
    {
        typename List::value_type item;
        get(in, item);
        list.push_back(item);
    }
}

/// 0: five lists, point_weights, potential_pairings. 1: the weights of the other kinds follow point_weights.
constexpr uint8_t PAIRINGS_VERSION = 1;
}  // namespace

void Pairings::serializeTo(CArchive& out) const
{
    out.WriteAs<uint8_t>(PAIRINGS_VERSION);
    for_each_kind([&](auto list, auto) { put_list(out, this->*list); });
    for_each_kind([&](auto, auto weights) { put_list(out, this->*weights); });
    out << potential_pairings;
}

void Pairings::serializeFrom(CArchive& in)
{
    const auto version = in.ReadAs<uint8_t>();
    if (version > PAIRINGS_VERSION)
        throw DataError("pairings", "", "version 0 to " + std::to_string(PAIRINGS_VERSION),
                        "version " + std::to_string(version));
    const auto get_weights = [&](auto, auto weights)
    {
        if (version >= 1 || weights == &Pairings::point_weights)
            get_list(in, this->*weights);
        else
            (this->*weights).clear();
    };
    try
    {
        for_each_kind([&](auto list, auto) { get_list(in, this->*list); });
        for_each_kind(get_weights);
        // MRPT fails on reads beyond the end, but not on those that begin before it: this last one could be
        // cut short.
        if (in.ReadBufferFixEndianness(&potential_pairings, 1) != sizeof(potential_pairings))
            throw std::runtime_error("the data ends too early");
    }
    catch (const std::exception& e)
    {
        throw DataError("pairings", short_reason(e));
    }
}

CArchive& operator<<(CArchive& out, const Pairings& obj)
{
    obj.serializeTo(out);
    return out;
}
CArchive& operator>>(CArchive& in, Pairings& obj)
{
    obj.serializeFrom(in);
    return in;
}

}  // namespace mp2p_icp
