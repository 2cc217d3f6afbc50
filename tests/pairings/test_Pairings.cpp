#include <gtest/gtest.h>
#include <mp2p_icp/Pairings.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/random.h>
#include <mrpt/io/CMemoryStream.h>
#include <mrpt/opengl/CSetOfLines.h>
#include <sys/resource.h>

#include <cstring>

#include "expect_problem.h"

using namespace mp2p_icp;
using mrpt::serialization::archiveFrom;

namespace
{
mrpt::tfest::TMatchingPair_d pair_number(uint32_t i)
{
    mrpt::tfest::TMatchingPair_d p(i, i + 1000, i + 0.1, i + 0.2, i + 0.3, -1.0 / (i + 1),
                                   i * 1e7 + 0.123456789, 3);
    p.errorSquareAfterTransformation = i * 0.5 + 0.1;
    return p;
}

Pairings points(uint32_t first, uint32_t count, std::vector<std::pair<size_t, double>> weights = {})
{
    Pairings p;
    for (uint32_t i = first; i < first + count; i++) p.paired_pt2pt.push_back(pair_number(i));
    p.point_weights = std::move(weights);
    p.potential_pairings = 2 * count;
    return p;
}

plane_patch_t a_patch(double s)
{
    plane_patch_t p;
    p.plane.coefs = {0.1 * s, 0.2, 0.3, 0.4 / 3};
    p.centroid = {s, s + 0.1, -s};
    return p;
}

mrpt::math::TLine3D a_line(double s)
{
    mrpt::math::TLine3D l;
    l.pBase = {s, 1.0 / 3, 2};
    l.director = {0.6, 0.8 * s, 0};
    return l;
}

Pairings one_of_each()
{
    Pairings p = points(5, 3, {{1, 0.25}, {2, 1.0 / 3}});
    p.paired_pt2ln.push_back({a_line(1), {1, 2, 3}});
    p.paired_pt2pl.push_back({a_patch(2), {4, 5, 6}});
    p.paired_pt2pl.push_back({a_patch(3), {4, 5, 7}});
    p.paired_ln2ln.push_back({a_line(4), a_line(5)});
    p.paired_pl2pl.push_back({a_patch(6), a_patch(7)});
    p.potential_pairings = 123456789012345u;
    return p;
}

void expect_equal(const plane_patch_t& a, const plane_patch_t& b)
{
    EXPECT_EQ(a.plane.coefs, b.plane.coefs);
    EXPECT_EQ(a.centroid, b.centroid);
}
void expect_equal(const mrpt::math::TLine3D& a, const mrpt::math::TLine3D& b)
{
    EXPECT_EQ(a.pBase, b.pBase);
    EXPECT_EQ(a.director, b.director);
}
void expect_equal(const mrpt::tfest::TMatchingPair_d& a, const mrpt::tfest::TMatchingPair_d& b)
{
    EXPECT_EQ(a.globalIdx, b.globalIdx);
    EXPECT_EQ(a.localIdx, b.localIdx);
    EXPECT_EQ(mrpt::math::TPoint3D(a.global), mrpt::math::TPoint3D(b.global));
    EXPECT_EQ(mrpt::math::TPoint3D(a.local), mrpt::math::TPoint3D(b.local));
    const double error_a = a.errorSquareAfterTransformation, error_b = b.errorSquareAfterTransformation;
    EXPECT_EQ(error_a, error_b);
}
void expect_equal(const Pairings& a, const Pairings& b)
{
    ASSERT_EQ(a.paired_pt2pt.size(), b.paired_pt2pt.size());
    ASSERT_EQ(a.paired_pt2ln.size(), b.paired_pt2ln.size());
    ASSERT_EQ(a.paired_pt2pl.size(), b.paired_pt2pl.size());
    ASSERT_EQ(a.paired_ln2ln.size(), b.paired_ln2ln.size());
    ASSERT_EQ(a.paired_pl2pl.size(), b.paired_pl2pl.size());
    for (size_t i = 0; i < a.paired_pt2pt.size(); i++) expect_equal(a.paired_pt2pt[i], b.paired_pt2pt[i]);
    for (size_t i = 0; i < a.paired_pt2ln.size(); i++)
    {
        expect_equal(a.paired_pt2ln[i].ln_global, b.paired_pt2ln[i].ln_global);
        EXPECT_EQ(a.paired_pt2ln[i].pt_local, b.paired_pt2ln[i].pt_local);
    }
    for (size_t i = 0; i < a.paired_pt2pl.size(); i++)
    {
        expect_equal(a.paired_pt2pl[i].pl_global, b.paired_pt2pl[i].pl_global);
        EXPECT_EQ(a.paired_pt2pl[i].pt_local, b.paired_pt2pl[i].pt_local);
    }
    for (size_t i = 0; i < a.paired_ln2ln.size(); i++)
    {
        expect_equal(a.paired_ln2ln[i].ln_global, b.paired_ln2ln[i].ln_global);
        expect_equal(a.paired_ln2ln[i].ln_local, b.paired_ln2ln[i].ln_local);
    }
    for (size_t i = 0; i < a.paired_pl2pl.size(); i++)
    {
        expect_equal(a.paired_pl2pl[i].p_global, b.paired_pl2pl[i].p_global);
        expect_equal(a.paired_pl2pl[i].p_local, b.paired_pl2pl[i].p_local);
    }
    EXPECT_EQ(a.point_weights, b.point_weights);
    EXPECT_EQ(a.potential_pairings, b.potential_pairings);
}

std::vector<uint8_t> serialized(const Pairings& p)
{
    mrpt::io::CMemoryStream stream;
    auto out = archiveFrom(stream);
    out << p;
    const auto* begin = static_cast<const uint8_t*>(stream.getRawBufferData());
    return {begin, begin + stream.getTotalBytesCount()};
}

Pairings deserialized(const std::vector<uint8_t>& bytes)
{
    mrpt::io::CMemoryStream stream;
    stream.assignMemoryNotOwn(bytes.data(), bytes.size());
    auto in = archiveFrom(stream);
    Pairings p;
    in >> p;
    return p;
}
}  // namespace

