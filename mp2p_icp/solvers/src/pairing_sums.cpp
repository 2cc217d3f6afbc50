#include "pairing_sums.h"

#include <mp2p_icp/parallel.h>
#include <mp2p_icp/se3.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "outer_sums.h"

namespace mp2p_icp
{
namespace
{
using Eigen::Matrix3d;
using Eigen::Vector3d;

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
/// outlier or to the frame's origin. One that outweighs the others by far is the middle.
void choose_origins(const PreparedPairings& in, size_t count, PairingSums& out)
{
    const std::array<size_t, 3> few = {0, count / 2, count - 1};
    std::array<std::pair<Vector3d, Vector3d>, 3> at;
    std::array<double, 3> w{};
    for (size_t k = 0; k < 3; k++)
        at[k] = points_of(in, few[k]), w[k] = in.weight(pairing_id(in.pairings(), few[k]));
    const double heaviest = *std::max_element(w.begin(), w.end());
    const Vector3d mean = (at[0].second + at[1].second + at[2].second) * (1.0 / 3);
    double least = std::numeric_limits<double>::infinity();
    for (size_t k = 0; k < 3; k++)
    {
        const double distance_sq = (at[k].second - mean).squaredNorm();
        if (w[k] < 1e-3 * heaviest || !(distance_sq < least)) continue;
        least = distance_sq;
        out.a_origin = at[k].first, out.b_origin = at[k].second;
    }
}

/// Collects rows along or across unit vectors: the loops below are most of what a pairing costs.
class RowCollector
{
 public:
    explicit RowCollector(RowSums& sums) : s_(sums) {}
    ~RowCollector() { empty(); }

    /// C = u u' (`along`) or I - u u'.
    void add(double w, const Vector3d& u, bool along, const Vector3d& b, const Vector3d& q)
    {
        if (C_.full()) empty();
        const size_t k = C_.size++;
        Cq_.size++, moments_.size++;
        const double sign = along ? 1 : -1, diagonal = along ? 0 : w;
        const Vector3d wu = sign * w * u, wCq = diagonal * q + wu * u.dot(q);
        const double wC[6] = {diagonal + wu(0) * u(0), wu(0) * u(1), wu(0) * u(2),
                              diagonal + wu(1) * u(1), wu(1) * u(2), diagonal + wu(2) * u(2)};
        const double x = b(0), y = b(1), z = b(2),
                     zz[10] = {x * x, y * x, y * y, z * x, z * y, z * z, x, y, z, 1};
        for (int i = 0; i < 6; i++) C_.a[i][k] = wC[i];
        for (int i = 0; i < 3; i++) Cq_.a[i][k] = wCq(i);
        for (int j = 0; j < 10; j++) C_.b[j][k] = zz[j];
        moments_.a[0][k] = w, moments_.a[1][k] = w * b.squaredNorm(), moments_.a[2][k] = q.dot(wCq);
    }

 private:
    void empty()
    {
        for (int j = 0; j < 4; j++)
            std::copy_n(C_.b[6 + j], C_.size, Cq_.b[j]), std::copy_n(C_.b[6 + j], C_.size, moments_.b[j]);
        Eigen::Matrix<double, 3, 4> m = Eigen::Matrix<double, 3, 4>::Zero();
        flush(C_, s_.zzC.data()), flush(Cq_, s_.zCq.data()), flush(moments_, m.data());
        s_.b += m.row(0).head<3>().transpose(), s_.w += m(0, 3), s_.bb += m(1, 3), s_.qq += m(2, 3);
    }

    RowSums& s_;
    OuterBatch<6, 10> C_;       ///< w C (x) z z'
    OuterBatch<3, 4> Cq_;       ///< w C q z'
    OuterBatch<3, 4> moments_;  ///< (w, w |b|^2, w q' C q) z', of which some are needed
};

/// Collects directions of one sign rule.
class DirectionCollector
{
 public:
    DirectionCollector(DirectionSums& sums, DirectionSign sign) : s_(sums), free_(sign == DirectionSign::Free)
    {
    }
    ~DirectionCollector() { empty(); }

