#include <gtest/gtest.h>
#include <mp2p_icp/metricmap.h>
#include <mrpt/maps/COccupancyGridMap2D.h>
#include <mrpt/maps/CPointsMapXYZI.h>
#include <mrpt/maps/CSimplePointsMap.h>
#include <mrpt/poses/CPose3D.h>

#include <cmath>
#include <limits>
#include <thread>

using namespace mp2p_icp;
using mrpt::maps::CPointsMapXYZI;
using mrpt::maps::CSimplePointsMap;
using mrpt::math::TPoint3D;
using mrpt::math::TPose3D;

namespace
{
CSimplePointsMap::Ptr cloud(const std::vector<TPoint3D>& points)
{
    const auto m = CSimplePointsMap::Create();
    for (const auto& p : points) m->insertPoint(p);
    return m;
}

TPoint3D point(const mrpt::maps::CPointsMap& m, size_t i)
{
    TPoint3D p;
    m.getPoint(i, p);
    return p;
}

plane_patch_t plane_z(double z)
{
    return {mrpt::math::TPlane(0, 0, 1, -z), {1, 2, z}};
}
mrpt::math::TLine3D line_along_x()
{
    return mrpt::math::TLine3D::FromPointAndDirector({0, 1, 0}, {1, 0, 0});
}

template <class Work>
std::string refusal(const Work& work)
{
    try
    {
        work();
    }
    catch (const std::invalid_argument& e)
    {
        return e.what();
    }
    return "nothing was thrown";
}
}  // namespace

TEST(MetricMap, IsEmptyOnlyWithoutAnyLayerPlaneOrLine)
{
    metric_map_t m;
    EXPECT_TRUE(m.empty());
    EXPECT_EQ(m.size(), 0u);
    m.layers["raw"] = cloud({});
    EXPECT_FALSE(m.empty());
    EXPECT_EQ(m.size(), 0u);
    metric_map_t with_plane, with_line;
    with_plane.planes.push_back(plane_z(1));
    with_line.lines.push_back(line_along_x());
    EXPECT_FALSE(with_plane.empty());
    EXPECT_FALSE(with_line.empty());
}

TEST(MetricMap, CountsPointsPlanesAndLinesAndClearsThem)
{
    metric_map_t m;
    m.layers["a"] = cloud({{1, 2, 3}, {4, 5, 6}});
    m.layers["b"] = cloud({{7, 8, 9}});
    m.layers["grid"] = mrpt::maps::COccupancyGridMap2D::Create();
    m.planes.push_back(plane_z(1));
    m.lines.assign(2, line_along_x());
    m.id = 7, m.label = "here";
    m.set_coordinate_offset({1000, 0, 0});
    EXPECT_EQ(m.size_points_only(), 3u);
    EXPECT_EQ(m.size(), 6u);
    m.clear();
    EXPECT_TRUE(m.empty());
    EXPECT_FALSE(m.id || m.label);
    EXPECT_EQ(m.coordinate_offset(), TPoint3D(0, 0, 0));
}

TEST(MetricMap, SummaryNamesWhatIsThere)
{
    metric_map_t m;
    EXPECT_EQ(m.contents_summary(), "empty");
    m.layers["raw"] = cloud({{1, 2, 3}, {4, 5, 6}});
    m.planes.assign(3, plane_z(0));
    m.lines.assign(4, line_along_x());
    EXPECT_EQ(m.contents_summary(), "3 planes, 4 lines, 2 points in \"raw\"");
}

TEST(MetricMap, CopiesShareLayersButAreMapsOfTheirOwn)
{
    metric_map_t m;
    m.layers["raw"] = cloud({{1, 2, 3}});
    m.label = "first";
    metric_map_t copy = m;
    EXPECT_EQ(copy.layers.at("raw"), m.layers.at("raw"));
    copy.layers["raw"] = cloud({{0, 0, 0}, {1, 1, 1}});
    copy.label = "second";
    EXPECT_EQ(m.size(), 1u);
    EXPECT_EQ(*m.label, "first");
    m = copy;
    EXPECT_EQ(m.size(), 2u);
    EXPECT_EQ(*m.label, "second");
}