TEST(MatchedPointList, TakesFloatPairsAndWholeListsOfThem)
{
    mrpt::tfest::TMatchingPair f(7, 8, 0.1f, 0.2f, 0.3f, 1.1f, 1.2f, 1.3f);
    f.errorSquareAfterTransformation = 0.7f;
    mrpt::tfest::TMatchingPairList list;
    list.push_back(f);
    f.globalIdx = 9;
    list.push_back(f);
    MatchedPointList pairs;
    pairs.push_back(f);
    pairs.push_back(list);
    pairs.push_back(pair_number(3));
    ASSERT_EQ(pairs.size(), 4u);
    mrpt::tfest::TMatchingPair_d expected(9, 8, double(0.1f), double(0.2f), double(0.3f), double(1.1f),
                                          double(1.2f), double(1.3f));
    expected.errorSquareAfterTransformation = double(0.7f);
    expect_equal(pairs[0], expected);
    expect_equal(pairs[2], expected);
    expected.globalIdx = 7;
    expect_equal(pairs[1], expected);
    expect_equal(pairs[3], pair_number(3));
}

TEST(Pairings, SizeCountsAllKinds)
{
    EXPECT_TRUE(Pairings().empty());
    EXPECT_EQ(Pairings().size(), 0u);
    const Pairings p = one_of_each();
    EXPECT_FALSE(p.empty());
    EXPECT_EQ(p.size(), 8u);
    Pairings only_planes;
    only_planes.paired_pl2pl = p.paired_pl2pl;
    EXPECT_FALSE(only_planes.empty());
}

TEST(Pairings, TheSummaryNamesKindsAndCounts)
{
    EXPECT_EQ(
        one_of_each().contents_summary(),
        "3 point-point, 1 point-line, 2 point-plane, 1 line-line, 1 plane-plane out of 123456789012345");
    EXPECT_EQ(Pairings().contents_summary(), "no pairings out of 0");
}

// ---- Weights ----------------------------------------------------------------------------------------------

