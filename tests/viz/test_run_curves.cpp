#include <gtest/gtest.h>
#include <mp2p_icp/run_curves.h>
#include <mp2p_icp/se3.h>
#include <mp2p_icp/synthetic/random_pose.h>

#include <cmath>
#include <numeric>

#include "log_test_tools.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;
using mrpt::math::TPoint3D;
using mrpt::poses::CPose3D;

namespace
{
const CPose3D TRUTH(0.15, -0.1, 0.05, 0.08, -0.05, 0.04);

LogRecord run_on_wavy_surface()
{
    const auto points = wavy_points(800, 1);
    std::vector<TPoint3D> seen;
    for (const auto& p : points) seen.push_back(TRUTH.inverseComposePoint(p));
    return logged_run(map_of(points), map_of(seen), {});
}

TPoint3D any_point(SeededRandom& random)
{
    return {random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-5, 5)};
}
mrpt::math::TLine3D any_line(SeededRandom& random)
{
    mrpt::math::TLine3D line;
    line.pBase = any_point(random), line.director = any_point(random).unitarize();
    return line;
}
plane_patch_t any_patch(SeededRandom& random)
{
    const TPoint3D centroid = any_point(random);
    return {mrpt::math::TPlane(centroid, any_point(random).unitarize()), centroid};
}

/// So many random pairings of each kind.
Pairings any_pairings(const PerPairingKind<size_t>& counts, uint64_t seed)
{
    SeededRandom random(seed);
    Pairings out;
    for (size_t i = 0; i < counts[0]; i++)
        out.paired_pt2pt.push_back(mrpt::tfest::TMatchingPair_d(
            static_cast<uint32_t>(i), static_cast<uint32_t>(i), any_point(random), any_point(random)));
    for (size_t i = 0; i < counts[1]; i++) out.paired_pt2ln.push_back({any_line(random), any_point(random)});
    for (size_t i = 0; i < counts[2]; i++) out.paired_pt2pl.push_back({any_patch(random), any_point(random)});
    for (size_t i = 0; i < counts[3]; i++) out.paired_ln2ln.push_back({any_line(random), any_line(random)});
    for (size_t i = 0; i < counts[4]; i++) out.paired_pl2pl.push_back({any_patch(random), any_patch(random)});
    return out;
}

/// The least distance from p to base + s u, found by trying: no formula of the library is used.
double least_distance(const TPoint3D& p, const TPoint3D& base, const TPoint3D& u)
{
    double from = -100, to = 100;
    const auto at = [&](double s) { return (base + u * s - p).norm(); };
    for (int i = 0; i < 200; i++)
    {
        const double a = from + (to - from) / 3, b = to - (to - from) / 3;
        (at(a) < at(b) ? to : from) = at(a) < at(b) ? b : a;
    }
    return at(0.5 * (from + to));
}

size_t total(const ResidualHistogram::Counts& counts)
{
    return std::accumulate(counts.bins.begin(), counts.bins.end(), counts.beyond + counts.not_finite);
}
}  // namespace

TEST(residual_distances, are_those_of_school_geometry_for_all_kinds)
{
    SeededRandom random(1);
    const Pairings pairings = any_pairings({7, 6, 5, 4, 3}, 2);
    const CPose3D pose = synthetic::random_pose({3, 3, 3, 3, 1, 3}, random);
    const auto all = residual_distances(pairings, pose);
    EXPECT_EQ(pairing_counts(pairings), (PerPairingKind<size_t>{7, 6, 5, 4, 3}));
    const auto on_plane = [&](const plane_patch_t& patch, const TPoint3D& p)
    { return patch.plane.distance(pose.composePoint(p)); };
    // The search by thirds ends where distances differ by rounding: the square root of it is its error.
    for (size_t i = 0; i < 7; i++)
        EXPECT_NEAR(
            all[0][i],
            (pose.composePoint(pairings.paired_pt2pt[i].local) - pairings.paired_pt2pt[i].global).norm(),
            1e-12);
    for (size_t i = 0; i < 6; i++)
    {
        const auto& pair = pairings.paired_pt2ln[i];
        EXPECT_NEAR(
            all[1][i],
            least_distance(pose.composePoint(pair.pt_local), pair.ln_global.pBase, pair.ln_global.director),
            1e-7);
    }
    for (size_t i = 0; i < 5; i++)
        EXPECT_NEAR(all[2][i],
                    on_plane(pairings.paired_pt2pl[i].pl_global, pairings.paired_pt2pl[i].pt_local), 1e-12);
    for (size_t i = 0; i < 4; i++)
    {
        const auto& pair = pairings.paired_ln2ln[i];
        EXPECT_NEAR(all[3][i],
                    least_distance(pose.composePoint(pair.ln_local.pBase), pair.ln_global.pBase,
                                   pair.ln_global.director),
                    1e-7);
    }
    for (size_t i = 0; i < 3; i++)
        EXPECT_NEAR(all[4][i],
                    on_plane(pairings.paired_pl2pl[i].p_global, pairings.paired_pl2pl[i].p_local.centroid),
                    1e-12);
}

