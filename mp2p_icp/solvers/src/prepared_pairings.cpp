#include "prepared_pairings.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace mp2p_icp
{
namespace
{
constexpr size_t KINDS = 5;
/// Beyond these, squares of the sums might overflow; no map is that large, and no sensor that exact.
constexpr double LARGEST_COORDINATE = 1e20, LARGEST_WEIGHT = 1e20;

void check(double weight)
{
    if (!(weight >= 0 && weight <= LARGEST_WEIGHT))
        throw std::invalid_argument("weights of pairings must be between 0 and 1e20, got " +
                                    std::to_string(weight));
}

/// `directions`: do pairings have directions, on whose own common weight theirs counts, too?
ListWeights list_weights(double common, const WeightRuns& runs, size_t count, bool directions = false)
{
    check(common);
    ListWeights out;
    out.common = common;
    if (!directions && runs.size() == 1 && runs[0].first >= count)
        out.common *= runs[0].second, check(out.common);
    else if (!runs.empty())
        out.each = expanded_weights(runs, count);
    for (const double w : out.each) check(w * common);
    return out;
}

bool usable(const ResidualTerm& t)
{
    return t.finite() && t.b.cwiseAbs().maxCoeff() < LARGEST_COORDINATE &&
           t.q.cwiseAbs().maxCoeff() < LARGEST_COORDINATE;
}

template <class List>
void copy_one(const List& from, size_t index, List& to)
{
    static_cast<std::vector<typename List::value_type>&>(to).push_back(from[index]);
}

void copy_one(const Pairings& from, const PairingId& id, Pairings& to)
{
    switch (id.kind)
    {
        case PairingKind::Point2Point:
            return copy_one(from.paired_pt2pt, id.index, to.paired_pt2pt);
        case PairingKind::Point2Line:
            return copy_one(from.paired_pt2ln, id.index, to.paired_pt2ln);
        case PairingKind::Point2Plane:
            return copy_one(from.paired_pt2pl, id.index, to.paired_pt2pl);
        case PairingKind::Line2Line:
            return copy_one(from.paired_ln2ln, id.index, to.paired_ln2ln);
        default:
            return copy_one(from.paired_pl2pl, id.index, to.paired_pl2pl);
    }
}
}  // namespace

PreparedPairings::PreparedPairings(const Pairings& in, const PairWeights& kinds)
    : in_(&in),
      kinds_(&kinds),
      weights_{list_weights(kinds.pt2pt, in.point_weights, in.paired_pt2pt.size()),
               list_weights(kinds.pt2ln, in.pt2ln_weights, in.paired_pt2ln.size()),
               list_weights(kinds.pt2pl, in.pt2pl_weights, in.paired_pt2pl.size()),
               list_weights(kinds.ln2ln, in.ln2ln_weights, in.paired_ln2ln.size(), true),
               list_weights(kinds.pl2pl, in.pl2pl_weights, in.paired_pl2pl.size(), true)}
{
    check(kinds.ln2ln_direction.value_or(0)), check(kinds.pl2pl_direction.value_or(0));
}

double PreparedPairings::direction_weight(PairingKind kind, double L) const
{
    const auto& given = kind == PairingKind::Line2Line ? kinds_->ln2ln_direction : kinds_->pl2pl_direction;
    return given ? *given : weights(kind).common * L * L;
}

double PreparedPairings::direction_weight(const PairingId& id, double L) const
{
    const auto& each = weights(id.kind).each;
    return direction_weight(id.kind, L) * (each.empty() ? 1.0 : each[id.index]);
}

size_t PreparedPairings::rows() const
{
    const Pairings& p = pairings();
    const auto counting = [this](PairingKind kind, size_t count, double common)
    {
        const auto& each = weights(kind).each;
        if (!(common > 0)) return size_t(0);
        if (each.empty()) return count;
        return static_cast<size_t>(std::count_if(each.begin(), each.end(), [](double w) { return w > 0; }));
    };
    const auto positions = [&](PairingKind kind, size_t count)
    { return counting(kind, count, weights(kind).common); };
    const auto directions = [&](PairingKind kind, size_t count)
    { return counting(kind, count, direction_weight(kind, 1)); };
    const size_t lines = p.paired_ln2ln.size(), planes = p.paired_pl2pl.size();
    return 3 * positions(PairingKind::Point2Point, p.paired_pt2pt.size()) +
           2 * positions(PairingKind::Point2Line, p.paired_pt2ln.size()) +
           positions(PairingKind::Point2Plane, p.paired_pt2pl.size()) +
           2 * (positions(PairingKind::Line2Line, lines) + directions(PairingKind::Line2Line, lines)) +
           positions(PairingKind::Plane2Plane, planes) + 2 * directions(PairingKind::Plane2Plane, planes);
}

void PreparedPairings::scale_weight(const PairingId& id, double factor)
{
    auto& each = weights_[static_cast<size_t>(id.kind)].each;
    if (each.empty())
    {
        const Pairings& p = pairings();
        const size_t counts[] = {p.paired_pt2pt.size(), p.paired_pt2ln.size(), p.paired_pt2pl.size(),
                                 p.paired_ln2ln.size(), p.paired_pl2pl.size()};
        each.assign(counts[static_cast<size_t>(id.kind)], 1.0);
    }
    each[id.index] *= factor;
}

PreparedPairings PreparedPairings::with_factors(const std::vector<double>& factors) const
{
    PreparedPairings out = *this;
    for (size_t i = 0; i < factors.size(); i++) out.scale_weight(pairing_id(pairings(), i), factors[i]);
    return out;
}

namespace
{
template <class Point>
bool usable_point(const Point& p)
{
    const double limit = LARGEST_COORDINATE / 2;  // NaN is not below it
    return std::abs(double(p.x)) < limit && std::abs(double(p.y)) < limit && std::abs(double(p.z)) < limit;
}
bool usable_direction(double x, double y, double z)
{
    const double square = x * x + y * y + z * z;
    return square > 1e-200 && square < 1e200;
}
bool usable_line(const mrpt::math::TLine3D& l)
{
    return usable_point(l.pBase) && usable_direction(l.director.x, l.director.y, l.director.z);
}
bool usable_plane(const plane_patch_t& p)
{
    const auto& n = p.plane.coefs;
    return usable_point(p.centroid) && usable_direction(n[0], n[1], n[2]);
}
}  // namespace

bool PreparedPairings::all_usable() const
{
    const Pairings& p = pairings();
    bool all = true;
    for (const auto& x : p.paired_pt2pt) all &= usable_point(x.local) && usable_point(x.global);
    for (const auto& x : p.paired_pt2ln) all &= usable_point(x.pt_local) && usable_line(x.ln_global);
    for (const auto& x : p.paired_pt2pl) all &= usable_point(x.pt_local) && usable_plane(x.pl_global);
    for (const auto& x : p.paired_ln2ln) all &= usable_line(x.ln_local) && usable_line(x.ln_global);
    for (const auto& x : p.paired_pl2pl) all &= usable_plane(x.p_local) && usable_plane(x.p_global);
    return all;
}

bool PreparedPairings::drop_unusable()
{
    auto clean = std::make_shared<Pairings>();
    std::array<std::vector<size_t>, KINDS> index;
    std::array<ListWeights, KINDS> weights;
    bool any = false;
    for (size_t k = 0; k < KINDS; k++) weights[k].common = weights_[k].common;
    for (size_t i = 0; i < size(); i++)
    {
        const PairingId id = pairing_id(pairings(), i);
        const auto k = static_cast<size_t>(id.kind);
        const PairingTerms t = terms(id);
        if (!usable(t.position) || (t.direction && !usable(*t.direction)))
        {
            skipped_ += in_use(id) ? 1 : 0;
            any = true;
            continue;
        }
        copy_one(pairings(), id, *clean);
        index[k].push_back(clean_ ? original_index_[k][id.index] : id.index);
        if (!weights_[k].each.empty()) weights[k].each.push_back(weights_[k].each[id.index]);
    }
    if (!any) return false;
    clean_ = clean, original_index_ = index, weights_ = weights;
    return true;
}

void PreparedPairings::note_outlier(const PairingId& id, OutlierIndices& outliers) const
{
    std::vector<size_t>* const lists[] = {&outliers.point2point, &outliers.point2line, &outliers.point2plane,
                                          &outliers.line2line, &outliers.plane2plane};
    const auto k = static_cast<size_t>(id.kind);
    lists[k]->push_back(clean_ ? original_index_[k][id.index] : id.index);
}

}  // namespace mp2p_icp