TEST(Pairings, RunsOfWeightsExpandAndTheRestWeighsOne)
{
    EXPECT_EQ(points(0, 3).expanded_point_weights(), (std::vector<double>{1, 1, 1}));
    EXPECT_EQ(points(0, 5, {{2, 0.5}, {0, 9}, {1, 3}}).expanded_point_weights(),
              (std::vector<double>{0.5, 0.5, 3, 1, 1}));
    EXPECT_TRUE(points(0, 0, {{5, 2}}).expanded_point_weights().empty());
}

TEST(Pairings, RunsLongerThanTheListAreCutOff)
{
    EXPECT_EQ(points(0, 2, {{5, 2}}).expanded_point_weights(), (std::vector<double>{2, 2}));
    EXPECT_EQ(points(0, 2, {{SIZE_MAX, 2}, {SIZE_MAX, 3}}).expanded_point_weights(),
              (std::vector<double>{2, 2}));
    EXPECT_EQ(points(0, 3, {{1, 2}, {9, 3}, {9, 4}}).expanded_point_weights(),
              (std::vector<double>{2, 3, 3}));
}

TEST(Pairings, MergingKeepsTheWeightOfEachPair)
{
    // All ways in which lists may have weights: none, for all, for some, for more than there are.
    const std::vector<std::vector<std::pair<size_t, double>>> kinds = {
        {}, {{3, 2}}, {{1, 0.5}, {1, 4}}, {{2, 0}}, {{7, 5}}, {{1, 6}, {SIZE_MAX, 7}}};
    for (const auto& a : kinds)
        for (const auto& b : kinds)
            for (const auto& c : kinds)
                for (const uint32_t middle : {3u, 0u})
                {
                    Pairings merged = points(0, 3, a);
                    std::vector<double> expected = merged.expanded_point_weights();
                    for (const auto& next : {points(3, middle, b), points(6, 3, c)})
                    {
                        const auto w = next.expanded_point_weights();
                        expected.insert(expected.end(), w.begin(), w.end());
                        merged.push_back(next);
                    }
                    ASSERT_EQ(merged.expanded_point_weights(), expected);
                    ASSERT_EQ(merged.paired_pt2pt.size(), 6u + middle);
                }
}

TEST(Pairings, MergingAppendsAllKindsInOrderAndAddsThePotential)
{
    Pairings p = one_of_each();
    p.push_back(one_of_each());
    EXPECT_EQ(p.size(), 16u);
    EXPECT_EQ(p.potential_pairings, 2 * 123456789012345u);
    for (size_t i = 0; i < 3; i++)
    {
        expect_equal(p.paired_pt2pt[i], pair_number(static_cast<uint32_t>(5 + i)));
        expect_equal(p.paired_pt2pt[3 + i], pair_number(static_cast<uint32_t>(5 + i)));
    }
    EXPECT_EQ(p.paired_pt2pl[3].pt_local, mrpt::math::TPoint3D(4, 5, 7));
}

TEST(Pairings, MovingInGivesTheSameAsCopyingIn)
{
    for (const bool into_empty : {true, false})
    {
        Pairings copied = into_empty ? Pairings() : points(0, 2), moved = copied;
        copied.push_back(one_of_each());
        Pairings source = one_of_each();
        moved.push_back(std::move(source));
        expect_equal(moved, copied);
    }
    // A list without pairings may still have a potential.
    Pairings failed;
    failed.potential_pairings = 10;
    failed.push_back(points(0, 2));
    EXPECT_EQ(failed.potential_pairings, 14u);
    Pairings also_failed;
    also_failed.potential_pairings = 10;
    failed.push_back(std::move(also_failed));
    EXPECT_EQ(failed.potential_pairings, 24u);
}

TEST(Pairings, AListMayBeMergedWithItself)
{
    Pairings p = one_of_each(), expected = one_of_each();
    p.push_back(p);
    expected.push_back(one_of_each());
    expect_equal(p, expected);
}

// ---- Archives ---------------------------------------------------------------------------------------------

TEST(PairingsArchive, EverythingIsReadBackExactly)
{
    expect_equal(deserialized(serialized(one_of_each())), one_of_each());
    expect_equal(deserialized(serialized(Pairings())), Pairings());
}

TEST(PairingsArchive, ReadingReplacesWhatWasThere)
{
    const auto bytes = serialized(points(0, 2));
    mrpt::io::CMemoryStream stream;
    stream.assignMemoryNotOwn(bytes.data(), bytes.size());
    auto in = archiveFrom(stream);
    Pairings p = one_of_each();
    in >> p;
    expect_equal(p, points(0, 2));
}

