#pragma once

#include "make_primitives.h"

namespace mp2p_icp_test
{
/// How many pairings of each kind.
struct Mix
{
    size_t pt2pt, pt2ln, pt2pl, ln2ln, pl2pl;
};

inline Vector3d gaussian_vector(SeededRandom& random)
{
    const double x = random.gaussian(), y = random.gaussian();
    return {x, y, random.gaussian()};
}

/** Pairings in a cube of half side `size` that the pose (R, t) fits, but for Gaussian noise on the local
 * side: `noise` m on positions, noise / size rad on directions. Directors of lines have any length and either
 * sign.
 */
inline Pairings random_pairings(const Mix& mix, const Matrix3d& R, const Vector3d& t, SeededRandom& random,
                                double noise = 0, double size = 5)
{
    using mp2p_icp::to_mrpt;
    const auto local_point = [&](const Vector3d& global) -> Vector3d
    { return R.transpose() * (global - t) + noise * gaussian_vector(random); };
    const auto local_direction = [&](const Vector3d& global) -> Vector3d
    { return (R.transpose() * global + noise / size * gaussian_vector(random)).normalized(); };
    const auto on_plane = [&](const Vector3d& q, const Vector3d& n) -> Vector3d
    {
        const Vector3d d = random_point(random, size / 2);
        return q + d - n * n.dot(d);
    };
    Pairings p;
    for (size_t i = 0; i < mix.pt2pt; i++)
    {
        const Vector3d q = R * random_point(random, size) + t;
        add_pair(p, q, local_point(q));
    }
    for (size_t i = 0; i < mix.pt2ln; i++)
    {
        const Vector3d q = R * random_point(random, size) + t, u = random_direction(random);
        p.paired_pt2ln.push_back({line(q, 3 * u), to_mrpt(local_point(q + random.uniform(-3, 3) * u))});
    }
    for (size_t i = 0; i < mix.pt2pl; i++)
    {
        const Vector3d q = R * random_point(random, size) + t, n = random_direction(random);
        p.paired_pt2pl.push_back({patch(q, n), to_mrpt(local_point(on_plane(q, n)))});
    }
    for (size_t i = 0; i < mix.ln2ln; i++)
    {
        const Vector3d q = R * random_point(random, size) + t, u = random_direction(random);
        const Vector3d local_u = (i % 2 ? 0.5 : -2.0) * local_direction(u);
        p.paired_ln2ln.push_back({line(q, u), line(local_point(q + random.uniform(-3, 3) * u), local_u)});
    }
    for (size_t i = 0; i < mix.pl2pl; i++)
    {
        const Vector3d q = R * random_point(random, size) + t, n = random_direction(random);
        p.paired_pl2pl.push_back({patch(q, n), patch(local_point(on_plane(q, n)), local_direction(n))});
    }
    return p;
}
}  // namespace mp2p_icp_test
