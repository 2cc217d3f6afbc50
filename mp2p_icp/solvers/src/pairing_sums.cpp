#include "pairing_sums.h"

#include <mp2p_icp/parallel.h>
#include <mp2p_icp/se3.h>

#include <cmath>
#include <limits>

namespace mp2p_icp
{
namespace
{
using Eigen::Matrix3d;
using Eigen::Vector3d;

/// A term relative to the origins.
ResidualTerm relative(ResidualTerm t, const PairingSums& origins)
{
    t.b -= origins.b_origin, t.q -= origins.a_origin;
    return t;
}

/// Both points of the i-th pairing.
std::pair<Vector3d, Vector3d> points_of(const PreparedPairings& in, size_t i)
{
    const auto& points = in.pairings().paired_pt2pt;
    if (i < points.size())
        return {to_eigen(mrpt::math::TPoint3D(points[i].global)),
                to_eigen(mrpt::math::TPoint3D(points[i].local))};
    const ResidualTerm t = in.terms(pairing_id(in.pairings(), i)).position;
    return {t.q, t.b};
}

/// Of a few pairings, the one in the middle: sums relative to it do not cancel, as they would relative to an
/// outlier or to the frame's origin.
void choose_origins(const PreparedPairings& in, size_t count, PairingSums& out)
{
    const auto first = points_of(in, 0), middle = points_of(in, count / 2), last = points_of(in, count - 1);
    const Vector3d mean = (first.second + middle.second + last.second) * (1.0 / 3);
    double least = std::numeric_limits<double>::infinity();
    for (const auto* p : {&first, &middle, &last})
    {
        const double distance_sq = (p->second - mean).squaredNorm();
        if (!(distance_sq < least)) continue;
        least = distance_sq;
        out.a_origin = p->first, out.b_origin = p->second;
    }
}

PairingSums::Others sum_others(const PreparedPairings& in, const PairingSums& origins)
{
    const size_t points = in.pairings().paired_pt2pt.size();
    return block_sum<PairingSums::Others>(
        in.size() - points,
        [&](size_t from, size_t to)
        {
            PairingSums::Others s;
            for (size_t i = from; i < to; i++)
            {
                const PairingId id = pairing_id(in.pairings(), points + i);
                const ResidualTerm position = relative(in.terms(id).position, origins);
                const bool is_point = id.kind < PairingKind::Line2Line;
                (is_point ? s.point_rows : s.base_rows).add(in.weight(id), position);
                const auto& each = in.weights(id.kind).each;
                const double factor = each.empty() ? 1.0 : each[id.index];
                if (id.kind == PairingKind::Line2Line)
                    s.lines.add(factor, directions_of(in.pairings().paired_ln2ln[id.index]),
                                in.kinds().ln2ln_sign);
                if (id.kind == PairingKind::Plane2Plane)
                    s.planes.add(factor, directions_of(in.pairings().paired_pl2pl[id.index]),
                                 in.kinds().pl2pl_sign);
            }
            return s;
        });
}

double rms_radius(const PairingSums& s)
{
    double w = s.points.w, squares = s.points.bb.trace();  // about the mean of the points
    if (s.others && s.others->point_rows.w > 0)
    {
        const RowSums& rows = s.others->point_rows;
        const Vector3d b = rows.b - rows.w * s.b_mean;
        squares += rows.bb - 2 * rows.b.dot(s.b_mean) + rows.w * s.b_mean.squaredNorm();
        w += rows.w, squares -= b.squaredNorm() / w;
    }
    if (!(w > 0)) return 1;
    const double mean_square = squares / w;
    // Below this they coincide, but for the rounding of their coordinates.
    const double resolved_sq = 1e-24 * (s.b_origin.squaredNorm() + s.b_mean.squaredNorm());
    return mean_square > resolved_sq ? std::sqrt(mean_square) : 1;
}

PairingSums sum_once(const PreparedPairings& in)
{
    PairingSums out;
    const size_t count = in.size(), points = in.pairings().paired_pt2pt.size();
    if (count == 0) return out;
    choose_origins(in, count, out);
    PointOrigin origin;
    origin.a = out.a_origin, origin.b = out.b_origin;
    out.points = point_sums(in.pairings().paired_pt2pt, in.weights(PairingKind::Point2Point), origin);
    out.points.centre(out.a_mean, out.b_mean);
    if (count > points) out.others = sum_others(in, out);
    out.L = rms_radius(out);
    return out;
}
}  // namespace

RowSums& RowSums::operator+=(const RowSums& o)
{
    w += o.w, bb += o.bb, b += o.b, zzC += o.zzC, zCq += o.zCq, qq += o.qq;
    return *this;
}

void RowSums::add(double weight, const ResidualTerm& t)
{
    const double x = t.b.x(), y = t.b.y(), z = t.b.z();
    const Vector3d wCq = weight * (t.C * t.q);
    w += weight, bb += weight * t.b.squaredNorm(), b += weight * t.b, qq += t.q.dot(wCq);
    Eigen::Matrix<double, 1, 10> zz;
    zz << x * x, y * x, y * y, z * x, z * y, z * z, x, y, z, 1;
    const Packed3 wC = weight * packed(t.C);
    zzC.noalias() += wC * zz;
    zCq.leftCols<3>().noalias() += wCq * t.b.transpose();
    zCq.col(3) += wCq;
}

DirectionSums& DirectionSums::operator+=(const DirectionSums& o)
{
    oriented += o.oriented, free += o.free;
    return *this;
}

void DirectionSums::add(double factor, const DirectionPair& u, DirectionSign sign)
{
    if (sign == DirectionSign::Oriented) return oriented.add(factor, u.global, u.local);
    const Packed3 wC = factor * packed(direction_term(u, sign).C);
    free.noalias() += wC * packed(u.local * u.local.transpose()).transpose();
}

double DirectionSums::weight() const
{
    double traces = 0;  // of u u' and of I - u u': 1 and 2
    for (const int diagonal : {0, 3, 5}) traces += free(0, diagonal) + free(3, diagonal) + free(5, diagonal);
    return oriented.w + traces / 2;
}

PairingSums::Others& PairingSums::Others::operator+=(const Others& o)
{
    point_rows += o.point_rows, base_rows += o.base_rows, lines += o.lines, planes += o.planes;
    return *this;
}

bool PairingSums::usable() const
{
    if (!points.usable()) return false;
    if (!others) return true;
    const auto& o = *others;
    return o.point_rows.zzC.allFinite() && o.point_rows.zCq.allFinite() && o.base_rows.zzC.allFinite() &&
           o.base_rows.zCq.allFinite() && o.lines.free.allFinite() && o.lines.oriented.usable() &&
           o.planes.free.allFinite() && o.planes.oriented.usable();
}

double PairingSums::weight(const PreparedPairings& of) const
{
    double sum = points.w;
    if (!others) return sum;
    sum += others->point_rows.w + others->base_rows.w;
    sum += of.direction_weight(PairingKind::Line2Line, L) * others->lines.weight();
    return sum + of.direction_weight(PairingKind::Plane2Plane, L) * others->planes.weight();
}

PairingSums pairing_sums(PreparedPairings& in)
{
    PairingSums sums = sum_once(in);
    if (!sums.usable() && in.drop_unusable()) sums = sum_once(in);
    return sums;
}

}  // namespace mp2p_icp