TEST(MetricMap, PointLayerNamesWhatIsMissingAndWhatIsNotACloud)
{
    metric_map_t m;
    m.layers["raw"] = cloud({{1, 2, 3}});
    m.layers["grid"] = mrpt::maps::COccupancyGridMap2D::Create();
    EXPECT_EQ(m.point_layer("raw"), m.layers["raw"]);
    const auto missing = refusal([&]() { m.point_layer("rew"); });
    EXPECT_NE(missing.find("'rew'"), std::string::npos) << missing;
    EXPECT_NE(missing.find("'grid', 'raw'"), std::string::npos) << missing;
    const auto grid = refusal([&]() { m.point_layer("grid"); });
    EXPECT_NE(grid.find("COccupancyGridMap2D"), std::string::npos) << grid;
}

TEST(MetricMap, BoundingBoxIsAroundThePointsOfAllCloudLayers)
{
    metric_map_t m;
    EXPECT_FALSE(m.bounding_box());
    m.layers["empty"] = cloud({});
    m.planes.push_back(plane_z(100));
    EXPECT_FALSE(m.bounding_box()) << "planes do not count";
    m.layers["a"] = cloud({{5, -1, 3}});
    m.layers["b"] = cloud({{1, 2, 3}, {4, 5, 8}});
    const auto box = m.bounding_box();
    ASSERT_TRUE(box);
    EXPECT_EQ(box->min, TPoint3D(1, -1, 3));
    EXPECT_EQ(box->max, TPoint3D(5, 5, 8));
}

TEST(MetricMap, BoundingBoxIgnoresPointsThatAreNotFinite)
{
    metric_map_t m;
    const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
    m.layers["a"] = cloud({{nan, 50, 50}, {1, 2, 3}, {2, inf, 3}});
    const auto box = m.bounding_box();
    ASSERT_TRUE(box);
    EXPECT_EQ(box->min, TPoint3D(1, 2, 3));
    EXPECT_EQ(box->max, TPoint3D(1, 2, 3));
    m.layers["a"] = cloud({{nan, 0, 0}});
    EXPECT_FALSE(m.bounding_box());
}

TEST(MetricMap, BoundingBoxMayBeAskedForByManyThreads)
{
    metric_map_t m;
    m.layers["a"] = cloud({{1, 2, 3}, {4, 5, 6}});
    std::vector<std::thread> threads;
    std::vector<double> seen(8, 0);
    for (auto& s : seen) threads.emplace_back([&]() { s = m.bounding_box()->max.z; });
    for (auto& t : threads) t.join();
    EXPECT_EQ(seen, std::vector<double>(8, 6.0));
}

// ---- Merging ----------------------------------------------------------------------------------------------

TEST(MetricMap, MergingMovesPointsPlanesAndLines)
{
    const mrpt::poses::CPose3D pose(1, 2, 3, 0.5, -0.4, 0.3);
    metric_map_t mine, other;
    mine.layers["common"] = cloud({{9, 9, 9}});
    other.layers["common"] = cloud({{1, 0, 0}});
    other.layers["new"] = cloud({{0, 1, 0}});
    other.planes.push_back(plane_z(2));
    other.lines.push_back(line_along_x());
    mine.merge_with(other, pose.asTPose());

    const auto common = mine.point_layer("common");
    ASSERT_EQ(common->size(), 2u);
    EXPECT_EQ(point(*common, 0), TPoint3D(9, 9, 9));
    EXPECT_LT((point(*common, 1) - pose.composePoint({1, 0, 0})).norm(), 1e-6);
    EXPECT_LT((point(*mine.point_layer("new"), 0) - pose.composePoint({0, 1, 0})).norm(), 1e-6);

    ASSERT_EQ(mine.planes.size(), 1u);  // any three points of the plane, moved, lie on the moved plane
    for (const auto& p : {TPoint3D(0, 0, 2), TPoint3D(5, 0, 2), TPoint3D(0, -7, 2)})
        EXPECT_NEAR(mine.planes[0].plane.evaluatePoint(pose.composePoint(p)), 0, 1e-12);
    EXPECT_LT((mine.planes[0].centroid - pose.composePoint({1, 2, 2})).norm(), 1e-12);
    const auto normal = pose.rotateVector({0, 0, 1});
    EXPECT_LT((mine.planes[0].plane.getNormalVector() - mrpt::math::TVector3D(normal)).norm(), 1e-12)
        << "the side of the normal must stay";

    ASSERT_EQ(mine.lines.size(), 1u);
    for (const double s : {-3.0, 0.0, 4.0})
        EXPECT_NEAR(mine.lines[0].distance(pose.composePoint({s, 1, 0})), 0, 1e-9);
}

