#pragma once

#include <mp2p_icp/errorTerms.h>
#include <mp2p_icp/optimal_tf_certified.h>
#include <mp2p_icp/optimal_tf_gauss_newton.h>
#include <mp2p_icp/optimal_tf_horn.h>
#include <mp2p_icp/optimal_tf_olae.h>

#include <algorithm>
#include <functional>
#include <string>

#include "random_pairings.h"

/** \file Sets of pairings of which theory knows what they leave free, the solvers that must find that out,
 * and what is asked of their results.
 */
namespace mp2p_icp_test
{
using mp2p_icp::DirectionSign;
using mp2p_icp::FreeTwist;
using mp2p_icp::make_pose;
using mp2p_icp::OptimalTF_Result;
using mp2p_icp::PairWeights;
using mp2p_icp::rotation_of;
using mp2p_icp::SolveStatus;
using mp2p_icp::to_eigen;
using mp2p_icp::to_mrpt;
using mp2p_icp::translation_of;
using Guess = std::optional<CPose3D>;

inline Vector3d vector_of(const mrpt::math::TVector3D& v)
{
    return {v.x, v.y, v.z};
}
inline Vector3d transformed(const CPose3D& pose, const Vector3d& p)
{
    return rotation_of(pose) * p + translation_of(pose);
}
/// The vector of a rotation, of length pi at most.
inline Vector3d rotation_vector(const Matrix3d& R)
{
    const Eigen::AngleAxisd turn{Eigen::Quaterniond(R)};
    return (turn.angle() > M_PI ? turn.angle() - 2 * M_PI : turn.angle()) * turn.axis();
}
/// From one pose to the other.
inline Vector3d rotation_between(const CPose3D& from, const CPose3D& to)
{
    return rotation_vector(rotation_of(to) * rotation_of(from).transpose());
}

// ---- Sets -----------------------------------------------------------------------------------------------

/** Pairings that one pose fits, described in a frame of their own that stands anywhere in the global one.
 * Primitives of the two sides are not the same but lie on each other: base points and centroids are elsewhere
 * on the line or plane, directors have another length and, where directions have no sign, perhaps the other
 * one.
 */
struct FittingSet
{
    Pairings pairings;
    CPose3D in_global, truth;  ///< the frame of the description; of local with respect to global
    double size = 3, noise = 0;
    PairWeights signs;  ///< only those
    SeededRandom random;

    explicit FittingSet(uint64_t seed, double far = 20) : random(seed)
    {
        in_global = make_pose(any_rotation(random), random_point(random, far));
        truth = make_pose(any_rotation(random), random_point(random, far));
    }

    Vector3d global(const Vector3d& p) const { return transformed(in_global, p); }
    Vector3d global_direction(const Vector3d& u) const { return rotation_of(in_global) * u.normalized(); }
    /// With noise, m.
    Vector3d local(const Vector3d& p)
    {
        return rotation_of(truth).transpose() * (global(p) - translation_of(truth)) +
               noise * gaussian_vector(random);
    }
    /// With noise: as many rad as of a point at the distance `size`.
    Vector3d local_direction(const Vector3d& u, DirectionSign sign)
    {
        const Vector3d exact = rotation_of(truth).transpose() * global_direction(u);
        const bool reversed = sign == DirectionSign::Free && random.index(2) == 0;
        return (reversed ? -1 : 1) * (exact + noise / size * gaussian_vector(random)).normalized();
    }
    Vector3d anywhere() { return random_point(random, size); }
    Vector3d within_plane(const Vector3d& n)
    {
        const Vector3d d = anywhere();
        return d - n * n.dot(d) / n.squaredNorm();
    }

