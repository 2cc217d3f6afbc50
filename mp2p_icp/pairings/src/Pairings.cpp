#include <mp2p_icp/Pairings.h>
#include <mp2p_icp/errors.h>
#include <mrpt/opengl/CSetOfLines.h>

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

std::vector<double> Pairings::expanded_point_weights() const
{
    std::vector<double> weights;
    weights.reserve(paired_pt2pt.size());
    for (const auto& [count, weight] : point_weights)
        weights.insert(weights.end(), std::min(count, paired_pt2pt.size() - weights.size()), weight);
    weights.resize(paired_pt2pt.size(), 1.0);
    return weights;
}

namespace
{
/// The runs that cover exactly `count` pairs: cut off behind them, filled up with the default weight.
std::vector<std::pair<size_t, double>> runs_for(const std::vector<std::pair<size_t, double>>& runs,
                                                size_t count)
{
    std::vector<std::pair<size_t, double>> out;
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
}  // namespace

void Pairings::push_back(const Pairings& other)
{
    if (&other == this) return push_back(Pairings(other));
    if (!point_weights.empty() || !other.point_weights.empty())
    {
        point_weights = runs_for(point_weights, paired_pt2pt.size());
        append(point_weights, runs_for(other.point_weights, other.paired_pt2pt.size()));
    }
    append<std::vector<mrpt::tfest::TMatchingPair_d>>(paired_pt2pt, other.paired_pt2pt);
    append(paired_pt2ln, other.paired_pt2ln);
    append(paired_pt2pl, other.paired_pt2pl);
    append(paired_ln2ln, other.paired_ln2ln);
    append(paired_pl2pl, other.paired_pl2pl);
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

constexpr uint8_t PAIRINGS_VERSION = 0;
}  // namespace

void Pairings::serializeTo(CArchive& out) const
{
    out.WriteAs<uint8_t>(PAIRINGS_VERSION);
    put_list(out, paired_pt2pt), put_list(out, paired_pt2ln), put_list(out, paired_pt2pl);
    put_list(out, paired_ln2ln), put_list(out, paired_pl2pl), put_list(out, point_weights);
    out << potential_pairings;
}

void Pairings::serializeFrom(CArchive& in)
{
    const auto version = in.ReadAs<uint8_t>();
    if (version != PAIRINGS_VERSION)
        throw DataError("pairings", "", "version " + std::to_string(PAIRINGS_VERSION),
                        "version " + std::to_string(version));
    try
    {
        get_list(in, paired_pt2pt), get_list(in, paired_pt2ln), get_list(in, paired_pt2pl);
        get_list(in, paired_ln2ln), get_list(in, paired_pl2pl), get_list(in, point_weights);
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

std::shared_ptr<mrpt::opengl::CSetOfObjects> Pairings::get_visualization(
    const mrpt::poses::CPose3D& localWrtGlobal, const pairings_render_params_t& p) const
{
    auto o = mrpt::opengl::CSetOfObjects::Create();
    if (!p.pt2pt || paired_pt2pt.empty()) return o;
    auto segments = mrpt::opengl::CSetOfLines::Create();
    segments->setColor_u8(p.pt2pt_color);
    for (const auto& pair : paired_pt2pt)
        segments->appendLine(pair.global, localWrtGlobal.composePoint(pair.local));
    o->insert(segments);
    return o;
}

}  // namespace mp2p_icp
