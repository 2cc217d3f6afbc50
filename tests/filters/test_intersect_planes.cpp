#include <mp2p_icp/random.h>
#include <mp2p_icp_filters/extract_planes.h>
#include <mp2p_icp_filters/intersect_planes.h>

#include <cstdio>
#include <optional>

#include "expect_problem.h"
#include "filter_test_tools.h"
#include "test_repetitions.h"
#include "true_faces.h"

using namespace mp2p_icp_test;
using namespace mp2p_icp_filters;
using Eigen::Vector3d;
using mp2p_icp::fitted_line_t;
using mp2p_icp::fitted_plane_t;
using mp2p_icp::to_eigen;

namespace
{
std::vector<fitted_plane_t> planes_of(const ScannedWorld& world)
{
    std::vector<fitted_plane_t> out;
    for (const auto& found : extract_planes(*world.scan.points)) out.push_back(found.plane);
    return out;
}

/// Errors (x, y, p, q) of a line against that in which two faces meet; see line_fit_t::covariance.
Eigen::Vector4d line_error(const fitted_line_t& line, const TrueFace& a, const TrueFace& b)
{
    const Vector3d d = to_eigen(line.director), axis_a = line.fit->axis_a, axis_b = d.cross(axis_a);
    Vector3d true_d = a.normal.cross(b.normal).normalized();
    if (true_d.dot(d) < 0) true_d = -true_d;
    Eigen::Matrix3d equations;
    equations << a.normal.transpose(), b.normal.transpose(), d.transpose();
    const Vector3d at_base = equations.inverse() * Vector3d(a.offset, b.offset, d.dot(to_eigen(line.pBase)));
    const Vector3d off = at_base - to_eigen(line.pBase);
    return {off.dot(axis_a), off.dot(axis_b), true_d.dot(axis_a), true_d.dot(axis_b)};
}

/// Two faces of the world at an angle on which both ends of the line lie.
std::optional<std::pair<TrueFace, TrueFace>> faces_of(const fitted_line_t& line, const ScannedWorld& world)
{
    const Vector3d base = to_eigen(line.pBase), d = to_eigen(line.director);
    std::vector<TrueFace> on;
    for (uint32_t t = 0; t < world.mesh.size(); t++)
    {
        const TrueFace f = face_of(world, t);
        const auto is_near = [&](double s)
        {
            const double margin =
                0.01 + 4 * (line.fit->offset_deviation() + std::abs(s) * line.fit->angle_deviation());
            return std::abs(f.normal.dot(base + s * d) - f.offset) < margin;
        };
        if (is_near(line.fit->begin) && is_near(line.fit->end)) on.push_back(f);
    }
    for (const auto& f : on)
        if (std::abs(f.normal.dot(on[0].normal)) < 0.8) return std::make_pair(on[0], f);
    return {};
}
}  // namespace

TEST(intersect_planes, linesOfRoomsAreTrueEdgesAndKnowHowWell)
{
    const size_t scans = repetitions(4, 40);
    size_t lines = 0, invented = 0;
    double chi2 = 0, worst_offset = 0;
    for (size_t seed = 0; seed < scans; seed++)
    {
        const auto world = scanned_room(seed);
        for (const auto& line : intersect_planes(*world.scan.points, planes_of(world)))
        {
            lines++;
            EXPECT_TRUE(line.fit->is_sound());
            const auto faces = faces_of(line, world);
            invented += !faces;
            if (!faces) continue;
            const Eigen::Vector4d e = line_error(line, faces->first, faces->second);
            chi2 += e.dot(line.fit->covariance.ldlt().solve(e)) / 4;
            if (line.fit->offset_deviation() < 0.003)
                worst_offset = std::max(worst_offset, e.head<2>().norm());
        }
    }
    chi2 /= static_cast<double>(lines - invented);
    std::printf("%zu rooms: %zu lines, %zu invented, chi2/4 %.2f, worst %.4f m\n", scans, lines, invented,
                chi2, worst_offset);
    EXPECT_GE(lines, 10 * scans);
    EXPECT_LE(static_cast<double>(invented), 0.02 * static_cast<double>(lines));
    EXPECT_GT(chi2, 0.6);
    EXPECT_LT(chi2, 1.5);
    EXPECT_LT(worst_offset, 0.01);
}

