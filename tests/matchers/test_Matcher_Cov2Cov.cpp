// Generalized ICP: pairs of points with the weights that both clouds' planes give them.
#include <mp2p_icp/Matcher_Cov2Cov.h>
#include <mp2p_icp/Solver_GaussNewton.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/synthetic/random_pose.h>
#include <mp2p_icp/synthetic/scans.h>
#include <mp2p_icp/synthetic/worlds.h>

#include <cmath>

#include "../icp/icp_test_tools.h"
#include "expect_problem.h"
#include "surface_test_tools.h"
#include "with_threads.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;
using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace
{
/// A grid of points on the plane through `at` with this normal, 3 m across.
Cloud plane(const Vector3d& normal, const Vector3d& at)
{
    Cloud c;
    const Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
    for (int i = -15; i <= 15; i++)
        for (int j = -15; j <= 15; j++) c.push_back(to_point(at + 0.1 * i * u + 0.1 * j * v));
    return c;
}

metric_map_t map_with(const Cloud& cloud)
{
    auto points = mrpt::maps::CSimplePointsMap::Create();
    for (const auto& p : cloud) points->insertPoint(p.x, p.y, p.z);
    return map_of(points);
}

/// All pairings' weighted squares at a pose.
double cost(const Pairings& p, const CPose3D& pose)
{
    const auto weights = expanded_weights(p.pt2pl_weights, p.paired_pt2pl.size());
    double sum = 0;
    for (size_t i = 0; i < weights.size(); i++)
    {
        const auto& c = p.paired_pt2pl[i].pl_global.plane.coefs;
        const Vector3d at = rotation_of(pose) * to_eigen(p.paired_pt2pl[i].pt_local) + translation_of(pose);
        sum += weights[i] * std::pow(Vector3d(c[0], c[1], c[2]).dot(at) + c[3], 2);
    }
    return sum;
}

Matrix3d covariance(const Vector3d& n, double epsilon)
{
    return Matrix3d::Identity() - (1 - epsilon) * n * n.transpose();
}
}  // namespace

TEST(Cov2Cov, ThePairingsSumUpToTheCostOfThePaper)
{
    SeededRandom random(41);
    for (int round = 0; round < 20; round++)
    {
        const double epsilon = round % 2 ? 1e-3 : 0.1;
        const Vector3d n_global = random_unit(random), n_local = random_unit(random), at(1, -2, 0.5);
        const metric_map_t global = map_with(plane(n_global, at));
        Cloud around = plane(n_local, {0, 0, 0});
        const metric_map_t local_plane = map_with(around);
        const Matrix3d R = Eigen::AngleAxisd(random.uniform(0, M_PI), random_unit(random)).toRotationMatrix();
        const CPose3D pose = make_pose(R, at);
        Matcher_Cov2Cov m(0.3);
        m.planeEpsilon = epsilon, m.knn = 12;
        const Pairings p =
            run_matchers({std::make_shared<Matcher_Cov2Cov>(m)}, global, local_plane, pose, {});
        ASSERT_GT(p.paired_pt2pl.size(), 3u * 20);
        ASSERT_EQ(p.paired_pt2pl.size() % 3, 0u);
        EXPECT_EQ(p.potential_pairings, 3 * around.size());
        const Matrix3d M =
            2 * epsilon *
            (covariance(n_global, epsilon) + R * covariance(n_local, epsilon) * R.transpose()).inverse();
        // The middle of the local plane lies on a point of the global one: all that is known of d is at
        // other poses.
        double expected = 0;
        const CPose3D other = make_pose(R, at + 0.2 * random_unit(random));
        for (size_t i = 0; i < p.paired_pt2pl.size(); i += 3)
        {
            const Vector3d d = rotation_of(other) * to_eigen(p.paired_pt2pl[i].pt_local) +
                               translation_of(other) - to_eigen(p.paired_pt2pl[i].pl_global.centroid);
            expected += d.dot(M * d);
        }
        // Normals of float coordinates: 1e-7 of 3 m in 0.3 m.
        EXPECT_NEAR(cost(p, other), expected, 2e-5 * expected) << round;
    }
}

TEST(Cov2Cov, AgreeingPlanesCountAcrossAndPointsWithoutOneHardly)
{
    const Vector3d z(0, 0, 1);
    const metric_map_t floor = map_with(plane(z, {0, 0, 0}));
    Matcher_Cov2Cov m(0.5);
    const auto matcher = std::make_shared<Matcher_Cov2Cov>(m);
    const Pairings p = run_matchers({matcher}, floor, floor, CPose3D(0.03, 0, 0.1, 0, 0, 0), {});
    const auto weights = expanded_weights(p.pt2pl_weights, p.paired_pt2pl.size());
    ASSERT_EQ(weights.size(), 3u * 31 * 31);
    for (size_t i = 0; i < weights.size(); i += 3)
    {
        EXPECT_NEAR(weights[i], 1e-3, 1e-9);
        EXPECT_NEAR(weights[i + 1], 1e-3, 1e-9);
        EXPECT_NEAR(weights[i + 2], 1, 1e-6);
        EXPECT_NEAR(std::abs(p.paired_pt2pl[i + 2].pl_global.plane.coefs[2]), 1, 1e-6);
    }
    const metric_map_t lonely = map_with({TPoint3Df(0, 0, 0.1f)});
    const Pairings q = run_matchers({matcher}, floor, lonely, CPose3D(), {});
    const auto few = expanded_weights(q.pt2pl_weights, q.paired_pt2pl.size());
    ASSERT_EQ(few.size(), 3u);
    for (const double w : few) EXPECT_LT(w, 0.0021);  // 2 e / (1 + e) across, e along
    const Pairings none = run_matchers({matcher}, floor, lonely, CPose3D(0, 0, 0.5, 0, 0, 0), {});
    EXPECT_TRUE(none.empty());
    EXPECT_EQ(none.potential_pairings, 3u);
}