TEST(MetricMap, MergingDoesNotTouchTheOtherMapNorSharedLayers)
{
    metric_map_t mine, other;
    mine.layers["a"] = cloud({{1, 1, 1}});
    const metric_map_t sharer = mine;
    other.layers["a"] = cloud({{2, 2, 2}});
    other.layers["b"] = cloud({{3, 3, 3}});
    mine.merge_with(other, TPose3D(10, 0, 0, 0, 0, 0));
    EXPECT_EQ(sharer.point_layer("a")->size(), 1u);
    EXPECT_EQ(point(*other.point_layer("a"), 0), TPoint3D(2, 2, 2));
    EXPECT_EQ(point(*other.point_layer("b"), 0), TPoint3D(3, 3, 3));
    mine.point_layer("b")->insertPoint(0, 0, 0);
    EXPECT_EQ(other.point_layer("b")->size(), 1u);
}

TEST(MetricMap, MergingKeepsIntensity)
{
    metric_map_t mine, other;
    for (auto* m : {&mine, &other})
    {
        const auto c = CPointsMapXYZI::Create();
        c->insertPoint(1, 2, 3);
        c->setPointIntensity(0, m == &mine ? 0.25f : 0.75f);
        m->layers["raw"] = c;
    }
    mine.merge_with(other, TPose3D(1, 0, 0, 0, 0, 0));
    const auto c = std::dynamic_pointer_cast<CPointsMapXYZI>(mine.layers["raw"]);
    ASSERT_TRUE(c);
    EXPECT_EQ(c->getPointIntensity(0), 0.25f);
    EXPECT_EQ(c->getPointIntensity(1), 0.75f);
}

TEST(MetricMap, MergingAMapWithItselfDoublesIt)
{
    metric_map_t m;
    m.layers["raw"] = cloud({{1, 2, 3}, {4, 5, 6}});
    m.planes.push_back(plane_z(1));
    m.lines.push_back(line_along_x());
    m.merge_with(m, TPose3D(0, 0, 1, 0, 0, 0));
    EXPECT_EQ(m.size_points_only(), 4u);
    ASSERT_EQ(m.planes.size(), 2u);
    EXPECT_EQ(m.lines.size(), 2u);
    EXPECT_NEAR(m.planes[1].centroid.z, 2, 1e-12);
}

TEST(MetricMap, AMergeThatCannotBeMadeIsRefusedAndChangesNothing)
{
    metric_map_t mine, other;
    mine.layers["a"] = cloud({{1, 1, 1}});
    mine.layers["grid"] = mrpt::maps::COccupancyGridMap2D::Create();
    other.layers["a"] = cloud({{2, 2, 2}});
    other.layers["grid"] = mrpt::maps::COccupancyGridMap2D::Create();
    EXPECT_NE(refusal([&]() { mine.merge_with(other); }).find("'grid'"), std::string::npos);
    mine.layers.erase("grid");
    EXPECT_NE(refusal([&]() { mine.merge_with(other, TPose3D(1, 0, 0, 0, 0, 0)); }).find("'grid'"),
              std::string::npos);
    EXPECT_EQ(mine.size_points_only(), 1u);
    EXPECT_EQ(mine.layers.size(), 1u);
    mine.merge_with(other);  // without a pose, and new: copied
    EXPECT_EQ(mine.layers.count("grid"), 1u);
}

TEST(MetricMap, MergingWithoutAPoseAccountsForDifferentOffsets)
{
    metric_map_t mine, other, fresh;
    mine.layers["raw"] = cloud({{1, 0, 0}});
    mine.set_coordinate_offset({500000, 4000000, 0});
    other.layers["raw"] = cloud({{2, 3, 4}});
    other.set_coordinate_offset({500010, 4000020, 30});
    fresh.merge_with(other);
    EXPECT_EQ(fresh.coordinate_offset(), TPoint3D(500010, 4000020, 30));
    EXPECT_EQ(point(*fresh.point_layer("raw"), 0), TPoint3D(2, 3, 4));
    mine.merge_with(other);
    EXPECT_EQ(mine.coordinate_offset(), TPoint3D(500000, 4000000, 0));
    EXPECT_EQ(point(*mine.point_layer("raw"), 1), TPoint3D(12, 23, 34));
}

// ---- Offset -----------------------------------------------------------------------------------------------