    void point(const Vector3d& p) { add_pair(pairings, global(p), local(p)); }
    void point_on_line(const Vector3d& p, const Vector3d& u)
    {
        const Vector3d base = p + random.uniform(-size, size) * u.normalized();
        pairings.paired_pt2ln.push_back(
            {mp2p_icp_test::line(global(base), 3 * global_direction(u)), to_mrpt(local(p))});
    }
    void point_on_plane(const Vector3d& p, const Vector3d& n)
    {
        pairings.paired_pt2pl.push_back(
            {patch(global(p + within_plane(n)), global_direction(n)), to_mrpt(local(p))});
    }
    void line(const Vector3d& q, const Vector3d& u)
    {
        const Vector3d base = local(q + random.uniform(-size, size) * u.normalized());
        pairings.paired_ln2ln.push_back(
            {mp2p_icp_test::line(global(q), global_direction(u)),
             mp2p_icp_test::line(base, 2 * local_direction(u, signs.ln2ln_sign))});
    }
    void plane(const Vector3d& q, const Vector3d& n)
    {
        const Vector3d centroid = local(q + within_plane(n));
        pairings.paired_pl2pl.push_back(
            {patch(global(q), global_direction(n)), patch(centroid, local_direction(n, signs.pl2pl_sign))});
    }
};

/// The mean of all local positions, each of the same weight.
inline Vector3d local_centroid(const Pairings& in)
{
    Vector3d sum = Vector3d::Zero();
    for (const auto& p : in.paired_pt2pt) sum += to_eigen(mrpt::math::TPoint3D(p.local));
    for (const auto& p : in.paired_pt2ln) sum += to_eigen(p.pt_local);
    for (const auto& p : in.paired_pt2pl) sum += to_eigen(p.pt_local);
    for (const auto& p : in.paired_ln2ln) sum += to_eigen(p.ln_local.pBase);
    for (const auto& p : in.paired_pl2pl) sum += to_eigen(p.p_local.centroid);
    return sum / static_cast<double>(in.size());
}

/// Residuals of all pairings, in m: directions as chords, 1 rad being the set's size.
inline Eigen::VectorXd residuals(const FittingSet& s, const CPose3D& pose)
{
    std::vector<double> all;
    const auto append = [&all](const auto& v, double factor)
    {
        for (int i = 0; i < 3; i++) all.push_back(factor * v[i]);
    };
    const auto append_directions = [&](const Vector3d& global, const Vector3d& local, DirectionSign sign)
    {
        const Vector3d g = global.normalized(), l = rotation_of(pose) * local.normalized();
        append(Vector3d((sign == DirectionSign::Free && g.dot(l) < 0 ? -l : l) - g), s.size);
    };
    const auto normal = [](const mp2p_icp::plane_patch_t& p)
    { return Vector3d(p.plane.coefs[0], p.plane.coefs[1], p.plane.coefs[2]); };
    const Pairings& in = s.pairings;
    for (const auto& p : in.paired_pt2pt) append(mp2p_icp::error_point2point(p, pose), 1);
    for (const auto& p : in.paired_pt2ln) append(mp2p_icp::error_point2line(p, pose), 1);
    for (const auto& p : in.paired_pt2pl) append(mp2p_icp::error_point2plane(p, pose), 1);
    for (const auto& p : in.paired_ln2ln)
    {
        append(mp2p_icp::error_point2line({p.ln_global, p.ln_local.pBase}, pose), 1);
        append_directions(to_eigen(p.ln_global.director), to_eigen(p.ln_local.director), s.signs.ln2ln_sign);
    }
    for (const auto& p : in.paired_pl2pl)
    {
        append(mp2p_icp::error_point2plane({p.p_global, p.p_local.centroid}, pose), 1);
        append_directions(normal(p.p_global), normal(p.p_local), s.signs.pl2pl_sign);
    }
    return Eigen::Map<Eigen::VectorXd>(all.data(), static_cast<Eigen::Index>(all.size()));
}
/// m.
inline double residual_rms(const FittingSet& s, const CPose3D& pose)
{
    return residuals(s, pose).norm() / std::sqrt(static_cast<double>(s.pairings.size()));
}

// ---- Motions --------------------------------------------------------------------------------------------

/// A motion that a set leaves free.
struct Motion
{
    FreeTwist::Kind kind;
    Vector3d axis, through = Vector3d::Zero();
};
inline Motion slide(const Vector3d& along)
{
    return {FreeTwist::Kind::Translation, along.normalized()};
}
inline Motion turn(const Vector3d& axis, const Vector3d& through)
{
    return {FreeTwist::Kind::Rotation, axis.normalized(), through};
}
inline Motion screw(const Vector3d& axis, const Vector3d& through)
{
    return {FreeTwist::Kind::Screw, axis.normalized(), through};
}
inline std::vector<Motion> turns_about(const Vector3d& point)
{
    return {turn(Vector3d::UnitX(), point), turn(Vector3d::UnitY(), point), turn(Vector3d::UnitZ(), point)};
}
inline Motion as_motion(const FreeTwist& f)
{
    return {f.kind, vector_of(f.axis), to_eigen(f.through)};
}

/// The pose after `angle` rad about an axis and `advance` m along it.
inline CPose3D moved_about(const CPose3D& pose, const Vector3d& axis, const Vector3d& through, double angle,
                           double advance)
{
    const Matrix3d turned = rotation_about(axis, angle);
    return make_pose(turned * rotation_of(pose),
                     turned * (translation_of(pose) - through) + through + advance * axis.normalized());
}

/// What a motion repeats: in the global frame, `angle` rad about an axis and `advance` m along it.
struct Path
{
    Vector3d axis, through;
    double angle, advance;