namespace
{
/// Floor z = 0 and wall x = 2 as seen from (0, 0, 1), of which the wall ends `gap` above the floor.
struct FloorAndWall
{
    mrpt::maps::CSimplePointsMap::Ptr cloud = mrpt::maps::CSimplePointsMap::Create();
    std::vector<fitted_plane_t> planes;

    explicit FloorAndWall(double gap)
    {
        mp2p_icp::SeededRandom random(1);
        for (int i = 0; i < 6000; i++)
        {
            const float a = static_cast<float>(random.uniform(-2, 2)),
                        b = static_cast<float>(random.uniform(-2, 2)),
                        c = static_cast<float>(random.uniform(gap, 3));
            cloud->insertPoint(a, b, static_cast<float>(random.gaussian(0.003)));
            cloud->insertPoint(2 + static_cast<float>(random.gaussian(0.003)), b, c);
        }
        for (const auto& found : extract_planes(*cloud, {}, {0, 0, 1})) planes.push_back(found.plane);
    }
};
}  // namespace

TEST(intersect_planes, aFloorAndAWallMeetInALine)
{
    const FloorAndWall world(0);
    ASSERT_EQ(world.planes.size(), 2u);
    const auto lines = intersect_planes(*world.cloud, world.planes);
    ASSERT_EQ(lines.size(), 1u);
    const Vector3d base = to_eigen(lines[0].pBase), d = to_eigen(lines[0].director);
    EXPECT_NEAR(d.y(), 1, 1e-5);  // the largest component is positive
    EXPECT_NEAR(base.x(), 2, 0.001);
    EXPECT_NEAR(base.z(), 0, 0.001);
    EXPECT_NEAR(base.y() + lines[0].fit->begin, -2, 0.25);  // in pieces
    EXPECT_NEAR(base.y() + lines[0].fit->end, 2, 0.25);
    EXPECT_NEAR(lines[0].fit->sigma, 0.003, 3e-4);
    EXPECT_GT(lines[0].fit->inliers, 300u);
    EXPECT_NEAR(lines[0].fit->axis_a.dot(d), 0, 1e-12);
}

TEST(intersect_planes, whereTheyDoNotTouchThereIsNone)
{
    const FloorAndWall world(0.5);
    ASSERT_EQ(world.planes.size(), 2u);
    EXPECT_TRUE(intersect_planes(*world.cloud, world.planes).empty());
    IntersectionParameters wide;
    wide.touch_distance = 0.8;
    EXPECT_EQ(intersect_planes(*world.cloud, world.planes, wide).size(), 1u);
    wide.minimum_length = 5;
    EXPECT_TRUE(intersect_planes(*world.cloud, world.planes, wide).empty());
}

TEST(intersect_planes, planesWithoutFitOrAngleMakeNone)
{
    const FloorAndWall world(0);
    auto planes = world.planes;
    planes[0].fit.reset();
    EXPECT_TRUE(intersect_planes(*world.cloud, planes).empty());
    planes = world.planes;
    planes[0].fit->sigma = -1;
    EXPECT_TRUE(intersect_planes(*world.cloud, planes).empty());
    EXPECT_TRUE(intersect_planes(*world.cloud, {world.planes[0], world.planes[0]}).empty());
    EXPECT_TRUE(intersect_planes(*cloud_of({}), world.planes).empty());
    EXPECT_TRUE(intersect_planes(*world.cloud, {}).empty());
    IntersectionParameters bad;
    bad.touch_distance = 0;
    expect_problem_with<std::invalid_argument>({"touch_distance"},
                                               [&]() { intersect_planes(*world.cloud, planes, bad); });
    bad = {};
    bad.minimum_angle_deg = 0;
    expect_problem_with<std::invalid_argument>({"minimum_angle_deg"},
                                               [&]() { intersect_planes(*world.cloud, planes, bad); });
}
