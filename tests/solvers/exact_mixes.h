#pragma once

#include <algorithm>
#include <limits>

#include "random_pairings.h"

namespace mp2p_icp_test
{
using mp2p_icp::DirectionSign;

/** A mixture of kinds of pairings, with the least numbers of them that determine a pose. Where there are
 * several such numbers, a random one is taken.
 */
struct ExactMix
{
    const char* name;
    std::vector<Mix> minimal, one_more;
    Mix ten, hundred;
    /// Do the minimal sets have exact poses other than the one they were made with? (Further pairings leave
    /// only that one, but for coincidences.)
    bool several_poses;
    DirectionSign normals = DirectionSign::Oriented;
};

inline void PrintTo(const ExactMix& mix, std::ostream* out)
{
    *out << mix.name;
}

/** Unknowns are six. A point on a point takes 3 of them, on a line 2, on a plane 1, a line on a line 4, a
 * plane on a plane 3 (two planes only 5 together, two lines all 6, the rows being dependent). Two points
 * leave the turn about their axis, which one point on a plane stops at two places. Three points on lines, six
 * points on planes, and what has rows as few have up to 8, 40, ... poses. Free directions allow a half turn
 * wherever the positions do: two lines about their common perpendicular; a line and a point about the
 * perpendicular from that; a line and a plane, or two planes, about an axis through where they meet.
 */
inline const std::vector<ExactMix>& exact_mixes()
{
    constexpr auto Free = DirectionSign::Free;
    //  points on: points lines planes, lines, planes
    static const std::vector<ExactMix> mixes = {
        {"pp", {{3, 0, 0, 0, 0}}, {{4, 0, 0, 0, 0}}, {10, 0, 0, 0, 0}, {100, 0, 0, 0, 0}, false},
        {"pl", {{0, 3, 0, 0, 0}}, {{0, 4, 0, 0, 0}}, {0, 10, 0, 0, 0}, {0, 100, 0, 0, 0}, true},
        {"pn", {{0, 0, 6, 0, 0}}, {{0, 0, 7, 0, 0}}, {0, 0, 10, 0, 0}, {0, 0, 100, 0, 0}, true},
        {"ll", {{0, 0, 0, 2, 0}}, {{0, 0, 0, 3, 0}}, {0, 0, 0, 10, 0}, {0, 0, 0, 100, 0}, true},
        {"nn", {{0, 0, 0, 0, 3}}, {{0, 0, 0, 0, 4}}, {0, 0, 0, 0, 10}, {0, 0, 0, 0, 100}, false},
        {"nf", {{0, 0, 0, 0, 3}}, {{0, 0, 0, 0, 4}}, {0, 0, 0, 0, 10}, {0, 0, 0, 0, 100}, false, Free},
        {"pp_pn",
         {{2, 0, 1, 0, 0}, {1, 0, 3, 0, 0}},
         {{2, 0, 2, 0, 0}, {1, 0, 4, 0, 0}, {3, 0, 1, 0, 0}},
         {5, 0, 5, 0, 0},
         {50, 0, 50, 0, 0},
         true},
        {"pl_pn",
         {{0, 2, 2, 0, 0}, {0, 1, 4, 0, 0}},
         {{0, 2, 3, 0, 0}, {0, 1, 5, 0, 0}, {0, 3, 1, 0, 0}},
         {0, 5, 5, 0, 0},
         {0, 50, 50, 0, 0},
         true},
        {"pp_ll",
         {{1, 0, 0, 1, 0}},
         {{2, 0, 0, 1, 0}, {1, 0, 0, 2, 0}},
         {5, 0, 0, 5, 0},
         {50, 0, 0, 50, 0},
         true},
        {"pp_nn",
         {{1, 0, 0, 0, 2}, {2, 0, 0, 0, 1}},
         {{1, 0, 0, 0, 3}, {2, 0, 0, 0, 2}, {3, 0, 0, 0, 1}},
         {5, 0, 0, 0, 5},
         {50, 0, 0, 0, 50},
         false},
        {"ll_nf",
         {{0, 0, 0, 1, 1}},
         {{0, 0, 0, 2, 1}, {0, 0, 0, 1, 2}},
         {0, 0, 0, 5, 5},
         {0, 0, 0, 50, 50},
         true,
         Free},
        {"pl_ll_nf",
         {{0, 1, 0, 1, 1}},
         {{0, 2, 0, 1, 1}, {0, 1, 0, 2, 1}, {0, 1, 0, 1, 2}},
         {0, 4, 0, 3, 3},
         {0, 34, 0, 33, 33},
         false,
         Free},
        {"pn_nf",
         {{0, 0, 3, 0, 1}, {0, 0, 1, 0, 2}},
         {{0, 0, 4, 0, 1}, {0, 0, 2, 0, 2}, {0, 0, 1, 0, 3}},
         {0, 0, 5, 0, 5},
         {0, 0, 50, 0, 50},
         true,
         Free},
        {"all",
         {{1, 1, 1, 1, 1}},
         {{2, 1, 1, 1, 1}, {1, 1, 2, 1, 1}},
         {2, 2, 2, 2, 2},
         {20, 20, 20, 20, 20},
         false},
        {"all_free",
         {{1, 1, 1, 1, 1}},
         {{1, 2, 1, 1, 1}, {1, 1, 1, 1, 2}},
         {2, 2, 2, 2, 2},
         {20, 20, 20, 20, 20},
         false,
         Free}};
    return mixes;
}

/// Pairings without noise, and the pose they were made with.
struct ExactSet
{
    Pairings pairings;
    Matrix3d R = Matrix3d::Identity();
    Vector3d t = Vector3d::Zero();
    /// Spacing of the coordinates as numbers, m, where it is more than 1e-15 of the size of the set.
    double coarse = 0;
};

/// Calls `f(point, is_global)` with a reference to each position of both sides.
template <class F>
void for_each_position(Pairings& p, const F& f)
{
    const auto patch_at = [&f](mp2p_icp::plane_patch_t& patch, bool is_global)
    {
        f(patch.centroid, is_global);
        const auto& c = patch.plane.coefs;
        const auto& q = patch.centroid;
        patch.plane.coefs[3] = -(c[0] * q.x + c[1] * q.y + c[2] * q.z);
    };
    for (auto& x : p.paired_pt2pt)
    {
        mrpt::math::TPoint3D global(x.global), local(x.local);
        f(global, true), f(local, false);
        x.global = global, x.local = local;
    }
    for (auto& x : p.paired_pt2ln) f(x.ln_global.pBase, true), f(x.pt_local, false);
    for (auto& x : p.paired_pt2pl) patch_at(x.pl_global, true), f(x.pt_local, false);
    for (auto& x : p.paired_ln2ln) f(x.ln_global.pBase, true), f(x.ln_local.pBase, false);
    for (auto& x : p.paired_pl2pl) patch_at(x.p_global, true), patch_at(x.p_local, false);
}

inline void shift(ExactSet& set, const Vector3d& global, const Vector3d& local)
{
    for_each_position(set.pairings, [&](mrpt::math::TPoint3D& p, bool is_global)
                      { p += mp2p_icp::to_mrpt(is_global ? global : local); });
    set.t += global - set.R * local;
}

/// The largest distance of a position from its origin.
inline double largest_distance(Pairings p)
{
    double d = 0;
    for_each_position(p, [&d](const mrpt::math::TPoint3D& q, bool) { d = std::max(d, q.norm()); });
    return d;
}
inline double spacing_at(double x)
{
    return std::nextafter(x, std::numeric_limits<double>::infinity()) - x;
}

/// Positions to the nearest multiples of 2^-10 m, so that moving them by whole metres rounds nothing.
inline void round_to_grid(Pairings& p)
{
    const auto rounded = [](double x) { return std::ldexp(std::nearbyint(std::ldexp(x, 10)), -10); };
    for_each_position(p, [&](mrpt::math::TPoint3D& q, bool)
                      { q.x = rounded(q.x), q.y = rounded(q.y), q.z = rounded(q.z); });
}

/// Every other normal of the local side, turned round.
inline void flip_normals(Pairings& p)
{
    for (size_t i = 0; i < p.paired_pl2pl.size(); i += 2)
        for (double& c : p.paired_pl2pl[i].p_local.plane.coefs) c = -c;
}

inline Matrix3d half_turn(const Vector3d& axis)
{
    return 2 * axis * axis.transpose() - Matrix3d::Identity();
}

/// Any rotation; exact half turns about x, y, z and any axis; half turns short of 1e-3 to 1e-9 rad.
inline Matrix3d rotation_of_kind(size_t kind, SeededRandom& random)
{
    const Vector3d axis = random_direction(random);
    const double short_of = std::pow(10, random.uniform(-9, -3));
    if (kind % 6 < 3) return half_turn(Vector3d::Unit(static_cast<int>(kind % 6)));
    if (kind % 6 == 3) return half_turn(axis);
    return kind % 6 == 4 ? rotation_about(axis, M_PI - short_of) : any_rotation(random);
}

/// How large the set is, and where.
enum class Place : uint8_t
{
    Room,     ///< a cube of 50 m
    Thing,    ///< of 0.1 m, all lengths being those of a room divided by 512
    FarThing  ///< the same at tens of metres, where coordinates are rounded to 1e-13 of its size
};

/// In the cube from the local origin to (1, 1, 1) times its side.
inline ExactSet exact_set(const Mix& mix, DirectionSign normals, const Matrix3d& R, Place place,
                          SeededRandom& random)
{
    constexpr double SCALE = 1.0 / 512;  // a power of two: nothing is rounded
    ExactSet out;
    out.R = R, out.t = random_point(random, 40);
    out.pairings = random_pairings(mix, R, out.t, random, 0, 25);
    if (normals == DirectionSign::Free) flip_normals(out.pairings);
    shift(out, Vector3d::Zero(), {25, 25, 25});
    if (place == Place::Room) return out;
    for_each_position(out.pairings, [](mrpt::math::TPoint3D& p, bool) { p *= SCALE; });
    out.t *= SCALE;
    if (place == Place::Thing) return out;
    shift(out, random_point(random, 40), Vector3d::Zero());
    out.coarse = spacing_at(largest_distance(out.pairings));
    return out;
}

// ---- What the pairings say, written a second time
// ----------------------------------------------------------

/// The residual of one position or direction, up to 3 numbers, and its Jacobian by (v, omega L): v moves the
/// centre, omega turns about it.
struct Rows
{
    Vector3d r = Vector3d::Zero();
    Eigen::Matrix<double, 3, 6> J = Eigen::Matrix<double, 3, 6>::Zero();
    bool is_direction = false;
};

/// The local positions' centroid and rms distance from it.
struct Spread
{
    Vector3d centre = Vector3d::Zero();
    double L = 0;
};

inline Spread spread_of(const std::vector<Vector3d>& points)
{
    Spread s;
    const double n = static_cast<double>(points.size());
    for (const auto& p : points) s.centre += p / n;
    for (const auto& p : points) s.L += (p - s.centre).squaredNorm() / n;
    s.L = std::sqrt(s.L);
    return s;
}
inline std::vector<Vector3d> positions(Pairings p, bool of_global)
{
    std::vector<Vector3d> out;
    for_each_position(p,
                      [&](const mrpt::math::TPoint3D& q, bool is_global)
                      {
                          if (is_global == of_global) out.push_back(mp2p_icp::to_eigen(q));
                      });
    return out;
}
inline Spread spread_of(const Pairings& p)
{
    return spread_of(positions(p, false));
}
inline Vector3d global_centre(const Pairings& p)
{
    return spread_of(positions(p, true)).centre;
}
/// Without lines and planes of the local side.
inline std::vector<Vector3d> local_points(Pairings p)
{
    p.paired_ln2ln.clear(), p.paired_pl2pl.clear();
    return positions(p, false);
}

inline Matrix3d cross_matrix(const Vector3d& v)
{
    Matrix3d M;
    M << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
    return M;
}

/// Makes the rows of all pairings at a pose.
class RowMaker
{
 public:
    RowMaker(const Pairings& p, DirectionSign normals, const Matrix3d& R, const Vector3d& t)
        : spread_(spread_of(p)), R_(R), t_(t)
    {
        const Matrix3d I = Matrix3d::Identity();
        for (const auto& x : p.paired_pt2pt)
            position(I, mrpt::math::TPoint3D(x.global), mrpt::math::TPoint3D(x.local), 3);
        for (const auto& x : p.paired_pt2ln)
            position(across(director(x.ln_global)), x.ln_global.pBase, x.pt_local, 2);
        for (const auto& x : p.paired_pt2pl)
            position(I - across(normal(x.pl_global)), x.pl_global.centroid, x.pt_local, 1);
        for (const auto& x : p.paired_ln2ln)
        {
            position(across(director(x.ln_global)), x.ln_global.pBase, x.ln_local.pBase, 2);
            direction(director(x.ln_global), director(x.ln_local), DirectionSign::Free);
        }
        for (const auto& x : p.paired_pl2pl)
        {
            position(I - across(normal(x.p_global)), x.p_global.centroid, x.p_local.centroid, 1);
            direction(normal(x.p_global), normal(x.p_local), normals);
        }
    }
    const std::vector<Rows>& rows() const { return rows_; }
    const Spread& spread() const { return spread_; }
    /// How many independent numbers.
    double count() const { return count_; }

