#include <gtest/gtest.h>
#include <mp2p_icp/Pairings.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/random.h>
#include <mrpt/io/CMemoryStream.h>
#include <sys/resource.h>

#include <array>
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

Pairings points(uint32_t first, uint32_t count, WeightRuns weights = {})
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

/// As one_of_each(), and weights that differ in everything: kinds, lengths, values.
Pairings one_of_each_weighted()
{
    Pairings p = one_of_each();
    p.pt2ln_weights = {{1, 0.125}};
    p.pt2pl_weights = {{1, 2.0 / 3}, {1, 5}};
    p.ln2ln_weights = {{1, 7}, {0, 8}, {2, 9}};
    p.pl2pl_weights = {{SIZE_MAX, 1e-9}};
    return p;
}

/// Calls work(list, weights, name) with pointers to both members of each kind.
template <class Work>
void for_each_kind(const Work& work)
{
    work(&Pairings::paired_pt2pt, &Pairings::point_weights, "pt2pt");
    work(&Pairings::paired_pt2ln, &Pairings::pt2ln_weights, "pt2ln");
    work(&Pairings::paired_pt2pl, &Pairings::pt2pl_weights, "pt2pl");
    work(&Pairings::paired_ln2ln, &Pairings::ln2ln_weights, "ln2ln");
    work(&Pairings::paired_pl2pl, &Pairings::pl2pl_weights, "pl2pl");
}

