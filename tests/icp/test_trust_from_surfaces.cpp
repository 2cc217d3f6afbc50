// What the verdict says where the world leaves motions free, whatever the matcher pairs.
#include <gtest/gtest.h>
#include <mp2p_icp/Matcher_Cov2Cov.h>
#include <mp2p_icp/Matcher_Point2Plane.h>
#include <mp2p_icp/Solver_GaussNewton.h>
#include <mp2p_icp/icp_pipeline_from_yaml.h>
#include <mp2p_icp/observability.h>
#include <mp2p_icp/synthetic/sample_by_area.h>
#include <mp2p_icp_filters/FilterDecimateVoxels.h>

#include "../../mp2p_icp/icp/src/pairings_on_surfaces.h"
#include "../../mp2p_icp/icp/src/toward_guess.h"
#include "degenerate_worlds.h"
#include "quality_worlds.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;
using namespace mp2p_icp::synthetic;
using Eigen::Vector3d;

namespace
{
/// Every point of the scan, global frame, with the normal of the triangle that it lies on.
struct Sampled
{
    metric_map_t map;
    std::vector<Vector3d> points, normals;
};

Sampled sample(const TriangleMesh& mesh, const RayTracer& world, const CPose3D& pose, uint64_t seed,
               double sigma)
{
    auto lidar = small_lidar();
    lidar.max_range = 40, lidar.lowest_deg = -60, lidar.highest_deg = 45;
    lidar.seed = seed, lidar.sigma = sigma;
    const auto scan = scan_from(world, pose, lidar);
    Sampled out;
    out.map = map_of(scan.points);
    mp2p_icp_filters::FilterDecimateVoxels decimate;
    decimate.input_pointcloud_layer = {"raw"}, decimate.output_pointcloud_layer = "decimated";
    decimate.voxel_filter_resolution = 0.25;
    decimate.filter(out.map);
    out.map.layers.erase("raw");
    for (size_t i = 0; i < scan.points->size(); i++)
    {
        mrpt::math::TPoint3D p;
        scan.points->getPoint(i, p.x, p.y, p.z);
        out.points.push_back(to_eigen(pose.composePoint(p)));
        out.normals.push_back(mesh.triangle(scan.triangle[i]).normal());
    }
    return out;
}

/// How much the motion moves the surfaces, of how much it moves the points: rms over rms.
double share_across_surfaces(const FreeTwist& twist, const Sampled& seen)
{
    const Vector3d axis = to_eigen(twist.axis);
    double across = 0, all = 0;
    for (size_t i = 0; i < seen.points.size(); i++)
    {
        Vector3d v = axis;
        if (twist.kind != FreeTwist::Kind::Translation)
            v = axis.cross(seen.points[i] - to_eigen(twist.through)) + twist.pitch * axis;
        across += std::pow(v.dot(seen.normals[i]), 2), all += v.squaredNorm();
    }
    return std::sqrt(across / all);
}

ICP points_pipeline()
{
    ICP icp;
    auto matcher = std::make_shared<Matcher_Points_DistanceThreshold>(0.5);
    matcher->allowMatchAlreadyMatchedGlobalPoints_ = true;
    icp.matchers().push_back(matcher);
    icp.solvers().push_back(std::make_shared<Solver_Horn>());
    return icp;
}
ICP planes_pipeline()
{
    ICP icp;
    auto matcher = std::make_shared<Matcher_Point2Plane>();
    matcher->distanceThreshold = 0.5, matcher->searchRadius = 1.0;
    icp.matchers().push_back(matcher);
    icp.solvers().push_back(std::make_shared<Solver_GaussNewton>());
    return icp;
}

void expect_only_true_axes(const DegenerateWorld& world, const ICP& icp, double sigma, uint64_t seed)
{
    SCOPED_TRACE(world.name + ", seed " + std::to_string(seed) + ", noise " + std::to_string(sigma));
    const RayTracer tracer(world.mesh);
    const CPose3D from = pose_deg(0.2, -0.3, 1.3, 0, 2, 1), step = pose_deg(0.2, 0.1, -0.05, 3, 1, -1);
    const Sampled global = sample(world.mesh, tracer, from, 2 * seed, sigma),
                  local = sample(world.mesh, tracer, from + step, 2 * seed + 1, sigma);
    const CPose3D guess = pose_deg(0.1, 0.05, 0, 1.5, 0.5, -0.5);
    Results result;
    Parameters parameters;
    parameters.maxIterations = 100;
    icp.align(local.map, global.map, guess.asTPose(), parameters, result);
    EXPECT_EQ(result.verdict, Verdict::under_constrained) << result.verdict_reason;
    EXPECT_EQ(result.unobservable.size(), world.free) << result.verdict_reason;
    EXPECT_EQ(result.rank(), 6 - static_cast<int>(world.free));
    Sampled seen = global;
    for (auto& p : seen.points) p = to_eigen((-from).composePoint(to_mrpt(p)));
    std::vector<std::string> named;
    for (const auto& twist : result.unobservable)
    {
        EXPECT_LT(share_across_surfaces(twist, seen), 0.05) << to_string(twist.kind) << " " << twist.name;
        if (!twist.name.empty()) named.push_back(twist.name);
        if (twist.kind == FreeTwist::Kind::Translation)
        {
            EXPECT_NEAR(
                to_eigen(twist.axis).dot(translation_of(result.optimal_tf.mean) - translation_of(guess)), 0,
                1e-9);
        }
    }
    std::sort(named.begin(), named.end());
    if (!world.named.empty())
    {
        EXPECT_EQ(named, world.named);
    }
}
}  // namespace