 private:
    static Vector3d director(const mrpt::math::TLine3D& l)
    {
        return mp2p_icp::to_eigen(mrpt::math::TPoint3D(l.director)).normalized();
    }
    static Vector3d normal(const mp2p_icp::plane_patch_t& p)
    {
        return Vector3d(p.plane.coefs[0], p.plane.coefs[1], p.plane.coefs[2]).normalized();
    }
    static Matrix3d across(const Vector3d& u) { return Matrix3d::Identity() - u * u.transpose(); }

    void position(const Matrix3d& C, const mrpt::math::TPoint3D& global, const mrpt::math::TPoint3D& local,
                  int count)
    {
        const Vector3d p = mp2p_icp::to_eigen(local), lever = R_ * (p - spread_.centre);
        Rows rows;
        rows.r = C * (R_ * p + t_ - mp2p_icp::to_eigen(global));
        rows.J << C, -C * cross_matrix(lever) / spread_.L;
        rows_.push_back(rows), count_ += count;
    }
    void direction(const Vector3d& global, const Vector3d& local, DirectionSign sign)
    {
        const bool is_free = sign == DirectionSign::Free;
        const Matrix3d C = is_free ? across(global) : Matrix3d::Identity();
        Rows rows;
        rows.r = C * (R_ * local - (is_free ? Vector3d::Zero() : global));
        rows.J.rightCols<3>() = -C * cross_matrix(R_ * local) / spread_.L;
        rows.is_direction = true;
        rows_.push_back(rows), count_ += 2;
    }

