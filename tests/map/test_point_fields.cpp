#include <gtest/gtest.h>
#include <mp2p_icp/point_fields.h>
#include <mrpt/maps/CColouredPointsMap.h>
#include <mrpt/maps/CPointsMapXYZI.h>
#include <mrpt/maps/CSimplePointsMap.h>
#include <mrpt/maps/CWeightedPointsMap.h>

#include <cmath>
#include <limits>

using namespace mp2p_icp;
using namespace mrpt::maps;

namespace
{
std::vector<float> fields(const CPointsMap& m, size_t i)
{
    std::vector<float> f;
    m.getPointAllFields(i, f);
    return f;
}

/// Three points with every field of the class different.
template <class Map>
Map filled()
{
    Map m;
    m.resize(3);
    std::vector<float> f;
    for (size_t i = 0; i < 3; i++)
    {
        m.getPointAllFieldsFast(i, f);
        for (size_t k = 0; k < f.size(); k++) f[k] = static_cast<float>(1 + i * 10 + k);
        m.setPointAllFieldsFast(i, f);
    }
    m.mark_as_modified();
    return m;
}

template <class Map>
class PointFields : public ::testing::Test
{
};
using Classes = ::testing::Types<CSimplePointsMap, CPointsMapXYZI, CColouredPointsMap, CWeightedPointsMap>;
TYPED_TEST_SUITE(PointFields, Classes);
}  // namespace

TYPED_TEST(PointFields, AppendingToTheSameClassKeepsEveryFieldAndTheOrder)
{
    const TypeParam from = filled<TypeParam>();
    TypeParam to = filled<TypeParam>();
    append_points(to, from, {2, 0, 2});
    ASSERT_EQ(to.size(), 6u);
    for (size_t i = 0; i < 3; i++) EXPECT_EQ(fields(to, i), fields(from, i)) << "what was there must stay";
    EXPECT_EQ(fields(to, 3), fields(from, 2));
    EXPECT_EQ(fields(to, 4), fields(from, 0));
    EXPECT_EQ(fields(to, 5), fields(from, 2));
}

TYPED_TEST(PointFields, AppendingToAnotherClassKeepsCoordinates)
{
    const TypeParam from = filled<TypeParam>();
    CPointsMapXYZI to;
    append_points(to, from, {1});
    EXPECT_EQ(fields(to, 0)[0], 11.0f);
    EXPECT_EQ(fields(to, 0)[1], 12.0f);
    EXPECT_EQ(fields(to, 0)[2], 13.0f);
}

TYPED_TEST(PointFields, ANewCloudLikeAnotherIsEmptyAndOfItsClassAndOptions)
{
    TypeParam from = filled<TypeParam>();
    from.renderOptions.point_size = 7.0f;
    from.insertionOptions.minDistBetweenLaserPoints = 0.5f;
    const auto like = new_cloud_like(from);
    EXPECT_TRUE(like->empty());
    EXPECT_EQ(like->GetRuntimeClass(), from.GetRuntimeClass());
    EXPECT_EQ(like->renderOptions.point_size, 7.0f);
    EXPECT_EQ(like->insertionOptions.minDistBetweenLaserPoints, 0.5f);
}

TYPED_TEST(PointFields, MovingPointsLeavesEarlierPointsAndOtherFieldsAlone)
{
    const TypeParam before = filled<TypeParam>();
    TypeParam after = filled<TypeParam>();
    const mrpt::poses::CPose3D pose(1, 2, 3, 0.4, 0.5, 0.6);
    move_points(after, 1, pose);
    EXPECT_EQ(fields(after, 0), fields(before, 0));
    for (size_t i = 1; i < 3; i++)
    {
        auto expected = fields(before, i);
        const auto moved = pose.composePoint(mrpt::math::TPoint3D(expected[0], expected[1], expected[2]));
        expected[0] = static_cast<float>(moved.x), expected[1] = static_cast<float>(moved.y),
        expected[2] = static_cast<float>(moved.z);
        EXPECT_EQ(fields(after, i), expected);
    }
}

TEST(PointFieldsFree, ChangesAreSeenByTheCachesOfTheCloud)
{
    CSimplePointsMap to, from;
    to.insertPoint(0, 0, 0);
    EXPECT_EQ(to.boundingBox().max.x, 0.0f);  // fills the cache
    from.insertPoint(5, 0, 0);
    append_points(to, from, {0});
    EXPECT_EQ(to.boundingBox().max.x, 5.0f);
    move_points(to, 0, mrpt::poses::CPose3D(1, 0, 0, 0, 0, 0));
    EXPECT_EQ(to.boundingBox().max.x, 6.0f);
}

TEST(PointFieldsFree, ColoursBecomeIntensityByLuminance)
{
    CColouredPointsMap from;
    from.insertPointRGB(1, 2, 3, 0.5f, 0.25f, 1.0f);
    CPointsMapXYZI to;
    append_points(to, from, {0});
    EXPECT_NEAR(to.getPointIntensity(0), 0.299 * 0.5 + 0.587 * 0.25 + 0.114, 1e-6);
}

TEST(PointFieldsFree, FinitePointsAreFound)
{
    const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
    CSimplePointsMap m;
    m.insertPoint(1, 1, 1);
    m.insertPoint(nan, 1, 1);
    m.insertPoint(1, inf, 1);
    m.insertPoint(1, 1, -inf);
    m.insertPoint(2, 2, std::numeric_limits<float>::max());
    EXPECT_EQ(finite_points(m), (std::vector<size_t>{0, 4}));
    EXPECT_TRUE(finite_points(CSimplePointsMap()).empty());
}

TEST(PointFieldsFree, CloudsAreMadeByNameAndOtherNamesAreRefused)
{
    EXPECT_EQ(new_cloud("mrpt::maps::CPointsMapXYZI")->GetRuntimeClass(), CLASS_ID(CPointsMapXYZI));
    for (const char* wrong :
         {"mrpt::maps::CPointsMapXYZL", "mrpt::maps::COccupancyGridMap2D", "mrpt::maps::CPointsMap", ""})
        try
        {
            new_cloud(wrong);
            ADD_FAILURE() << wrong;
        }
        catch (const std::invalid_argument& e)
        {
            EXPECT_NE(std::string(e.what()).find("'" + std::string(wrong) + "'"), std::string::npos);
        }
    try
    {
        new_cloud("mrpt::maps::CPointsMapXYZL");
    }
    catch (const std::invalid_argument& e)
    {
        EXPECT_NE(std::string(e.what()).find("did you mean 'mrpt::maps::CPointsMapXYZI'"), std::string::npos)
            << e.what();
    }
}