    void add(double w, const Vector3d& global, const Vector3d& local)
    {
        if (free_ ? crossed_.full() : pairs_.full()) empty();
        free_ ? add_free(w, global, local) : add_oriented(w, global, local);
    }

 private:
    void add_free(double w, const Vector3d& u, const Vector3d& v)
    {
        const size_t k = crossed_.size++;
        const Vector3d wu = -w * u;
        const double wC[6] = {w + wu(0) * u(0), wu(0) * u(1), wu(0) * u(2),
                              w + wu(1) * u(1), wu(1) * u(2), w + wu(2) * u(2)};
        const double vv[6] = {v(0) * v(0), v(0) * v(1), v(0) * v(2), v(1) * v(1), v(1) * v(2), v(2) * v(2)};
        for (int i = 0; i < 6; i++) crossed_.a[i][k] = wC[i], crossed_.b[i][k] = vv[i];
    }
    void add_oriented(double w, const Vector3d& u, const Vector3d& v)
    {
        const size_t k = pairs_.size++;
        for (int i = 0; i < 3; i++)
            pairs_.a[i][k] = w * u(i), pairs_.a[3 + i][k] = w * v(i), pairs_.b[i][k] = u(i),
            pairs_.b[3 + i][k] = v(i);
        pairs_.b[6][k] = 1;
    }
    void empty()
    {
        flush(crossed_, s_.free.data());
        Eigen::Matrix<double, 6, 7> sum = Eigen::Matrix<double, 6, 7>::Zero();
        flush(pairs_, sum.data());
        PointSums& o = s_.oriented;
        o.aa += sum.block<3, 3>(0, 0), o.bb += sum.block<3, 3>(3, 3), o.B += sum.block<3, 3>(0, 3);
        o.a += sum.block<3, 1>(0, 6), o.b += sum.block<3, 1>(3, 6);
        o.w += sum.block<3, 3>(0, 0).trace();  // of unit vectors
    }

    DirectionSums& s_;
    const bool free_;
    OuterBatch<6, 6> crossed_;  ///< w (I - u_g u_g') (x) u_l u_l'
    OuterBatch<6, 7> pairs_;    ///< w (u_g, u_l) (u_g, u_l, 1)'
};

/// The part of all pairings but the points that one block sums.
class BlockOfOthers
{
 public:
    BlockOfOthers(const PreparedPairings& in, const PairingSums& origins, size_t from, size_t to)
        : in_(in), a_(origins.a_origin), b_(origins.b_origin), from_(from), to_(to)
    {
    }

    PairingSums::Others sums()
    {
        const Pairings& p = in_.pairings();
        PairingSums::Others s;
        {
            RowCollector rows(s.point_rows);
            for_each(p.paired_pt2ln, PairingKind::Point2Line,
                     [&](const auto& x, double w, double) {
                         rows.add(w, direction_of(x.ln_global), false, local(x.pt_local),
                                  global(x.ln_global.pBase));
                     });
            for_each(p.paired_pt2pl, PairingKind::Point2Plane,
                     [&](const auto& x, double w, double) {
                         rows.add(w, normal_of(x.pl_global), true, local(x.pt_local),
                                  global(x.pl_global.centroid));
                     });
        }
        RowCollector rows(s.base_rows);
        DirectionCollector lines(s.lines, in_.kinds().ln2ln_sign), planes(s.planes, in_.kinds().pl2pl_sign);
        for_each(p.paired_ln2ln, PairingKind::Line2Line,
                 [&](const auto& x, double w, double factor)
                 {
                     const DirectionPair u = directions_of(x);
                     rows.add(w, u.global, false, local(x.ln_local.pBase), global(x.ln_global.pBase));
                     lines.add(factor, u.global, u.local);
                 });
        for_each(p.paired_pl2pl, PairingKind::Plane2Plane,
                 [&](const auto& x, double w, double factor)
                 {
                     const DirectionPair u = directions_of(x);
                     rows.add(w, u.global, true, local(x.p_local.centroid), global(x.p_global.centroid));
                     planes.add(factor, u.global, u.local);
                 });
        return s;
    }