    Spread spread_;
    Matrix3d R_;
    Vector3d t_;
    std::vector<Rows> rows_;
    double count_ = 0;
};

/// The smallest eigenvalue of J' W J over the largest, directions weighing as PairWeights says: L^2 of the
/// points, 1 m^2 without.
inline double information_ratio(const Pairings& p, DirectionSign normals, const Matrix3d& R,
                                const Vector3d& t)
{
    const RowMaker made(p, normals, R, t);
    const auto points = local_points(p);
    const double w = points.size() < 2 ? 1.0 : std::pow(spread_of(points).L, 2);
    Eigen::Matrix<double, 6, 6> H = Eigen::Matrix<double, 6, 6>::Zero();
    for (const auto& x : made.rows()) H += (x.is_direction ? w : 1.0) * x.J.transpose() * x.J;
    const Eigen::Matrix<double, 6, 1> values =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>>(H, Eigen::EigenvaluesOnly).eigenvalues();
    return std::max(0.0, values(0) / values(5));
}

/// The root of the mean square of the residuals of all rows, m, directions as what they do at the distance L:
/// 0 where the pose is exact.
inline double root_mean_square(const Pairings& p, DirectionSign normals, const Matrix3d& R, const Vector3d& t)
{
    const RowMaker made(p, normals, R, t);
    double sum = 0;
    for (const auto& x : made.rows())
        sum += x.r.squaredNorm() * (x.is_direction ? std::pow(made.spread().L, 2) : 1.0);
    return std::sqrt(sum / made.count());
}
}  // namespace mp2p_icp_test