TEST(TrustFromSurfaces, points_name_exactly_the_free_axes)
{
    for (const auto& world : degenerate_worlds())
        for (const double sigma : {0.0, 0.02}) expect_only_true_axes(world, points_pipeline(), sigma, 1);
}

TEST(TrustFromSurfaces, planes_name_exactly_the_free_axes)
{
    for (const auto& world : degenerate_worlds())
        for (const double sigma : {0.0, 0.02}) expect_only_true_axes(world, planes_pipeline(), sigma, 2);
}

TEST(TrustFromSurfaces, healthy_worlds_have_no_free_axis)
{
    for (uint64_t seed = 1; seed <= 5; seed++)
        for (const auto& icp : {points_pipeline(), planes_pipeline()})
        {
            SCOPED_TRACE(seed);
            const auto mesh = seed % 2 ? test_room(seed) : street(120, seed);
            const RayTracer tracer(mesh);
            const CPose3D from = pose_deg(0.2, -0.3, 1.3, 0, 2, 1),
                          step = pose_deg(0.2, 0.1, -0.05, 3, 1, -1);
            const auto global = sample(mesh, tracer, from, 2 * seed, 0.02),
                       local = sample(mesh, tracer, from + step, 2 * seed + 1, 0.02);
            Results result;
            Parameters parameters;
            parameters.maxIterations = 100;
            icp.align(local.map, global.map, pose_deg(0.1, 0.05, 0, 1.5, 0.5, -0.5).asTPose(), parameters,
                      result);
            EXPECT_EQ(result.rank(), 6) << result.verdict_reason;
        }
}

// ---- Objects of few points
// ----------------------------------------------------------------------------------

namespace
{
/// Points at random on an ellipsoid with these half-axes.
metric_map_t ellipsoid(const Vector3d& axes, size_t points, uint64_t seed)
{
    SeededRandom random(seed);
    auto cloud = mrpt::maps::CSimplePointsMap::Create();
    while (cloud->size() < points)
    {
        const Vector3d p = axes.cwiseProduct(
            Vector3d(random.gaussian(1), random.gaussian(1), random.gaussian(1)).normalized());
        cloud->insertPoint(to_mrpt(p));
    }
    return map_of(cloud);
}

/// What two samples of it say of the pose at which they lie on each other.
SurfacePairings on_surfaces(const Vector3d& axes, const Matcher::Ptr& matcher, uint64_t seed)
{
    const metric_map_t global = ellipsoid(axes, 400, 2 * seed), local = ellipsoid(axes, 400, 2 * seed + 1);
    MatchState state(global, local);
    const Pairings pairings = run_matchers({matcher}, global, local, {}, {}, state);
    return pairings_on_surfaces(pairings, global, state.searched_global_layers, {});
}
int rank_of(const SurfacePairings& on)
{
    ObservabilityParameters parameters;
    parameters.feigned = &on.feigned;
    return observability(on.pairings, {}, parameters).rank;
}

matcher_list_t surface_matchers()
{
    const auto planes = std::make_shared<Matcher_Point2Plane>(0.2);
    planes->searchRadius = 1, planes->planeEigenThreshold = 0.3;
    const auto both = std::make_shared<Matcher_Cov2Cov>(0.2);
    both->knn = 10;
    return {planes, both};
}
}  // namespace

