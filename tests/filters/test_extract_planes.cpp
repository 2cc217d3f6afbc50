#include <mp2p_icp/random.h>
#include <mp2p_icp_filters/extract_planes.h>

#include <cstdio>
#include <functional>
#include <limits>

#include "expect_problem.h"
#include "filter_test_tools.h"
#include "test_repetitions.h"
#include "true_faces.h"
#include "with_threads.h"

using namespace mp2p_icp_test;
using namespace mp2p_icp_filters;
using mp2p_icp::SeededRandom;
using mrpt::maps::CSimplePointsMap;

namespace
{
/// What the planes of many scans are like.
struct Judgement
{
    size_t planes = 0, sure = 0, invented = 0, wrong = 0;
    double sum_of_chi2 = 0;

    void judge(const ScannedWorld& world)
    {
        for (const auto& found : extract_planes(*world.scan.points))
        {
            const auto [face, share] = main_face(world, found.inliers);
            const PlaneError error = error_of(found.plane, face);
            planes++;
            invented += share < 0.9;
            sum_of_chi2 += error.abh.dot(found.plane.fit->covariance.ldlt().solve(error.abh));
            if (!is_sure(*found.plane.fit)) continue;
            sure++;
            wrong += !(error.angle_deg <= 0.5 && error.offset <= 0.01);
        }
    }
    void expect_good(size_t scans, size_t least_sure_per_scan) const
    {
        EXPECT_EQ(invented, 0u);
        EXPECT_EQ(wrong, 0u);
        EXPECT_GE(sure, least_sure_per_scan * scans);
        const double mean_chi2 = sum_of_chi2 / static_cast<double>(planes) / 3;
        EXPECT_GT(mean_chi2, 0.7);
        EXPECT_LT(mean_chi2, 1.4);
        std::printf("%zu scans: %zu planes, %zu sure, chi2/3 %.2f\n", scans, planes, sure, mean_chi2);
    }
};

/// How many different true faces are found as planes that are sure.
size_t faces_found(const ScannedWorld& world, const std::vector<TrueFace>& faces)
{
    size_t count = 0;
    const auto planes = extract_planes(*world.scan.points);
    for (const TrueFace& face : faces)
        for (const auto& found : planes)
            if (const auto e = error_of(found.plane, face); e.angle_deg < 0.5 && e.offset < 0.01)
            {
                count++;
                break;
            }
    return count;
}

CSimplePointsMap::Ptr random_points(size_t count, uint64_t seed,
                                    const std::function<Eigen::Vector3d(SeededRandom&)>& draw)
{
    SeededRandom random(seed);
    const auto cloud = CSimplePointsMap::Create();
    for (size_t i = 0; i < count; i++)
    {
        const Eigen::Vector3f p = draw(random).cast<float>();
        cloud->insertPoint(p.x(), p.y(), p.z());
    }
    return cloud;
}

/// 4 x 3 m at z = height, with noise across it.
CSimplePointsMap::Ptr table(double height, size_t count = 2000, double sigma = 0.01, double shift = 0)
{
    return random_points(count, 1,
                         [=](SeededRandom& r)
                         {
                             const double x = r.uniform(-2, 2), y = r.uniform(-1.5, 1.5);
                             return Eigen::Vector3d(shift + x, shift + y, height + r.gaussian(sigma));
                         });
}

void expect_same(const std::vector<ExtractedPlane>& a, const std::vector<ExtractedPlane>& b)
{
    ASSERT_EQ(a.size(), b.size());
    for (size_t i = 0; i < a.size(); i++)
    {
        EXPECT_EQ(a[i].inliers, b[i].inliers);
        EXPECT_EQ(a[i].plane.plane.coefs, b[i].plane.plane.coefs);
        EXPECT_EQ(a[i].plane.fit->covariance, b[i].plane.fit->covariance);
    }
}
}  // namespace

TEST(extract_planes, inARoomTheyAreTrueAndSureOfWhatTheyKnow)
{
    const size_t scans = repetitions(4, 40);
    Judgement judgement;
    for (size_t seed = 0; seed < scans; seed++) judgement.judge(scanned_room(seed));
    judgement.expect_good(scans, 6);
}