TEST(MetricMap, CoordinateOffsetIsKeptExactlyInTheMetadata)
{
    metric_map_t m;
    EXPECT_EQ(m.coordinate_offset(), TPoint3D(0, 0, 0));
    const TPoint3D utm(432109, 4065432, -7);
    m.set_coordinate_offset(utm);
    EXPECT_EQ(m.coordinate_offset(), utm);
    EXPECT_TRUE(m.metadata.has("coordinate_offset"));
    m.set_coordinate_offset({0, 0, 0});
    EXPECT_FALSE(m.metadata.has("coordinate_offset"));
    m.metadata["coordinate_offset"] = "nonsense";
    EXPECT_THROW(m.coordinate_offset(), std::invalid_argument);
}

// ---- Index cache ------------------------------------------------------------------------------------------

TEST(MetricMap, IndexIsMadeOnceAndAgainWhenTheLayerChanges)
{
    metric_map_t m;
    const auto layer = cloud({{1, 2, 3}, {4, 5, 6}});
    m.layers["raw"] = layer;
    const auto first = m.nn_index("raw");
    EXPECT_EQ(first, m.nn_index("raw"));
    EXPECT_NE(first, m.nn_index("raw", 3)) << "another leaf size is another index";
    const auto before = m.nn_index("raw");
    layer->setPoint(1, 4.0f, 5.0f, 7.0f);
    const auto moved = m.nn_index("raw");
    EXPECT_NE(before, moved) << "one coordinate has changed in place";
    layer->insertPoint(7, 8, 9);
    EXPECT_EQ(m.nn_index("raw")->size(), 3u);
    m.layers["raw"] = cloud({{1, 2, 3}});
    EXPECT_EQ(m.nn_index("raw")->size(), 1u) << "another cloud under the same name";
    EXPECT_THROW(m.nn_index("no such layer"), std::invalid_argument);
}

TEST(MetricMap, SwappedPointsChangeTheFingerprint)
{
    EXPECT_NE(coordinates_fingerprint(*cloud({{1, 2, 3}, {4, 5, 6}})),
              coordinates_fingerprint(*cloud({{4, 5, 6}, {1, 2, 3}})));
    const auto c = cloud({{1, 2, 3}});
    const auto before = coordinates_fingerprint(*c);
    EXPECT_EQ(before, coordinates_fingerprint(*c));
    c->setPoint(0, 1.0f, 3.0f, 2.0f);
    EXPECT_NE(before, coordinates_fingerprint(*c));
}

TEST(MetricMap, CopiesDoNotShareIndexes)
{
    metric_map_t m;
    m.layers["raw"] = cloud({{1, 2, 3}});
    const auto index = m.nn_index("raw");
    const metric_map_t copy = m;
    EXPECT_NE(copy.nn_index("raw"), index);
}

TEST(MetricMap, ManyThreadsGetOneIndex)
{
    metric_map_t m;
    m.layers["raw"] = cloud({{1, 2, 3}, {4, 5, 6}});
    std::vector<NearestNeighborIndex::ConstPtr> seen(8);
    std::vector<std::thread> threads;
    for (auto& s : seen) threads.emplace_back([&]() { s = m.nn_index("raw"); });
    for (auto& t : threads) t.join();
    for (const auto& s : seen) EXPECT_EQ(s, seen[0]);
}

// ---- Sharing and drawing ----------------------------------------------------------------------------------

TEST(MetricMap, SharedFromThisIsTheObjectAndOfAStackObjectACopy)
{
    const auto owned = std::make_shared<metric_map_t>();
    EXPECT_EQ(owned->get_shared_from_this_or_clone(), owned);
    metric_map_t on_stack;
    on_stack.label = "x";
    const auto copy = on_stack.get_shared_from_this_or_clone();
    EXPECT_NE(copy.get(), &on_stack);
    EXPECT_EQ(*copy->label, "x");
}

TEST(MetricMap, DrawsWhatIsVisible)
{
    metric_map_t m;
    m.layers["raw"] = cloud({{1, 2, 3}});
    m.planes.push_back(plane_z(1));
    m.lines.push_back(line_along_x());
    EXPECT_EQ(m.get_visualization()->size(), 3u);
    render_params_t p;
    p.planes.visible = p.lines.visible = p.points.visible = false;
    EXPECT_EQ(m.get_visualization(p)->size(), 0u);
    p.points.visible = true;
    p.points.perLayer["another"] = {};
    EXPECT_EQ(m.get_visualization(p)->size(), 0u) << "only the layers that are named";
}