TEST(TrustFromSurfaces, objects_turn_freely_only_if_they_are_round)
{
    for (const auto& matcher : surface_matchers())
        for (uint64_t seed = 1; seed <= 20; seed++)
        {
            SCOPED_TRACE(matcher->GetRuntimeClass()->className + (", seed " + std::to_string(seed)));
            EXPECT_EQ(rank_of(on_surfaces({1, 0.7, 0.45}, matcher, seed)), 6);
            EXPECT_EQ(rank_of(on_surfaces({1, 0.6, 0.6}, matcher, seed)), 5);
            EXPECT_EQ(rank_of(on_surfaces({1, 1, 1}, matcher, seed)), 3);
        }
}

/// A plane without errors would be that of a primitive of the map. Each of a cloud has two, towards both
/// sides.
TEST(TrustFromSurfaces, planes_around_scattered_points_have_errors)
{
    for (const auto& matcher : surface_matchers())
    {
        const auto on = on_surfaces({1, 0.7, 0.45}, matcher, 1);
        ASSERT_GT(on.pairings.paired_pt2pl.size(), 200u);
        EXPECT_GE(static_cast<double>(on.feigned.paired_pt2pl.size()),
                  0.97 * 2 * static_cast<double>(on.pairings.paired_pt2pl.size()));
    }
}

// ---- Agreement of surfaces
// ----------------------------------------------------------------------------------

TEST(TrustFromSurfaces, rooms_laid_on_each_other_are_not_aligned)
{
    size_t aligned = 0, without_agreement = 0;
    for (uint64_t seed = 1; seed <= 10; seed++)
    {
        SeededRandom random(seed);
        const auto room = [&](uint64_t s) {
            return room_with_boxes(random.uniform(6, 12), random.uniform(6, 12), random.uniform(2.4, 4), 8,
                                   s);
        };
        const auto one = room(seed), other = room(seed + 100);
        const CPose3D from = pose_deg(0.2, -0.3, 1.3, 0, 2, 1);
        const auto global = sample(one, RayTracer(one), from, 2 * seed, 0.02),
                   local = sample(other, RayTracer(other), from, 2 * seed + 1, 0.02);
        Results result;
        Parameters parameters;
        parameters.maxIterations = 100;
        points_pipeline().align(local.map, global.map, {}, parameters, result);
        aligned += result.trusted();
        without_agreement += result.verdict_reason.find("agree") != std::string::npos;
    }
    EXPECT_LE(aligned, 1u);  // two rooms may be alike by chance
    EXPECT_GE(without_agreement, 5u) << "they were told apart by something else";
}

TEST(TrustFromSurfaces, a_noisy_scan_of_an_exact_dense_model_is_aligned)
{
    const auto mesh = test_room(3);
    const CPose3D truth = pose_deg(0.2, -0.3, 1.3, 5, 2, 1);
    metric_map_t model = map_of(sample_by_area(mesh, 40000, 1));
    model.layers["decimated"] = model.layers.at("raw");
    model.layers.erase("raw");
    const auto local = sample(mesh, RayTracer(mesh), truth, 7, 0.03);
    Results result;
    Parameters parameters;
    parameters.maxIterations = 100;
    planes_pipeline().align(local.map, model, pose_deg(0.3, -0.2, 1.25, 6, 2, 1).asTPose(), parameters,
                            result);
    EXPECT_EQ(result.verdict, Verdict::aligned) << result.verdict_reason;
    EXPECT_LT(translation_error(result.optimal_tf.mean, truth), 0.01);
}

TEST(SurfaceAgreement, is_that_of_the_direction_that_agrees_least)
{
    std::vector<SurfaceDistance> seen;
    const auto add = [&](int count, const Vector3d& normal, double distance) {
        seen.insert(seen.end(), static_cast<size_t>(count), {normal, distance, 0.01});
    };
    const auto least = [&]() { return least_agreement(seen, 0, 0.2); };  // tolerance: a quarter of 0.2
    add(49, Vector3d::UnitZ(), 0.01);
    EXPECT_FALSE(least()) << "too few points";
    add(951, Vector3d::UnitZ(), -0.01);
    EXPECT_EQ(least()->share, 1);
    add(30, Vector3d::UnitX(), 0.05), add(35, Vector3d::UnitX(), 0.06), add(35, Vector3d::UnitX(), -0.06);
    ASSERT_TRUE(least());
    EXPECT_NEAR(least()->share, 0.3, 1e-12);
    EXPECT_NEAR(std::abs(least()->axis.x()), 1, 1e-12);
    add(40, Vector3d::UnitY(), 1);  // 3.5 % of all
    EXPECT_NEAR(least()->share, 0.3, 1e-12);
    EXPECT_NEAR(least_agreement(seen, 0.03, 0.2)->share, 1, 1e-12)
        << "3 times the root of 0.01^2 + 0.03^2 is 0.095";
    EXPECT_NEAR(least_agreement(seen, 0, 0.01)->share, 0, 1e-12) << "0.05 is beyond 3 times 0.01";
}