TEST(extract_planes, inAStreetTheyAreTrueAndSureOfWhatTheyKnow)
{
    const size_t scans = repetitions(3, 40);
    Judgement judgement;
    for (size_t seed = 0; seed < scans; seed++) judgement.judge(scanned_street(seed));
    judgement.expect_good(scans, 3);
}

TEST(extract_planes, allWallsOfARoomAreFound)
{
    for (size_t seed = 0; seed < 3; seed++)
    {
        const auto world = scanned_room(seed);
        std::vector<TrueFace> faces;
        for (uint32_t triangle = 0; triangle < 12; triangle += 2) faces.push_back(face_of(world, triangle));
        EXPECT_EQ(faces_found(world, faces), 6u) << seed;
    }
}

TEST(extract_planes, aTableIsMeasured)
{
    const auto cloud = table(-1);
    const auto planes = extract_planes(*cloud);
    ASSERT_EQ(planes.size(), 1u);
    const auto& p = planes[0].plane;
    EXPECT_GT(p.normal().z(), 0.9999);  // towards the origin
    EXPECT_NEAR(p.centroid.z, -1, 0.002);
    EXPECT_NEAR(p.fit->sigma, 0.01, 0.001);
    EXPECT_EQ(p.fit->inliers, planes[0].inliers.size());
    EXPECT_GT(p.fit->inliers, 1900u);
    EXPECT_NEAR(planes[0].area, 12, 0.6);
    EXPECT_NEAR(p.fit->u_max - p.fit->u_min, 4, 0.15);  // u: the widest spread
    EXPECT_NEAR(p.fit->v_max - p.fit->v_min, 3, 0.15);
    EXPECT_NEAR(std::abs(p.fit->axis_u.x()), 1, 0.01);
    EXPECT_NEAR(p.fit->offset_deviation(), 0.01 / std::sqrt(2000.0), 3e-5);
    EXPECT_NEAR(p.fit->angle_deviation(), 0.01 / std::sqrt(2000.0) / (3 / std::sqrt(12.0)), 5e-5);
    EXPECT_TRUE(p.fit->is_sound());
}

TEST(extract_planes, normalsPointToTheSensor)
{
    const auto cloud = table(-1);
    EXPECT_GT(extract_planes(*cloud).at(0).plane.normal().z(), 0.99);
    EXPECT_LT(extract_planes(*cloud, {}, {0, 0, -3}).at(0).plane.normal().z(), -0.99);
    EXPECT_GT(extract_planes(*cloud, {}, {7, 0, -0.5}).at(0).plane.normal().z(), 0.99);
    EXPECT_TRUE(extract_planes(*cloud, {}, {30, 0, -0.9}).empty());  // seen edge-on
}

TEST(extract_planes, theCovarianceIsThatOfManyDraws)
{
    Eigen::Matrix3d of_errors = Eigen::Matrix3d::Zero(), predicted = Eigen::Matrix3d::Zero();
    const size_t draws = 200;
    for (size_t seed = 1; seed <= draws; seed++)
    {
        const auto cloud =
            random_points(500, seed,
                          [](SeededRandom& r)
                          {
                              const double x = r.uniform(-2, 2), y = r.uniform(-1.5, 1.5);
                              // noisier on one side
                              return Eigen::Vector3d(x, y, -1 + r.gaussian(x > 0 ? 0.015 : 0.005));
                          });
        const auto planes = extract_planes(*cloud);
        ASSERT_EQ(planes.size(), 1u) << seed;
        const PlaneError e = error_of(planes[0].plane, {{0, 0, 1}, -1});
        of_errors += e.abh * e.abh.transpose() / draws;
        predicted += planes[0].plane.fit->covariance / draws;
    }
    for (int i = 0; i < 3; i++) EXPECT_NEAR(of_errors(i, i) / predicted(i, i), 1, 0.3) << i;
}