TEST(run_curves, tell_the_steps_and_the_fit_of_every_iteration)
{
    LogRecord log = run_on_wavy_surface();
    ASSERT_EQ(log.icpResult.verdict, Verdict::aligned);
    ASSERT_TRUE(log.iterationsDetails);
    const RunCurves curves = run_curves(log);
    ASSERT_EQ(curves.size(), log.iterationsDetails->size());
    ASSERT_GT(curves.size(), 3u);

    CPose3D before(log.initialGuessLocalWrtGlobal);
    size_t i = 0;
    for (const auto& [iteration, details] : *log.iterationsDetails)
    {
        const auto& point = curves[i++];
        EXPECT_EQ(point.iteration, iteration);
        EXPECT_EQ(point.pairings[0], details.pairings.paired_pt2pt.size());
        EXPECT_EQ(point.pairings[1] + point.pairings[2] + point.pairings[3] + point.pairings[4], 0u);

        const CPose3D step = details.optimalPose - before;
        EXPECT_NEAR(point.step.radians, rotation_angle(rotation_of(step)), 1e-12);
        EXPECT_NEAR(point.step.metres, step.norm(), 1e-12);
        const CPose3D rest = log.icpResult.optimal_tf.mean - details.optimalPose;
        EXPECT_NEAR(point.to_final.radians, rotation_angle(rotation_of(rest)), 1e-12);
        EXPECT_NEAR(point.to_final.metres, rest.norm(), 1e-12);
        before = details.optimalPose;

        double squares = 0;
        for (size_t k = 0; k < details.pairings.paired_pt2pt.size(); k++)
        {
            const auto& pair = details.pairings.paired_pt2pt[k];
            squares += (details.optimalPose.composePoint(pair.local) - pair.global).sqrNorm();
        }
        const auto count = static_cast<double>(details.pairings.paired_pt2pt.size());
        EXPECT_NEAR(point.rms_residual, std::sqrt(squares / count), 1e-12);
        EXPECT_NEAR(point.cost, squares, 1e-12);
    }
    EXPECT_GT(curves[0].step.metres, 0.01);
    EXPECT_NEAR(curves.back().to_final.metres, 0, 1e-15);
    EXPECT_LT(curves.back().rms_residual, 0.1 * curves[0].rms_residual);
}

TEST(run_curves, tell_of_iterations_without_details_too)
{
    LogRecord log = run_on_wavy_surface();
    const auto all = run_curves(log);
    log.iterationsDetails.reset();
    const auto again = run_curves(log);
    ASSERT_EQ(again.size(), all.size());
    EXPECT_EQ(again.back().step.metres, all.back().step.metres);
    EXPECT_EQ(again.front().pairings, all.front().pairings);
}

TEST(run_curves, of_a_rejected_run_end_where_its_iterations_ended)
{
    LogRecord log = run_on_wavy_surface();
    log.icpResult.rejected_pose = log.icpResult.optimal_tf.mean;
    log.icpResult.optimal_tf.mean = CPose3D();
    log.icpResult.verdict = Verdict::worse_than_guess;
    EXPECT_NEAR(run_curves(log).back().to_final.metres, 0, 1e-15);
}

TEST(run_curves, of_far_away_maps_are_those_of_the_same_maps_nearby)
{
    const auto points = wavy_points(800, 1);
    std::vector<TPoint3D> seen;
    for (const auto& p : points) seen.push_back(TRUTH.inverseComposePoint(p));
    metric_map_t global = map_of(points), local = map_of(seen);
    const auto near = run_curves(logged_run(global, local, {}));
    const TPoint3D offset(4.5e6, -3e5, 200);
    global.set_coordinate_offset(offset), local.set_coordinate_offset(offset);
    const auto far = run_curves(logged_run(global, local, {}));
    ASSERT_EQ(near.size(), far.size());
    for (size_t i = 0; i < near.size(); i++)
    {
        // Coordinates of millions of metres are rounded to 1e-9 m.
        EXPECT_NEAR(near[i].step.metres, far[i].step.metres, 1e-8);
        EXPECT_NEAR(near[i].to_final.metres, far[i].to_final.metres, 1e-8);
        EXPECT_NEAR(near[i].rms_residual, far[i].rms_residual, 1e-8);
    }
}