 private:
    /// Calls f(pairing, weight, own weight) for what lies in the block; lists must come in their common
    /// order.
    template <class List, class F>
    void for_each(const List& list, PairingKind kind, const F& f)
    {
        const ListWeights& weights = in_.weights(kind);
        const size_t begin = std::max(from_, first_) - first_, end = std::min(to_, first_ + list.size());
        for (size_t i = begin; i + first_ < end; i++)
        {
            const double factor = weights.each.empty() ? 1.0 : weights.each[i];
            f(list[i], weights.common * factor, factor);
        }
        first_ += list.size();
    }
    Vector3d local(const mrpt::math::TPoint3D& p) const { return to_eigen(p) - b_; }
    Vector3d global(const mrpt::math::TPoint3D& p) const { return to_eigen(p) - a_; }

    const PreparedPairings& in_;
    const Vector3d a_, b_;
    const size_t from_, to_;
    size_t first_ = 0;  ///< of the present list in the common numbering
};

PairingSums::Others sum_others(const PreparedPairings& in, const PairingSums& origins)
{
    return block_sum<PairingSums::Others>(in.size() - in.pairings().paired_pt2pt.size(),
                                          [&](size_t from, size_t to)
                                          { return BlockOfOthers(in, origins, from, to).sums(); });
}

double rms_radius(const PairingSums& s)
{
    double w = s.points.w, squares = s.points.bb.trace();  // about the mean of the points
    double summed = squares + w * s.b_mean.squaredNorm();  // about the origin, as they were added
    if (s.others && s.others->point_rows.w > 0)
    {
        const RowSums& rows = s.others->point_rows;
        const Vector3d b = rows.b - rows.w * s.b_mean;
        squares += rows.bb - 2 * rows.b.dot(s.b_mean) + rows.w * s.b_mean.squaredNorm();
        w += rows.w, squares -= b.squaredNorm() / w, summed += rows.bb;
    }
    if (!(w > 0)) return 0;
    // Below this they coincide, but for the rounding of their coordinates and of the sums.
    const double resolved_sq = 1e-24 * s.b_origin.squaredNorm() + 1e-14 * summed / w;
    return squares / w > resolved_sq ? std::sqrt(squares / w) : 0;
}

/// Where points coincide, but for the rounding of their coordinates and of their mean, what is left of their
/// squares means nothing, and directions least of all.
void drop_rounding(PairingSums& out)
{
    PointSums& p = out.points;
    const auto is_rounding = [&](const Matrix3d& squares, const Vector3d& origin, const Vector3d& mean)
    { return squares.trace() <= p.w * (1e-24 * origin.squaredNorm() + 1e-14 * mean.squaredNorm()); };
    if (is_rounding(p.aa, out.a_origin, out.a_mean)) p.aa.setZero(), p.B.setZero();
    if (is_rounding(p.bb, out.b_origin, out.b_mean)) p.bb.setZero(), p.B.setZero();
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
    drop_rounding(out);
    if (count > points) out.others = sum_others(in, out);
    out.radius = rms_radius(out);
    return out;
}
}  // namespace

RowSums& RowSums::operator+=(const RowSums& o)
{
    w += o.w, bb += o.bb, b += o.b, zzC += o.zzC, zCq += o.zCq, qq += o.qq;
    return *this;
}

DirectionSums& DirectionSums::operator+=(const DirectionSums& o)
{
    oriented += o.oriented, free += o.free;
    return *this;
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
    sum += of.direction_weight(PairingKind::Line2Line, L()) * others->lines.weight();
    return sum + of.direction_weight(PairingKind::Plane2Plane, L()) * others->planes.weight();
}

PairingSums pairing_sums(PreparedPairings& in)
{
    PairingSums sums = sum_once(in);
    if (!sums.usable() && in.drop_unusable()) sums = sum_once(in);
    return sums;
}

}  // namespace mp2p_icp