TEST(extract_planes, roundThingsAndNoiseAreNone)
{
    for (const double radius : {0.5, 2.0, 10.0})
    {
        const auto sphere =
            random_points(20000, 5,
                          [radius](SeededRandom& r)
                          {
                              Eigen::Vector3d d;
                              for (int i = 0; i < 3; i++) d(i) = r.gaussian();
                              const double q = radius + r.gaussian(0.01);
                              return Eigen::Vector3d(Eigen::Vector3d(3, 0, 0) + d.normalized() * q);
                          });
        EXPECT_TRUE(extract_planes(*sphere).empty()) << radius;
    }
    for (const double radius : {0.5, 2.0})
    {
        const auto pipe =
            random_points(20000, 6,
                          [radius](SeededRandom& r)
                          {
                              const double a = r.uniform(-M_PI, M_PI), q = radius + r.gaussian(0.01);
                              return Eigen::Vector3d(7 + q * std::cos(a), q * std::sin(a), r.uniform(-3, 3));
                          });
        EXPECT_TRUE(extract_planes(*pipe).empty()) << radius;
    }
    const auto volume =
        random_points(10000, 7,
                      [](SeededRandom& r)
                      { return Eigen::Vector3d(r.uniform(-2, 2), r.uniform(-2, 2), r.uniform(-2, 2)); });
    EXPECT_TRUE(extract_planes(*volume).empty());
}

/// Paving is off by some mm over decimetres, more than the noise of a good sensor.
TEST(extract_planes, aSurfaceMayBeRough)
{
    constexpr double HEIGHT_OF_WAVES = 0.004, LENGTH_OF_WAVES = 1.2;
    const auto paving =
        random_points(20000, 7,
                      [](SeededRandom& r)
                      {
                          const double x = r.uniform(-4, 4), y = r.uniform(-4, 4);
                          const double wave = std::sin(2 * M_PI * x / LENGTH_OF_WAVES) *
                                              std::sin(2 * M_PI * y / LENGTH_OF_WAVES);
                          return Eigen::Vector3d(x, y, -1 + HEIGHT_OF_WAVES * wave + r.gaussian(0.0015));
                      });
    PlaneParameters rough;
    rough.roughness = 0.01;
    const auto all_of = [&](const std::vector<ExtractedPlane>& planes)
    { return planes.size() == 1 && planes[0].inliers.size() > 19000; };
    EXPECT_FALSE(all_of(extract_planes(*paving)));
    const auto planes = extract_planes(*paving, rough);
    ASSERT_TRUE(all_of(planes)) << planes.size() << " planes";
    // The rms height of the waves is half of HEIGHT_OF_WAVES.
    EXPECT_NEAR(planes[0].plane.fit->sigma, std::hypot(HEIGHT_OF_WAVES / 2, 0.0015), 2e-4);
    EXPECT_NEAR(planes[0].plane.centroid.z, -1, 3e-4);
    EXPECT_GT(planes[0].plane.normal().z(), std::cos(1e-3));
}

TEST(extract_planes, aCloudWithoutExtentHasNone)
{
    const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
    EXPECT_TRUE(extract_planes(*cloud_of({})).empty());
    EXPECT_TRUE(extract_planes(*cloud_of({{1, 2, 3}})).empty());
    EXPECT_TRUE(extract_planes(*cloud_of(std::vector<mrpt::math::TPoint3Df>(500, {1, 2, 3}))).empty());
    EXPECT_TRUE(extract_planes(*cloud_of(std::vector<mrpt::math::TPoint3Df>(500, {nan, inf, -inf}))).empty());
    for (const double sigma : {0.0, 0.01})
        EXPECT_TRUE(extract_planes(*random_points(2000, 3,
                                                  [sigma](SeededRandom& r)
                                                  {
                                                      const double s = r.uniform(-5, 5);
                                                      return Eigen::Vector3d(1 + s + r.gaussian(sigma),
                                                                             2 - s + r.gaussian(sigma),
                                                                             3 + s + r.gaussian(sigma));
                                                  }))
                        .empty());
}