    CPose3D from(const CPose3D& pose, double amount) const
    {
        return moved_about(pose, axis, through, amount * angle, amount * advance);
    }
    /// The velocity of `centre`, and the angular velocity in units of 1 / L.
    Eigen::Matrix<double, 6, 1> twist(const Vector3d& centre, double L) const
    {
        Eigen::Matrix<double, 6, 1> out;
        out << angle * axis.cross(centre - through) + advance * axis, L * angle * axis;
        return out;
    }
};

/// How residuals change along it.
inline Eigen::VectorXd slope_along(const FittingSet& s, const CPose3D& pose, const Path& path)
{
    const double h = 1e-5;
    return (residuals(s, path.from(pose, h)) - residuals(s, path.from(pose, -h))) / (2 * h);
}

/** The path of a motion (global frame), of 1 m at a distance of the set's size. A FreeTwist does not tell the
 * advance of a screw: it is the one that changes the residuals least.
 */
inline Path path_of(const FittingSet& s, const CPose3D& pose, const Motion& m)
{
    Path path{m.axis, m.through, 1 / s.size, 0};
    if (m.kind == FreeTwist::Kind::Translation) path.angle = 0, path.advance = 1;
    if (m.kind != FreeTwist::Kind::Screw) return path;
    const Eigen::VectorXd turning = slope_along(s, pose, path),
                          sliding = slope_along(s, pose, {m.axis, m.through, 0, 1});
    path.advance = -turning.dot(sliding) / sliding.squaredNorm();
    return path;
}

/// What a kind of sets leaves free, by theory.
struct KnownSet
{
    std::string name;
    int rank;
    /// All 6 - rank motions in the frame of the description, at the true pose; none where only their number
    /// is known.
    std::vector<Motion> free;
    std::function<void(FittingSet&)> build;
};
inline void PrintTo(const KnownSet& known, std::ostream* os)
{
    *os << known.name;
}

// ---- Solvers --------------------------------------------------------------------------------------------

struct NamedSolver
{
    std::string name;
    /// Does it go down from the guess? (The others look at the whole group.)
    bool descends;
    std::function<bool(const FittingSet&, const Guess&, OptimalTF_Result&)> solve;
};
inline void PrintTo(const NamedSolver& solver, std::ostream* os)
{
    *os << solver.name;
}

inline mp2p_icp::WeightParameters weights_of(const FittingSet& s)
{
    mp2p_icp::WeightParameters wp;
    wp.pair_weights = s.signs;
    return wp;
}
inline NamedSolver horn_solver()
{
    return {"Horn", false, [](const FittingSet& s, const Guess& guess, OptimalTF_Result& out) {
                return mp2p_icp::optimal_tf_horn(s.pairings, weights_of(s), out, guess);
            }};
}
inline NamedSolver olae_solver(const char* name, mp2p_icp::OlaeSystem system, bool normalize)
{
    mp2p_icp::OlaeParameters p;
    p.system = system, p.normalize_points = normalize;
    return {name, false, [p](const FittingSet& s, const Guess& guess, OptimalTF_Result& out) {
                return mp2p_icp::optimal_tf_olae(s.pairings, weights_of(s), out, guess, p);
            }};
}
inline NamedSolver certified_solver()
{
    return {"Certified", false,
            [](const FittingSet& s, const Guess& guess, OptimalTF_Result& out)
            {
                mp2p_icp::CertifiedParameters p;
                p.weights = weights_of(s), p.guess = guess;
                mp2p_icp::CertifiedResult result;
                result.optimalPose = out.optimalPose;
                const bool solved = mp2p_icp::optimal_tf_certified(s.pairings, result, p);
                out = result;
                return solved;
            }};
}
/// With steps enough for full precision.
inline NamedSolver gauss_newton_solver()
{
    return {"GaussNewton", true,
            [](const FittingSet& s, const Guess& guess, OptimalTF_Result& out)
            {
                mp2p_icp::OptimalTF_GN_Parameters p;
                p.linearizationPoint = guess, p.maxInnerLoopIterations = 200, p.minDelta = 1e-13;
                p.pairWeights = s.signs;
                return mp2p_icp::optimal_tf_gauss_newton(s.pairings, out, p);
            }};
}
inline std::vector<NamedSolver> closed_forms()
{
    using mp2p_icp::OlaeSystem;
    return {horn_solver(),
            olae_solver("OlaeReport", OlaeSystem::Report, true),
            olae_solver("OlaeLeastSquares", OlaeSystem::LeastSquares, true),
            olae_solver("OlaeNewton", OlaeSystem::Newton, true),
            olae_solver("OlaeWithLengths", OlaeSystem::Report, false),
            certified_solver()};
}
inline std::vector<NamedSolver> all_solvers()
{
    auto all = closed_forms();
    all.push_back(gauss_newton_solver());
    return all;
}

// ---- What is asked of results ---------------------------------------------------------------------------

/// Rank and status, and free motions that are as many, independent, and change no residual (by more than 1e-3
/// of what other motions do: a screw of so small an advance is called a rotation).
inline void expect_described(const FittingSet& s, const OptimalTF_Result& r, int rank)
{
    EXPECT_EQ(r.rank, rank);
    EXPECT_EQ(r.status, rank == 6 ? SolveStatus::Determined : SolveStatus::UnderConstrained);
    ASSERT_EQ(r.free.size(), static_cast<size_t>(6 - rank));
    if (r.free.empty()) return;
    const Vector3d centre = transformed(r.optimalPose, local_centroid(s.pairings));
    Eigen::Matrix<double, 6, Eigen::Dynamic> twists(6, r.free.size());
    for (size_t i = 0; i < r.free.size(); i++)
    {
        EXPECT_NEAR(vector_of(r.free[i].axis).norm(), 1, 1e-12);
        EXPECT_GT(r.free[i].sigma, 0);
        const Path path = path_of(s, r.optimalPose, as_motion(r.free[i]));
        EXPECT_LT(slope_along(s, r.optimalPose, path).norm(),
                  1e-3 * std::sqrt(static_cast<double>(s.pairings.size())))
            << to_string(r.free[i].kind) << " " << i;
        twists.col(static_cast<Eigen::Index>(i)) = path.twist(centre, s.size).normalized();
    }
    EXPECT_GT(Eigen::JacobiSVD<Eigen::MatrixXd>(twists).singularValues().tail<1>()(0), 0.05);
}

/// The motions of theory are combinations of those found, and of the same kinds.
inline void expect_known_motions(const FittingSet& s, const OptimalTF_Result& r,
                                 const std::vector<Motion>& known, double tolerance)
{
    ASSERT_EQ(r.free.size(), known.size());
    const Vector3d centre = transformed(r.optimalPose, local_centroid(s.pairings));
    Eigen::Matrix<double, 6, Eigen::Dynamic> twists(6, r.free.size());
    for (size_t i = 0; i < r.free.size(); i++)
        twists.col(static_cast<Eigen::Index>(i)) =
            path_of(s, r.optimalPose, as_motion(r.free[i])).twist(centre, s.size);
    const auto solver = twists.colPivHouseholderQr();
    int kinds[3] = {0, 0, 0};
    for (const auto& f : r.free) kinds[static_cast<size_t>(f.kind)]++;
    for (const auto& m : known)
    {
        kinds[static_cast<size_t>(m.kind)]--;
        const Motion in_global{m.kind, s.global_direction(m.axis), s.global(m.through)};
        const auto twist = path_of(s, s.truth, in_global).twist(centre, s.size).normalized().eval();
        EXPECT_LT((twists * solver.solve(twist) - twist).norm(), tolerance) << to_string(m.kind);
    }
    for (const int surplus : kinds) EXPECT_EQ(surplus, 0) << "translations, rotations, screws";
}

/** Along what is free, the guess is kept: no part of the turn from the guess's rotation is about a free axis,
 * which makes the rotation the nearest one of all that are as good; and the mean of the local positions has
 * not moved along what is free for it.
 */
inline void expect_kept_rotation(const OptimalTF_Result& r, const CPose3D& guess, double tolerance)
{
    const Vector3d turned = rotation_between(guess, r.optimalPose);
    for (const auto& f : r.free)
    {
        if (f.kind == FreeTwist::Kind::Translation) continue;
        EXPECT_LT(std::abs(vector_of(f.axis).dot(turned)), tolerance) << to_string(f.kind);
    }
}
inline void expect_kept_centroid(const FittingSet& s, const OptimalTF_Result& r, const CPose3D& guess,
                                 double tolerance)
{
    const Vector3d c = local_centroid(s.pairings),
                   moved = transformed(r.optimalPose, c) - transformed(guess, c);
    for (const auto& f : r.free)
    {
        if (f.kind != FreeTwist::Kind::Translation) continue;
        EXPECT_LT(std::abs(vector_of(f.axis).dot(moved)), tolerance);
    }
}

/// The same by trying: where a free motion can be followed for long, no pose along it is nearer in rotation.
inline void expect_nothing_nearer(const FittingSet& s, const OptimalTF_Result& r, const CPose3D& guess)
{
    const double angle = rotation_between(guess, r.optimalPose).norm();
    for (const auto& f : r.free)
        for (const double amount : {1e-3, -1e-3, 0.1, -0.1, 0.5, -0.5, 1.5, -1.5, 2.5, -2.5})
        {
            const Path path = path_of(s, r.optimalPose, as_motion(f));
            if (path.angle == 0) continue;
            const CPose3D there = path.from(r.optimalPose, amount / path.angle);
            if (residual_rms(s, there) > residual_rms(s, r.optimalPose) + 1e-9 * s.size) continue;
            EXPECT_GT(rotation_between(guess, there).norm(), angle - 1e-7) << amount << " rad";
        }
}

inline void expect_finite(const CPose3D& pose)
{
    EXPECT_TRUE(mp2p_icp::is_finite(pose)) << pose.asString();
}
}  // namespace mp2p_icp_test