// ---- toward_guess()
// -----------------------------------------------------------------------------------------

TEST(TowardGuess, takes_back_what_is_free_and_leaves_the_rest)
{
    const CPose3D guess = pose_deg(1, 2, 3, 10, 20, 30), pose = pose_deg(1.5, 1.8, 3.3, 15, 18, 33);
    FreeTwist slide;
    slide.axis = {0, 0.6, 0.8};
    const CPose3D slid = toward_guess(pose, guess, {slide});
    const Vector3d moved = translation_of(slid) - translation_of(pose);
    EXPECT_LT(moved.cross(to_eigen(slide.axis)).norm(), 1e-15);
    EXPECT_NEAR(to_eigen(slide.axis).dot(translation_of(slid) - translation_of(guess)), 0, 1e-15);
    EXPECT_EQ(rotation_error(slid, pose), 0);

    // A sphere: the centre stays, all of the rotation is the guess's.
    std::vector<FreeTwist> about_centre(3);
    for (int i = 0; i < 3; i++)
    {
        about_centre[size_t(i)].kind = FreeTwist::Kind::Rotation;
        about_centre[size_t(i)].axis = to_mrpt(Vector3d::Unit(i)),
        about_centre[size_t(i)].through = {4, -2, 1};
    }
    const CPose3D turned = toward_guess(pose, guess, about_centre);
    EXPECT_LT(rotation_error(turned, guess), 1e-14);
    const auto centre_in_local = (-pose).composePoint({4, -2, 1});
    EXPECT_LT((to_eigen(turned.composePoint(centre_in_local)) - Vector3d(4, -2, 1)).norm(), 1e-14);
}

TEST(TowardGuess, a_screw_advances_as_it_turns)
{
    FreeTwist screw;
    screw.kind = FreeTwist::Kind::Screw;
    screw.axis = {0, 0, 1}, screw.through = {1, 0, 0}, screw.pitch = 0.5;
    const CPose3D back = toward_guess(pose_deg(1, 1, 0, 30, 0, 0), CPose3D(), {screw});
    // Turned by -30 degrees about (1, 0): the origin, which is 1 m beside the axis, and 0.5 m/rad down.
    EXPECT_NEAR(back.yaw(), 0, 1e-15);
    EXPECT_NEAR(back.x(), 1 + std::sin(M_PI / 6), 1e-14);
    EXPECT_NEAR(back.y(), std::cos(M_PI / 6), 1e-14);
    EXPECT_NEAR(back.z(), -0.5 * M_PI / 6, 1e-14);
}

TEST(trust_from_surfaces, a_run_that_cannot_go_on_from_the_guess_along_free_motions_has_failed)
{
    SeededRandom random(31);
    auto floor = mrpt::maps::CSimplePointsMap::Create();
    for (int i = 0; i < 4000; i++)
        floor->insertPoint(static_cast<float>(random.uniform(-3, 3)),
                           static_cast<float>(random.uniform(-3, 3)),
                           static_cast<float>(random.gaussian(0.01)));
    const metric_map_t map = map_of(floor);
    int calls = 0, answered = std::numeric_limits<int>::max();
    Bench bench;
    bench.solver->script = [&](const Pairings&, OptimalTF_Result& out, const SolverContext& c)
    {
        out.optimalPose = *c.guessRelativePose;
        return ++calls <= answered;
    };
    const CPose3D guess(0.01, 0, 0, 0, 0, 0);
    EXPECT_EQ(bench.align(map, map, guess).verdict, Verdict::under_constrained);
    EXPECT_EQ(calls, 2);  // in the iterations, and once more with x, y and yaw as in the guess
    calls = 0, answered = 1;
    const Results r = bench.align(map, map, guess);
    EXPECT_EQ(r.verdict, Verdict::failed);
    EXPECT_NE(r.verdict_reason.find("nothing to solve with"), std::string::npos) << r.verdict_reason;
    EXPECT_TRUE(r.unobservable.empty());
    EXPECT_TRUE(same_bits(r.optimal_tf.mean, guess));
}