TEST(extract_planes, pointsThatAreNoPlacesChangeNothing)
{
    const auto cloud = table(-1), with_others = CSimplePointsMap::Create();
    const float nan = std::numeric_limits<float>::quiet_NaN(), huge = 3e38f;
    std::vector<uint32_t> place;
    for (size_t i = 0; i < cloud->size(); i++)
    {
        float x = 0, y = 0, z = 0;
        cloud->getPoint(i, x, y, z);
        place.push_back(static_cast<uint32_t>(with_others->size()));
        with_others->insertPoint(x, y, z);
        if (i % 10 == 0) with_others->insertPoint(nan, y, z);
        if (i % 10 == 5) with_others->insertPoint(i % 3 ? huge : -huge, huge, i % 2 ? huge : 0.0f);
    }
    const auto plain = extract_planes(*cloud), other = extract_planes(*with_others);
    ASSERT_EQ(plain.size(), 1u);
    ASSERT_EQ(other.size(), 1u);
    EXPECT_EQ(plain[0].plane.plane.coefs, other[0].plane.plane.coefs);
    std::vector<uint32_t> expected;
    for (const uint32_t i : plain[0].inliers) expected.push_back(place[i]);
    EXPECT_EQ(other[0].inliers, expected);
}

TEST(extract_planes, farFromTheOriginFloatsAreTheLimit)
{
    PlaneParameters parameters;
    const double far = 2000;  // floats are 0.1 mm apart
    const auto planes = extract_planes(*table(-1, 2000, 0.01, far), parameters, {far, far, 1});
    ASSERT_EQ(planes.size(), 1u);
    EXPECT_GT(planes[0].plane.normal().z(), 0.9999);
    EXPECT_NEAR(planes[0].plane.centroid.z, -1, 0.002);
    EXPECT_NO_THROW(extract_planes(*table(-1, 2000, 0.01, 1e7), parameters, {1e7, 1e7, 1}));
    EXPECT_NO_THROW(extract_planes(*table(-1e30, 2000, 1e28, 1e30)));
}

TEST(extract_planes, exactDataHaveAPlaneToo)
{
    const auto planes = extract_planes(*table(-1, 2000, 0));
    ASSERT_EQ(planes.size(), 1u);
    EXPECT_NEAR(planes[0].plane.centroid.z, -1, 1e-7);
    EXPECT_LT(planes[0].plane.fit->sigma, 1e-7);
}

TEST(extract_planes, theSameBitsOnAnyNumberOfThreads)
{
    const auto world = scanned_room(1);
    const auto once = extract_planes(*world.scan.points);
    EXPECT_GE(once.size(), 6u);
    for (const int threads : {1, 2, 8})
        with_threads(threads, [&]() { expect_same(extract_planes(*world.scan.points), once); });
}

TEST(extract_planes, parametersOutOfRangeAreRefused)
{
    const auto cloud = table(-1);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const auto refused = [&](const std::string& name, const std::function<void(PlaneParameters&)>& spoil)
    {
        PlaneParameters p;
        spoil(p);
        expect_problem_with<std::invalid_argument>({name}, [&]() { extract_planes(*cloud, p); });
    };
    for (const double bad : {0.0, -1.0, nan})
    {
        refused("voxel_size", [bad](auto& p) { p.voxel_size = bad; });
        refused("maximum_noise", [bad](auto& p) { p.maximum_noise = bad; });
        refused("maximum_angle_deg", [bad](auto& p) { p.maximum_angle_deg = bad; });
        refused("maximum_angle_deviation_deg", [bad](auto& p) { p.maximum_angle_deviation_deg = bad; });
        refused("maximum_unevenness", [bad](auto& p) { p.maximum_unevenness = bad; });
    }
    refused("minimum_area", [](auto& p) { p.minimum_area = -1; });
    for (const double bad : {-1e-3, nan}) refused("roughness", [bad](auto& p) { p.roughness = bad; });
    refused("minimum_inliers", [](auto& p) { p.minimum_inliers = 3; });
    refused("voxel_levels", [](auto& p) { p.voxel_levels = 0; });
    expect_problem_with<std::invalid_argument>({"sensor"},
                                               [&]() {
                                                   extract_planes(*cloud, {}, {nan, 0, 0});
                                               });
}