TEST(PairingsArchive, SeveralStandOneAfterTheOther)
{
    mrpt::io::CMemoryStream stream;
    auto archive = archiveFrom(stream);
    archive << one_of_each() << points(1, 2);
    stream.Seek(0);
    Pairings a, b;
    archive >> a >> b;
    expect_equal(a, one_of_each());
    expect_equal(b, points(1, 2));
}

TEST(PairingsArchive, AnUnknownVersionIsNamed)
{
    auto bytes = serialized(points(0, 1));
    bytes[0] = 77;
    mp2p_icp_test::expect_problem_with<DataError>({"version 77"}, [&]() { deserialized(bytes); });
}

TEST(PairingsArchive, EveryTruncationIsADataError)
{
    const auto bytes = serialized(one_of_each());
    for (size_t length = 1; length < bytes.size(); length++)
        EXPECT_THROW(deserialized({bytes.begin(), bytes.begin() + static_cast<long>(length)}), DataError)
            << length;
}

TEST(PairingsArchive, DamagedCountsEndInADataErrorAndNotInAHugeAllocation)
{
    const auto good = serialized(points(0, 1));
    rusage before{};
    getrusage(RUSAGE_SELF, &before);
    // The first list's count stands behind the version; each byte of it is damaged in turn.
    for (size_t at = 1; at < 9; at++)
        for (const uint8_t value : {uint8_t(0x7f), uint8_t(0xff)})
        {
            auto bytes = good;
            bytes[at] = value;
            EXPECT_THROW(deserialized(bytes), DataError) << at;
        }
    rusage after{};
    getrusage(RUSAGE_SELF, &after);
    EXPECT_LT(after.ru_maxrss - before.ru_maxrss, 50 * 1024);  // kB
}

TEST(PairingsArchive, RandomDamageNeverCrashes)
{
    const auto good = serialized(one_of_each());
    SeededRandom random(1);
    int refused = 0;
    for (int i = 0; i < 3000; i++)
    {
        auto bytes = good;
        for (size_t k = 0; k <= random.index(4); k++)
            bytes[random.index(bytes.size())] = static_cast<uint8_t>(random.index(256));
        try
        {
            const Pairings p = deserialized(bytes);
            EXPECT_EQ(p.expanded_point_weights().size(), p.paired_pt2pt.size());
        }
        catch (const DataError&)
        {
            refused++;
        }
    }
    EXPECT_GT(refused, 100);
}

// ---- Pictures ---------------------------------------------------------------------------------------------

TEST(PairingsVisualization, SegmentsJoinGlobalPointsAndMovedLocalOnes)
{
    const Pairings p = points(0, 3);
    const mrpt::poses::CPose3D pose(1, 2, 3, 0.4, 0.5, 0.6);
    const auto scene = p.get_visualization(pose);
    const auto lines = scene->getByClass<mrpt::opengl::CSetOfLines>();
    ASSERT_TRUE(lines);
    ASSERT_EQ(lines->getLineCount(), 3u);
    for (size_t i = 0; i < 3; i++)
    {
        double x0 = 0, y0 = 0, z0 = 0, x1 = 0, y1 = 0, z1 = 0;
        lines->getLineByIndex(i, x0, y0, z0, x1, y1, z1);
        const auto moved = pose.composePoint(mrpt::math::TPoint3D(p.paired_pt2pt[i].local));
        EXPECT_NEAR(x0, p.paired_pt2pt[i].global.x, 1e-6);
        EXPECT_NEAR(x1, moved.x, 1e-7 * (1 + std::abs(moved.x)));
        EXPECT_NEAR(z1, moved.z, 1e-7 * (1 + std::abs(moved.z)));
    }
}

TEST(PairingsVisualization, NothingIsDrawnWhenThereIsNothingOrItIsSwitchedOff)
{
    EXPECT_TRUE(Pairings().get_visualization({})->empty());
    pairings_render_params_t off;
    off.pt2pt = false;
    EXPECT_TRUE(points(0, 3).get_visualization({}, off)->empty());
}
