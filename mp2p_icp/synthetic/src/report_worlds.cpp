#include <mp2p_icp/se3.h>
#include <mp2p_icp/synthetic/report_worlds.h>

#include <cmath>

namespace mp2p_icp::synthetic
{
using Eigen::Matrix3d;
using Eigen::Vector3d;
using mrpt::poses::CPose3D;

namespace
{
// Numbers are drawn one statement at a time: the order of a call's arguments is the compiler's choice.
Vector3d gaussian_vector(SeededRandom& random, double sigma)
{
    const double x = random.gaussian(sigma), y = random.gaussian(sigma);
    return {x, y, random.gaussian(sigma)};
}
Vector3d in_cube(SeededRandom& random, double half_side)
{
    const double x = random.uniform(-half_side, half_side), y = random.uniform(-half_side, half_side);
    return {x, y, random.uniform(-half_side, half_side)};
}
Vector3d in_report_cube(SeededRandom& random)
{
    return in_cube(random, REPORT_CUBE / 2) + Vector3d::Constant(REPORT_CUBE / 2);
}
Vector3d any_direction(SeededRandom& random)
{
    return gaussian_vector(random, 1).normalized();
}
Matrix3d any_rotation(SeededRandom& random)
{
    const double w = random.gaussian();
    const Vector3d v = gaussian_vector(random, 1);
    return Eigen::Quaterniond(w, v.x(), v.y(), v.z()).normalized().toRotationMatrix();
}
Vector3d turned(const Vector3d& direction, double sigma, SeededRandom& random)
{
    const Vector3d axis = any_direction(random);
    return Eigen::AngleAxisd(random.gaussian(sigma), axis) * direction;
}

void add_point(Pairings& p, const Vector3d& global, const Vector3d& local)
{
    const auto index = static_cast<uint32_t>(p.paired_pt2pt.size());
    p.paired_pt2pt.push_back(mrpt::tfest::TMatchingPair_d(index, index, to_mrpt(global), to_mrpt(local)));
}
plane_patch_t patch(const Vector3d& centroid, const Vector3d& normal)
{
    plane_patch_t p;
    for (int i = 0; i < 3; i++) p.plane.coefs[i] = normal(i);
    p.plane.coefs[3] = -normal.dot(centroid), p.centroid = to_mrpt(centroid);
    return p;
}
mrpt::math::TLine3D line(const Vector3d& base, const Vector3d& direction)
{
    mrpt::math::TLine3D l;
    l.pBase = to_mrpt(base), l.director = to_mrpt(direction);
    return l;
}

/// A place and a direction: of the local frame, of the global one, and there with noise.
struct Oriented
{
    Vector3d local, global, noisy, local_direction, global_direction, noisy_direction;
};
Oriented oriented(const ReportWorld& world, const ReportNoise& noise, SeededRandom& random)
{
    Oriented o;
    o.local = in_report_cube(random), o.local_direction = any_direction(random);
    o.global = world.R * o.local + world.t, o.global_direction = world.R * o.local_direction;
    o.noisy_direction = turned(o.global_direction, noise.normals, random);
    o.noisy = o.global + gaussian_vector(random, noise.points);
    return o;
}
}  // namespace

CPose3D ReportWorld::truth() const
{
    return make_pose(R, t);
}

ReportWorld report_world(size_t points, size_t planes, const ReportNoise& noise, SeededRandom& random,
                         size_t lines)
{
    ReportWorld world;
    world.R = any_rotation(random), world.t = in_cube(random, REPORT_CUBE);
    for (size_t i = 0; i < points; i++)
    {
        const Vector3d local = in_report_cube(random), global = world.R * local + world.t;
        add_point(world.exact, global, local);
        add_point(world.pairings, global + gaussian_vector(random, noise.points), local);
    }
    for (size_t i = 0; i < planes; i++)
    {
        const Oriented o = oriented(world, noise, random);
        const plane_patch_t local = patch(o.local, o.local_direction);
        world.exact.paired_pl2pl.push_back({patch(o.global, o.global_direction), local});
        world.pairings.paired_pl2pl.push_back({patch(o.noisy, o.noisy_direction), local});
    }
    for (size_t i = 0; i < lines; i++)
    {
        const Oriented o = oriented(world, noise, random);
        const mrpt::math::TLine3D local = line(o.local, o.local_direction);
        world.exact.paired_ln2ln.push_back({line(o.global, o.global_direction), local});
        world.pairings.paired_ln2ln.push_back({line(o.noisy, o.noisy_direction), local});
    }
    return world;
}

void add_outliers(ReportWorld& world, double ratio, SeededRandom& random, double least_displacement)
{
    auto& pairs = world.pairings.paired_pt2pt;
    const auto count = static_cast<size_t>(std::lround(ratio * static_cast<double>(pairs.size())));
    world.outliers = random_subset(pairs.size(), count, random());
    for (const size_t i : world.outliers)
    {
        const Vector3d right = to_eigen(mrpt::math::TPoint3D(world.exact.paired_pt2pt[i].global));
        Vector3d global;
        do global = world.R * in_report_cube(random) + world.t;
        while ((global - right).norm() < least_displacement);
        pairs[i].global = to_mrpt(global);
    }
}

PairWeights maximum_likelihood_weights(const ReportNoise& noise, bool offsets)
{
    PairWeights w;
    w.pt2pt = 1 / (noise.points * noise.points);
    w.pl2pl = w.ln2ln = offsets ? w.pt2pt : 0.0;
    if (noise.normals > 0) w.pl2pl_direction = w.ln2ln_direction = 3 / (noise.normals * noise.normals);
    return w;
}

PoseError error_of(const CPose3D& pose, const ReportWorld& world)
{
    return {rotation_angle(rotation_of(pose).transpose() * world.R), (translation_of(pose) - world.t).norm()};
}

}  // namespace mp2p_icp::synthetic
