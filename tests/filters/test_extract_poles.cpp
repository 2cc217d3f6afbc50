#include <mp2p_icp/random.h>
#include <mp2p_icp_filters/extract_poles.h>

#include <cstdio>
#include <limits>
#include <map>

#include "expect_problem.h"
#include "filter_test_tools.h"
#include "test_repetitions.h"
#include "true_faces.h"

using namespace mp2p_icp_test;
using namespace mp2p_icp_filters;
using Eigen::Vector3d;
using mp2p_icp::SeededRandom;
using mp2p_icp::to_eigen;

namespace
{
/// The side of a round pole that is seen from the origin, with noise along the beams, and the ground.
mrpt::maps::CSimplePointsMap::Ptr pole(double x, double y, double radius, double sigma, uint64_t seed)
{
    SeededRandom random(seed);
    const auto cloud = mrpt::maps::CSimplePointsMap::Create();
    const double azimuth = std::atan2(y, x);
    for (int i = 0; i < 400; i++)
    {
        const double at = azimuth + M_PI + random.uniform(-1.3, 1.3), z = random.uniform(-1.5, 2.5);
        const Vector3d p(x + radius * std::cos(at), y + radius * std::sin(at), z);
        const Vector3d q = p * (1 + random.gaussian(sigma) / p.norm());
        cloud->insertPoint(static_cast<float>(q.x()), static_cast<float>(q.y()), static_cast<float>(q.z()));
    }
    for (int i = 0; i < 4000; i++)
    {
        const double dx = random.uniform(-5, 5), dy = random.uniform(-5, 5);
        if (std::hypot(dx, dy) > 0.4)
            cloud->insertPoint(static_cast<float>(x + dx), static_cast<float>(y + dy), -1.5f);
    }
    return cloud;
}

/// Number of the box of a street that a triangle belongs to, if that is a pole: see synthetic::street().
std::optional<uint32_t> pole_of(const ScannedWorld& w, uint32_t triangle)
{
    if (triangle < 2) return {};
    const uint32_t box = (triangle - 2) / 12;
    double lowest = 1e9, highest = -1e9;
    for (uint32_t t = 2 + 12 * box; t < 14 + 12 * box; t++)
    {
        const auto corners = w.mesh.triangle(t);
        for (const Vector3d& p : {corners.a, corners.b, corners.c})
            lowest = std::min(lowest, p.x()), highest = std::max(highest, p.x());
    }
    if (highest - lowest > 0.5) return {};
    return box;
}
Vector3d axis_of_box(const ScannedWorld& w, uint32_t box)
{
    Vector3d sum = Vector3d::Zero();
    for (uint32_t t = 2 + 12 * box; t < 14 + 12 * box; t++)
    {
        const auto corners = w.mesh.triangle(t);
        sum += corners.a + corners.b + corners.c;
    }
    return mp2p_icp::rotation_of(w.pose).transpose() * (sum / 36 - mp2p_icp::translation_of(w.pose));
}
}  // namespace

TEST(extract_poles, polesOfAStreetAreFoundAndNothingElse)
{
    const size_t scans = repetitions(3, 40);
    size_t well_seen = 0, found_of_these = 0, invented = 0, all = 0;
    double worst_distance = 0, worst_angle = 0;
    for (size_t seed = 0; seed < scans; seed++)
    {
        const auto world = scanned_street(seed);
        std::map<uint32_t, size_t> points;  // of each pole
        for (const uint32_t t : world.scan.triangle)
            if (const auto box = pole_of(world, t)) points[*box]++;
        const Vector3d up = mp2p_icp::rotation_of(world.pose).transpose() * Vector3d::UnitZ();
        for (const auto& found : extract_poles(*world.scan.points))
        {
            all++;
            std::map<uint32_t, size_t> votes;
            for (const uint32_t i : found.inliers)
                if (const auto box = pole_of(world, world.scan.triangle[i])) votes[*box]++;
            std::pair<uint32_t, size_t> best{0, 0};
            for (const auto& vote : votes)
                if (vote.second > best.second) best = vote;
            if (static_cast<double>(best.second) < 0.9 * static_cast<double>(found.inliers.size()))
            {
                invented++;
                std::printf("invented: %zu points, length %.2f, thickness %.3f at %.1f %.1f\n",
                            found.inliers.size(), found.line.fit->length(), found.thickness,
                            found.line.pBase.x, found.line.pBase.y);
                continue;
            }
            if (points[best.first] >= 100) found_of_these++;
            const Vector3d d = to_eigen(found.line.director);
            const Vector3d off = to_eigen(found.line.pBase) - axis_of_box(world, best.first);
            worst_distance = std::max(worst_distance, d.cross(off).norm());
            worst_angle = std::max(worst_angle, mrpt::RAD2DEG(std::asin(d.cross(up).norm())));
        }
        for (const auto& [box, count] : points) well_seen += count >= 100;
    }
    std::printf(
        "%zu streets: %zu poles with 100 points, %zu of them found, %zu in all, %zu invented, worst %.3f m "
        "%.2f deg\n",
        scans, well_seen, found_of_these, all, invented, worst_distance, worst_angle);
    EXPECT_GT(well_seen, 2 * scans);
    EXPECT_GE(static_cast<double>(found_of_these), 0.7 * static_cast<double>(well_seen));
    EXPECT_EQ(invented, 0u);
    EXPECT_LT(worst_distance, 0.25);  // half a diagonal
    EXPECT_LT(worst_angle, 3);
}