TEST(Cov2Cov, WithAnEpsilonOf1ItIsPointToPoint)
{
    const metric_map_t floor = map_with(plane({0, 0, 1}, {0, 0, 0}));
    Matcher_Cov2Cov m(0.5);
    m.planeEpsilon = 1;
    const CPose3D pose(0.03, 0.02, 0.1, 0, 0, 0);
    const Pairings p = run_matchers({std::make_shared<Matcher_Cov2Cov>(m)}, floor, floor, pose, {});
    EXPECT_NEAR(cost(p, pose), 31 * 31 * (0.03 * 0.03 + 0.02 * 0.02 + 0.1 * 0.1), 1e-5);
}

TEST(Cov2Cov, AlignsTwoScansOfARoomBetterThanPointsDo)
{
    using namespace mp2p_icp::synthetic;
    SeededRandom random(42);
    const RayTracer world(room_with_boxes(9, 7, 3, 8, 42));
    RotatingLidar lidar;
    lidar.rings = 32, lidar.azimuth_steps = 360, lidar.lowest_deg = -60, lidar.highest_deg = 45,
    lidar.sigma = 0.01;
    const CPose3D from(0.2, -0.3, 1.2, 0, 0, 0), step(0.25, 0.1, 0.02, 0.05, 0.01, -0.01);
    lidar.seed = 1;
    const metric_map_t global = map_of(scan_from(world, from, lidar).points);
    lidar.seed = 2;
    const metric_map_t local = map_of(scan_from(world, from + step, lidar).points);
    const auto error_of = [&](const std::shared_ptr<Matcher>& matcher)
    {
        ICP icp;
        icp.matchers().push_back(matcher);
        icp.solvers().push_back(std::make_shared<Solver_GaussNewton>());
        Parameters parameters;
        parameters.maxIterations = 60, parameters.minAbsStep_trans = 1e-4, parameters.minAbsStep_rot = 1e-5;
        Results r;
        icp.align(local, global, {}, parameters, r);
        EXPECT_EQ(r.verdict, Verdict::aligned) << r.verdict_reason;
        return translation_error(r.optimal_tf.mean, step);
    };
    const auto points = std::make_shared<Matcher_Points_DistanceThreshold>(0.5);
    points->allowMatchAlreadyMatchedGlobalPoints_ = true;
    const double error = error_of(std::make_shared<Matcher_Cov2Cov>(0.5));
    EXPECT_LT(error, 0.005);  // half the noise of one range
    EXPECT_LT(error, 0.5 * error_of(points));
}

TEST(Cov2Cov, IsTheSameToTheBitOnAnyNumberOfThreads)
{
    SeededRandom random(43);
    const metric_map_t global = map_with(cloud_of_shapes(20, 300, 0.01, 44)),
                       local = map_with(cloud_of_shapes(20, 300, 0.01, 44));
    const CPose3D pose = pose_deg(0.05, 0.02, -0.03, 2, 1, -1);
    Pairings one;
    for (const int threads : {1, 2, 4, 8})
        with_threads(threads,
                     [&]()
                     {
                         const Pairings p =
                             run_matchers({std::make_shared<Matcher_Cov2Cov>(0.3)}, global, local, pose, {});
                         if (threads == 1) one = p;
                         EXPECT_EQ(p.pt2pl_weights, one.pt2pl_weights);
                         ASSERT_EQ(p.paired_pt2pl.size(), one.paired_pt2pl.size());
                         for (size_t i = 0; i < p.paired_pt2pl.size(); i++)
                             EXPECT_EQ(p.paired_pt2pl[i].pl_global.plane.coefs,
                                       one.paired_pt2pl[i].pl_global.plane.coefs);
                     });
    EXPECT_GT(one.paired_pt2pl.size(), 3u * 1000);
}

TEST(Cov2Cov, ItsParametersAreCheckedAndFormulasFollowTheIterations)
{
    const auto loaded = [](const std::string& text)
    {
        Matcher_Cov2Cov m;
        m.initialize(yaml_from_text(text, "f.yaml"), {"f.yaml", "params"});
        return m;
    };
    const Matcher_Cov2Cov m = loaded("distanceThreshold: 2 - ICP_ITERATION\nplaneEpsilon: 0.01\nknn: 15\n");
    EXPECT_EQ(m.planeEpsilon, 0.01);
    EXPECT_EQ(m.knn, 15u);
    MatchContext context;
    context.variables["ICP_ITERATION"] = 1;
    EXPECT_EQ(m.gate(context), 1.0);
    expect_problem_with<ConfigError>({"distanceThreshold", "missing"}, [&]() { loaded("knn: 15"); });
    expect_problem_with<ConfigError>({"planeEpsilon", "f.yaml:2"},
                                     [&]() { loaded("distanceThreshold: 1\nplaneEpsilon: 0\n"); });
    expect_problem_with<ConfigError>({"planeEpsilon"},
                                     [&]() { loaded("distanceThreshold: 1\nplaneEpsilon: 1.5\n"); });
}
