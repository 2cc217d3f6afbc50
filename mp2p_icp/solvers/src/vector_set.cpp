#include "vector_set.h"

#include <mp2p_icp/se3.h>

#include <cmath>

namespace mp2p_icp
{
namespace
{
using Eigen::Vector3d;
/// Points nearer to the centroid than this part of L have no direction.
constexpr double SHORTEST = 1e-4;
}  // namespace

VectorSet::VectorSet(const PreparedPairings& in, const PairingSums& sums, PointVectors point_vectors,
                     const Eigen::Matrix3d& signs, const std::optional<OriginPose>& guess)
    : in_(in), sums_(sums), points_(point_vectors), signs_(signs), guess_(guess)
{
    origin_.a = sums.a_origin, origin_.b = sums.b_origin;
    origin_.shortest_sq = std::pow(SHORTEST * sums.L(), 2);
    const size_t points = in.pairings().paired_pt2pt.size();
    const bool others = in.size() > points;
    origin_.a_mean = sums.a_mean, origin_.b_mean = sums.b_mean;
    profile_ = sums.points;
    if (others && guess) add_projections(points);
    if (points_ == PointVectors::Lengths)
    {
        if (others)
            profile_ += sum(points, [&](size_t i) { return direction_pair(pairing_id(in_.pairings(), i)); });
        return;
    }
    profile_ = unit_vector_sums(in.pairings().paired_pt2pt, in.weights(PairingKind::Point2Point), origin_,
                                points_ == PointVectors::UnitsWithSquares);
    profile_ *= sums.L() * sums.L();
    if (others) profile_ += sum(points, [&](size_t i) { return pair(i); });
}

void VectorSet::add_projections(size_t from)
{
    const PointSums more = sum(from,
                               [this](size_t i)
                               {
                                   Pair p = point_pair(pairing_id(in_.pairings(), i));
                                   p.a -= origin_.a_mean, p.b -= origin_.b_mean;
                                   return p;
                               });
    profile_ += more;
    Vector3d a_more = Vector3d::Zero(), b_more = Vector3d::Zero();
    profile_.centre(a_more, b_more);
    origin_.a_mean += a_more, origin_.b_mean += b_more;
}

VectorSet::Pair VectorSet::point_pair(const PairingId& id) const
{
    Pair out{0, Vector3d::Zero(), Vector3d::Zero()};
    if (id.kind >= PairingKind::Line2Line) return out;
    if (id.kind != PairingKind::Point2Point && !guess_) return out;
    const ResidualTerm t = in_.terms(id).position;
    out.w = in_.weight(id);
    out.b = t.b - sums_.b_origin, out.a = t.q - sums_.a_origin;
    if (id.kind != PairingKind::Point2Point)
    {
        const Vector3d at_guess = guess_->R * out.b + guess_->c;
        out.a = at_guess - t.C * (at_guess - out.a);
    }
    return out;
}

VectorSet::Pair VectorSet::direction_pair(const PairingId& id) const
{
    Pair out;
    if (id.kind < PairingKind::Line2Line) return out;
    const bool line = id.kind == PairingKind::Line2Line;
    const DirectionPair u = line ? directions_of(in_.pairings().paired_ln2ln[id.index])
                                 : directions_of(in_.pairings().paired_pl2pl[id.index]);
    const DirectionSign sign = line ? in_.kinds().ln2ln_sign : in_.kinds().pl2pl_sign;
    out.w = in_.direction_weight(id, sums_.L());
    out.a = u.global;
    out.b = sign == DirectionSign::Free && u.global.dot(signs_ * u.local) < 0 ? Vector3d(-u.local) : u.local;
    return out;
}

VectorSet::Pair VectorSet::pair(size_t i) const
{
    const PairingId id = pairing_id(in_.pairings(), i);
    if (id.kind >= PairingKind::Line2Line) return direction_pair(id);
    Pair p = point_pair(id);
    if (!(p.w > 0)) return p;
    p.a -= origin_.a_mean, p.b -= origin_.b_mean;
    if (points_ == PointVectors::Lengths) return p;
    const double shortest = SHORTEST * sums_.L();
    if (!(p.a.norm() > shortest && p.b.norm() > shortest)) return {0, Vector3d::Zero(), Vector3d::Zero()};
    p.a.normalize(), p.b.normalize();
    p.w *= sums_.L() * sums_.L();
    return p;
}

}  // namespace mp2p_icp