TEST(extract_poles, aPoleOnTheGroundIsMeasured)
{
    const auto poles = extract_poles(*pole(6, 3, 0.1, 0.01, 1));
    ASSERT_EQ(poles.size(), 1u);
    const auto& line = poles[0].line;
    EXPECT_GT(line.director.z, 0.9998);
    const double distance = std::hypot(line.pBase.x - 6, line.pBase.y - 3);
    EXPECT_LT(distance, 0.1);
    EXPECT_LT(line.pBase.x, 6);  // on the side of the sensor
    EXPECT_LT(distance, 3 * line.fit->offset_deviation());
    EXPECT_NEAR(line.fit->length(), 4, 0.15);
    EXPECT_NEAR(poles[0].thickness, 0.1 * std::sqrt(0.5), 0.03);
    EXPECT_NEAR(line.fit->axis_a.dot(Vector3d(6, 3, 0)), 0, 0.05);  // across the view
    EXPECT_EQ(line.fit->inliers, poles[0].inliers.size());
    EXPECT_TRUE(line.fit->is_sound());
}

TEST(extract_poles, directionsAreAsUncertainAsPredicted)
{
    Eigen::Matrix2d of_errors = Eigen::Matrix2d::Zero(), predicted = Eigen::Matrix2d::Zero();
    const int draws = 100;
    for (int seed = 1; seed <= draws; seed++)
    {
        const auto poles = extract_poles(*pole(6, 0, 0.05, 0.02, static_cast<uint64_t>(seed)));
        ASSERT_EQ(poles.size(), 1u);
        const Vector3d d = to_eigen(poles[0].line.director), a = poles[0].line.fit->axis_a;
        const Eigen::Vector2d e(a.z(), d.cross(a).z());  // of the true director, z
        of_errors += e * e.transpose() / draws;
        predicted += poles[0].line.fit->covariance.bottomRightCorner<2, 2>() / draws;
    }
    for (int i = 0; i < 2; i++) EXPECT_NEAR(of_errors(i, i) / predicted(i, i), 1, 0.45) << i;
}

TEST(extract_poles, wiresOnlyWhereAnyDirectionIsAsked)
{
    SeededRandom random(3);
    const auto wire = mrpt::maps::CSimplePointsMap::Create();
    for (int i = 0; i < 500; i++)
        wire->insertPoint(static_cast<float>(random.uniform(-5, 5)), 4,
                          3 + static_cast<float>(random.gaussian(0.01)));
    EXPECT_TRUE(extract_poles(*wire).empty());
    PoleParameters any;
    any.maximum_angle_to_vertical_deg = 90;
    EXPECT_TRUE(extract_poles(*wire, any).empty());  // too thin
    any.minimum_thickness = 0;
    const auto found = extract_poles(*wire, any);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_GT(found[0].line.director.x, 0.9999);
    EXPECT_GT(found[0].inliers.size(), 450u);
}

TEST(extract_poles, cloudsWithoutPolesHaveNone)
{
    const float nan = std::numeric_limits<float>::quiet_NaN();
    EXPECT_TRUE(extract_poles(*cloud_of({})).empty());
    EXPECT_TRUE(extract_poles(*cloud_of({{1, 2, 3}})).empty());
    EXPECT_TRUE(extract_poles(*cloud_of(std::vector<mrpt::math::TPoint3Df>(500, {1, 2, 3}))).empty());
    EXPECT_TRUE(extract_poles(*cloud_of(std::vector<mrpt::math::TPoint3Df>(500, {nan, 2, 3}))).empty());
    EXPECT_TRUE(
        extract_poles(*cloud_of(std::vector<mrpt::math::TPoint3Df>(500, {3e38f, -3e38f, 3e38f}))).empty());
    SeededRandom random(4);
    const auto volume = mrpt::maps::CSimplePointsMap::Create();
    for (int i = 0; i < 5000; i++)
    {
        const float x = static_cast<float>(random.uniform(-3, 3)),
                    y = static_cast<float>(random.uniform(-3, 3));
        volume->insertPoint(x, y, static_cast<float>(random.uniform(-3, 3)));
    }
    EXPECT_TRUE(extract_poles(*volume).empty());
}

TEST(extract_poles, exactPointsOnALineHaveAFit)
{
    const auto cloud = mrpt::maps::CSimplePointsMap::Create();
    for (int i = 0; i < 200; i++) cloud->insertPoint(3, 2, static_cast<float>(i) * 0.02f);
    PoleParameters thin;
    thin.minimum_thickness = 0;
    const auto poles = extract_poles(*cloud, thin);
    ASSERT_EQ(poles.size(), 1u);
    EXPECT_EQ(poles[0].inliers.size(), 200u);
    EXPECT_TRUE(poles[0].line.fit->is_sound());
    EXPECT_LT(poles[0].line.fit->sigma, 1e-9);
}

TEST(extract_poles, parametersOutOfRangeAreRefused)
{
    const auto cloud = cloud_of({});
    const auto refused = [&](const std::string& name, void (*spoil)(PoleParameters&))
    {
        PoleParameters p;
        spoil(p);
        expect_problem_with<std::invalid_argument>({name}, [&]() { extract_poles(*cloud, p); });
    };
    refused("voxel_size", [](PoleParameters& p) { p.voxel_size = 0; });
    refused("minimum_linearity", [](PoleParameters& p) { p.minimum_linearity = 0.5; });
    refused("maximum_radius", [](PoleParameters& p) { p.maximum_radius = -1; });
    refused("minimum_length", [](PoleParameters& p) { p.minimum_length = -1; });
    refused("minimum_thickness", [](PoleParameters& p) { p.minimum_thickness = -1; });
    refused("minimum_inliers", [](PoleParameters& p) { p.minimum_inliers = 5; });
    refused("maximum_angle_to_vertical_deg", [](PoleParameters& p) { p.maximum_angle_to_vertical_deg = 91; });
    refused("maximum_crowd", [](PoleParameters& p) { p.maximum_crowd = -1; });
}