/// The expanded weights of all kinds.
std::vector<std::vector<double>> all_weights(const Pairings& p)
{
    std::vector<std::vector<double>> out;
    for_each_kind([&](auto list, auto weights, const char*)
                  { out.push_back(expanded_weights(p.*weights, (p.*list).size())); });
    return out;
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
    EXPECT_EQ(a.pt2ln_weights, b.pt2ln_weights);
    EXPECT_EQ(a.pt2pl_weights, b.pt2pl_weights);
    EXPECT_EQ(a.ln2ln_weights, b.ln2ln_weights);
    EXPECT_EQ(a.pl2pl_weights, b.pl2pl_weights);
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
    // Each kind alone, so that no two can be exchanged.
    const char* const names[] = {"point-point", "point-line", "point-plane", "line-line", "plane-plane"};
    size_t kind = 0;
    for_each_kind(
        [&](auto list, auto, const char*)
        {
            Pairings p;
            (p.*list).resize(kind + 2);
            EXPECT_EQ(p.contents_summary(), std::to_string(kind + 2) + " " + names[kind] + " out of 0");
            kind++;
        });
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

TEST(Pairings, ExpandedWeightsDependOnTheRunsAndTheCountOnly)
{
    const WeightRuns runs = {{2, 0.5}, {0, 9}, {1, 3}};
    EXPECT_EQ(expanded_weights(runs, 5), (std::vector<double>{0.5, 0.5, 3, 1, 1}));
    EXPECT_EQ(expanded_weights(runs, 3), (std::vector<double>{0.5, 0.5, 3}));
    EXPECT_EQ(expanded_weights(runs, 1), (std::vector<double>{0.5}));
    EXPECT_TRUE(expanded_weights(runs, 0).empty());
    EXPECT_EQ(expanded_weights({}, 2), (std::vector<double>{1, 1}));
    EXPECT_EQ(expanded_weights({{SIZE_MAX, 2}, {SIZE_MAX, 3}}, 2), (std::vector<double>{2, 2}));
    EXPECT_EQ(one_of_each_weighted().expanded_point_weights(), (std::vector<double>{0.25, 1.0 / 3, 1.0 / 3}));
}

namespace
{
/// All ways in which three pairs may have weights: none, for all, for some, zero, for more than there are.
const std::vector<WeightRuns> KINDS_OF_RUNS = {{},       {{3, 2}}, {{1, 0.5}, {1, 4}},
                                               {{2, 0}}, {{7, 5}}, {{1, 6}, {SIZE_MAX, 7}}};

/// Three lists of one kind, the middle one perhaps empty, are merged; each pair must keep its weight.
template <class List>
void expect_weights_survive_merging(List Pairings::*list, WeightRuns Pairings::*weights, size_t middle,
                                    const WeightRuns& a, const WeightRuns& b, const WeightRuns& c)
{
    const auto part = [&](size_t count, const WeightRuns& runs)
    {
        Pairings p;
        (p.*list).resize(count), p.*weights = runs;
        return p;
    };
    Pairings merged = part(3, a), moved = part(3, a);
    std::vector<double> expected = expanded_weights(a, 3);
    for (const auto& next : {part(middle, b), part(3, c)})
    {
        const auto w = expanded_weights(next.*weights, (next.*list).size());
        expected.insert(expected.end(), w.begin(), w.end());
        merged.push_back(next);
        moved.push_back(Pairings(next));
    }
    ASSERT_EQ((merged.*list).size(), 6 + middle);
    ASSERT_EQ(merged.size(), 6 + middle);
    expected.push_back(1);  // no run reaches beyond the pairs: one that is appended later weighs 1
    ASSERT_EQ(expanded_weights(merged.*weights, 7 + middle), expected);
    ASSERT_EQ(moved.*weights, merged.*weights);
}
}  // namespace

TEST(Pairings, MergingKeepsTheWeightOfEachPairOfEachKind)
{
    for_each_kind(
        [](auto list, auto weights, const char* name)
        {
            SCOPED_TRACE(name);
            for (const auto& a : KINDS_OF_RUNS)
                for (const auto& b : KINDS_OF_RUNS)
                    for (const auto& c : KINDS_OF_RUNS)
                        for (const size_t middle : {3u, 0u})
                            expect_weights_survive_merging(list, weights, middle, a, b, c);
        });
}

TEST(Pairings, MergingDoesNotMixTheWeightsOfKinds)
{
    Pairings p = one_of_each();
    p.point_weights.clear();
    p.push_back(one_of_each_weighted());
    p.push_back(one_of_each());
    using Weights = std::vector<double>;
    EXPECT_EQ(all_weights(p),
              (std::vector<Weights>{Weights{1, 1, 1, 0.25, 1.0 / 3, 1.0 / 3, 0.25, 1.0 / 3, 1.0 / 3},
                                    Weights{1, 0.125, 1}, Weights{1, 1, 2.0 / 3, 5, 1, 1}, Weights{1, 7, 1},
                                    Weights{1, 1e-9, 1}}));
}

TEST(Pairings, MergingListsWithoutWeightsMakesNone)
{
    Pairings p;
    for_each_kind([&](auto list, auto, const char*) { (p.*list).resize(2); });
    p.push_back(Pairings(p));
    p.push_back(p);
    EXPECT_EQ(p.size(), 40u);
    for_each_kind([&](auto, auto weights, const char* name) { EXPECT_TRUE((p.*weights).empty()) << name; });
}

TEST(Pairings, AppendingNothingChangesNoWeight)
{
    const auto before = all_weights(one_of_each_weighted());
    Pairings with_runs_only;
    for_each_kind([&](auto, auto weights, const char*) { with_runs_only.*weights = {{4, 77}}; });
    for (const auto& nothing : {Pairings(), with_runs_only})
    {
        Pairings p = one_of_each_weighted(), q = nothing;
        p.push_back(nothing);
        EXPECT_EQ(all_weights(p), before);
        p.push_back(one_of_each());  // not weighted by runs that were left over
        q.push_back(one_of_each_weighted());
        EXPECT_EQ(all_weights(q), before);
        EXPECT_EQ(all_weights(p)[1], (std::vector<double>{0.125, 1}));
        EXPECT_EQ(all_weights(p)[4], (std::vector<double>{1e-9, 1}));
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
        copied.push_back(one_of_each_weighted());
        Pairings source = one_of_each_weighted();
        moved.push_back(std::move(source));
        EXPECT_EQ(all_weights(moved), all_weights(copied));
        for (Pairings* p : {&moved, &copied})
            for_each_kind([&](auto, auto weights, const char*) { (p->*weights).clear(); });
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

TEST(Pairings, MovingIntoAnEmptyListCopiesNothing)
{
    Pairings source = one_of_each_weighted(), target;
    const auto* points_at = source.paired_pt2pt.data();
    const auto* planes_at = source.paired_pl2pl.data();
    target.push_back(std::move(source));
    EXPECT_EQ(target.paired_pt2pt.data(), points_at);
    EXPECT_EQ(target.paired_pl2pl.data(), planes_at);
    expect_equal(target, one_of_each_weighted());
}

TEST(Pairings, AListMayBeMergedWithItself)
{
    Pairings p = one_of_each_weighted(), expected = one_of_each_weighted();
    p.push_back(p);
    expected.push_back(one_of_each_weighted());
    expect_equal(p, expected);
    EXPECT_EQ(all_weights(p)[2], (std::vector<double>{2.0 / 3, 5, 2.0 / 3, 5}));
}

// ---- Archives ---------------------------------------------------------------------------------------------

TEST(PairingsArchive, EverythingIsReadBackExactly)
{
    expect_equal(deserialized(serialized(one_of_each())), one_of_each());
    expect_equal(deserialized(serialized(one_of_each_weighted())), one_of_each_weighted());
    expect_equal(deserialized(serialized(Pairings())), Pairings());
}

TEST(PairingsArchive, ReadingReplacesWhatWasThere)
{
    const auto bytes = serialized(points(0, 2));
    mrpt::io::CMemoryStream stream;
    stream.assignMemoryNotOwn(bytes.data(), bytes.size());
    auto in = archiveFrom(stream);
    Pairings p = one_of_each_weighted();
    in >> p;
    expect_equal(p, points(0, 2));
}

TEST(PairingsArchive, SeveralStandOneAfterTheOther)
{
    mrpt::io::CMemoryStream stream;
    auto archive = archiveFrom(stream);
    archive << one_of_each_weighted() << points(1, 2);
    stream.Seek(0);
    Pairings a, b;
    archive >> a >> b;
    expect_equal(a, one_of_each_weighted());
    expect_equal(b, points(1, 2));
}

namespace
{
/// Writes numbers as archives do, little-endian, independently of the code under test.
class ByteWriter
{
 public:
    std::vector<uint8_t> bytes;

    ByteWriter& u32(uint64_t v) { return integer(v, 4); }
    ByteWriter& u64(uint64_t v) { return integer(v, 8); }
    ByteWriter& reals(const std::vector<double>& values)
    {
        for (const double v : values)
        {
            uint64_t bits = 0;
            std::memcpy(&bits, &v, 8);
            u64(bits);
        }
        return *this;
    }

 private:
    ByteWriter& integer(uint64_t v, int size)
    {
        for (int i = 0; i < size; i++) bytes.push_back(static_cast<uint8_t>(v >> (8 * i)));
        return *this;
    }
};

/// What version 0 wrote for version_0_content(), number by number.
std::vector<uint8_t> version_0_bytes()
{
    ByteWriter w;
    w.bytes.push_back(0);
    w.u64(2);
    w.u32(7).u32(8).reals({0.1, 0.2, 0.3, 1.1, 1.2, 1.3, 0.75});
    w.u32(9).u32(10).reals({2.1, 2.2, 2.3, 3.1, 3.2, 3.3, 0.25});
    w.u64(1).reals({1, 2, 3, 0.6, 0.8, 0, 4, 5, 6});
    w.u64(1).reals({0, 0.6, 0.8, -2.5, 7, 8, 9, 10, 11, 12});
    w.u64(1).reals({13, 14, 15, 0, 0, 1, 16, 17, 18, 0, 1, 0});
    w.u64(1).reals({1, 0, 0, -19, 19, 20, 21, 0, 1, 0, -22, 23, 22, 24});
    w.u64(2).u64(1).reals({0.5}).u64(3).reals({2.5});
    w.u64(1234567890123u);
    return w.bytes;
}

plane_patch_t patch_of(const std::array<double, 4>& coefs, const mrpt::math::TPoint3D& centroid)
{
    plane_patch_t p;
    p.plane.coefs = coefs, p.centroid = centroid;
    return p;
}
mrpt::math::TLine3D line_of(const mrpt::math::TPoint3D& base, const mrpt::math::TVector3D& director)
{
    mrpt::math::TLine3D l;
    l.pBase = base, l.director = director;
    return l;
}

Pairings version_0_content()
{
    Pairings p;
    p.paired_pt2pt.emplace_back(7, 8, 0.1, 0.2, 0.3, 1.1, 1.2, 1.3);
    p.paired_pt2pt.back().errorSquareAfterTransformation = 0.75;
    p.paired_pt2pt.emplace_back(9, 10, 2.1, 2.2, 2.3, 3.1, 3.2, 3.3);
    p.paired_pt2pt.back().errorSquareAfterTransformation = 0.25;
    p.paired_pt2ln.push_back({line_of({1, 2, 3}, {0.6, 0.8, 0}), {4, 5, 6}});
    p.paired_pt2pl.push_back({patch_of({0, 0.6, 0.8, -2.5}, {7, 8, 9}), {10, 11, 12}});
    p.paired_ln2ln.push_back({line_of({13, 14, 15}, {0, 0, 1}), line_of({16, 17, 18}, {0, 1, 0})});
    p.paired_pl2pl.push_back(
        {patch_of({1, 0, 0, -19}, {19, 20, 21}), patch_of({0, 1, 0, -22}, {23, 22, 24})});
    p.point_weights = {{1, 0.5}, {3, 2.5}};
    p.potential_pairings = 1234567890123u;
    return p;
}
}  // namespace

TEST(PairingsArchive, Version0IsReadAndItsOtherKindsWeighOne)
{
    // Behind it stands one of today's: all of it must be read, and nothing more.
    auto bytes = version_0_bytes();
    const auto next = serialized(one_of_each_weighted());
    bytes.insert(bytes.end(), next.begin(), next.end());
    mrpt::io::CMemoryStream stream;
    stream.assignMemoryNotOwn(bytes.data(), bytes.size());
    auto in = archiveFrom(stream);
    Pairings old = one_of_each_weighted(), today;  // no weight of before may stay
    in >> old >> today;
    expect_equal(old, version_0_content());
    expect_equal(today, one_of_each_weighted());
}

TEST(PairingsArchive, Version1HasTheOtherWeightsBehindThoseOfThePoints)
{
    Pairings p = version_0_content();
    p.pt2ln_weights = {{1, 10}};
    p.pt2pl_weights = {{2, 11}};
    p.ln2ln_weights = {{3, 12}, {4, 13}};
    p.pl2pl_weights = {{5, 14}};
    ByteWriter w;
    w.bytes = version_0_bytes();
    w.bytes.resize(w.bytes.size() - 8), w.bytes[0] = 1;
    w.u64(1).u64(1).reals({10}).u64(1).u64(2).reals({11});
    w.u64(2).u64(3).reals({12}).u64(4).reals({13}).u64(1).u64(5).reals({14});
    w.u64(1234567890123u);
    EXPECT_EQ(serialized(p), w.bytes);
    expect_equal(deserialized(w.bytes), p);
}

TEST(PairingsArchive, AnUnknownVersionIsNamed)
{
    for (const auto version : {uint8_t(2), uint8_t(77), uint8_t(255)})
    {
        auto bytes = serialized(points(0, 1));
        bytes[0] = version;
        mp2p_icp_test::expect_problem_with<DataError>({"version " + std::to_string(version)},
                                                      [&]() { deserialized(bytes); });
    }
}

TEST(PairingsArchive, EveryTruncationIsADataError)
{
    for (const auto& bytes : {serialized(one_of_each_weighted()), version_0_bytes()})
        for (size_t length = 1; length < bytes.size(); length++)
            EXPECT_THROW(deserialized({bytes.begin(), bytes.begin() + static_cast<long>(length)}), DataError)
                << length;
}

TEST(PairingsArchive, DamagedCountsEndInADataErrorAndNotInAHugeAllocation)
{
    const auto good = serialized(Pairings());
    ASSERT_EQ(good.size(), 1u + 10 * 8 + 8);
    rusage before{};
    getrusage(RUSAGE_SELF, &before);
    // Behind the version stand the counts of five lists and of five lists of weights; each byte is damaged.
    for (size_t at = 1; at < 1 + 10 * 8; at++)
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
    const auto good = serialized(one_of_each_weighted());
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
            EXPECT_EQ(all_weights(p)[0].size(), p.paired_pt2pt.size());
            EXPECT_EQ(all_weights(p)[4].size(), p.paired_pl2pl.size());
        }
        catch (const DataError&)
        {
            refused++;
        }
    }
    EXPECT_GT(refused, 100);
}