TEST(run_curves, of_empty_and_damaged_logs_are_empty_or_not_a_number_and_never_a_crash)
{
    EXPECT_TRUE(run_curves(LogRecord()).empty());
    LogRecord log;
    log.iterations.resize(2);
    log.iterations[1].iteration = 7, log.iterations[1].pose = CPose3D(NAN, 0, 0, 0, INFINITY, 0);
    log.iterations[1].pairings = {1, 2, 3, 4, 5}, log.iterations[1].cost = NAN;
    const auto curves = run_curves(log);
    ASSERT_EQ(curves.size(), 2u);
    EXPECT_EQ(curves[0].to_final.metres, 0);
    EXPECT_EQ(curves[1].iteration, 7u);
    EXPECT_TRUE(std::isnan(curves[1].to_final.radians) && std::isnan(curves[1].cost));
    EXPECT_EQ(curves[1].pairings, (PerPairingKind<size_t>{1, 2, 3, 4, 5}));
}

TEST(residual_histogram, counts_every_pairing_once_in_the_bin_of_its_distance)
{
    const Pairings pairings = any_pairings({200, 150, 100, 50, 30}, 5);
    const CPose3D pose(0.1, 0.2, 0.3, 0.4, 0.5, 0.6);
    const auto all = residual_distances(pairings, pose);
    for (const size_t bins : {1, 7, 40})
    {
        const auto histogram = residual_histogram(pairings, pose, bins);
        ASSERT_GT(histogram.upper, 0);
        for (size_t kind = 0; kind < PAIRING_KIND_COUNT; kind++)
        {
            const auto& counts = histogram.kinds[kind];
            ASSERT_EQ(counts.bins.size(), bins);
            EXPECT_EQ(total(counts), all[kind].size());
            EXPECT_EQ(counts.not_finite, 0u);
            for (size_t bin = 0; bin < bins; bin++)
            {
                const double width = histogram.upper / static_cast<double>(bins);
                size_t expected = 0;
                for (const double d : all[kind])
                    expected +=
                        d >= static_cast<double>(bin) * width &&
                        (bin + 1 < bins ? d < static_cast<double>(bin + 1) * width : d <= histogram.upper);
                EXPECT_EQ(counts.bins[bin], expected);
            }
        }
    }
}

TEST(residual_histogram, a_few_far_pairings_do_not_squeeze_the_rest)
{
    Pairings pairings;
    const auto add = [&](double d) {
        pairings.paired_pt2pt.push_back(mrpt::tfest::TMatchingPair_d(0, 0, {d, 0, 0}, {0, 0, 0}));
    };
    for (int i = 1; i <= 100; i++) add(0.001 * i);
    EXPECT_DOUBLE_EQ(residual_histogram(pairings, {}).upper, 0.1);  // nothing far: the largest
    for (const double d : {5.0, 1e4, 1e9}) add(d);
    const auto histogram = residual_histogram(pairings, {});
    EXPECT_NEAR(histogram.upper, 0.18, 0.01);
    EXPECT_EQ(histogram.kinds[0].beyond, 3u);
    EXPECT_EQ(total(histogram.kinds[0]), 103u);
}

TEST(residual_histogram, of_nothing_of_zeros_and_of_numbers_that_are_none)
{
    const auto none = residual_histogram({}, {});
    EXPECT_EQ(none.upper, 0);
    EXPECT_EQ(total(none.kinds[0]), 0u);

    Pairings pairings;
    pairings.paired_pt2pt.push_back(mrpt::tfest::TMatchingPair_d(0, 0, {1, 2, 3}, {1, 2, 3}));
    auto histogram = residual_histogram(pairings, {}, 5);
    EXPECT_EQ(histogram.upper, 0);
    EXPECT_EQ(histogram.kinds[0].bins[0], 1u);

    pairings.paired_pt2pt.push_back(mrpt::tfest::TMatchingPair_d(0, 0, {1e-310, 0, 0}, {0, 0, 0}));
    pairings.paired_pt2pt.push_back(mrpt::tfest::TMatchingPair_d(0, 0, {NAN, 0, 0}, {0, 0, 0}));
    pairings.paired_pt2pt.push_back(mrpt::tfest::TMatchingPair_d(0, 0, {INFINITY, 0, 0}, {0, 0, 0}));
    pairings.paired_pt2pt.push_back(mrpt::tfest::TMatchingPair_d(0, 0, {1e200, 0, 0}, {0, 0, 0}));
    histogram = residual_histogram(pairings, {}, 5);
    EXPECT_EQ(total(histogram.kinds[0]), 5u);
    EXPECT_EQ(histogram.kinds[0].not_finite, 3u) << "the square of 1e200 is not finite, either";

    EXPECT_EQ(residual_histogram(pairings, CPose3D(NAN, 0, 0, 0, 0, 0)).kinds[0].not_finite, 5u);
    EXPECT_THROW(residual_histogram(pairings, {}, 0), std::invalid_argument);
}
