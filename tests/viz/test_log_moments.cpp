#include "log_tools.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

TEST(log_moments, are_in_the_order_of_time)
{
    auto log = log_of_corners();
    EXPECT_EQ(log_moments(*log),
              (std::vector<LogMoment>{GUESS_MOMENT, after(0), after(1), after(2), FINAL_MOMENT}));
    log->iterationsDetails.reset();
    log->icpResult.rejected_pose = CPose3D(9, 0, 0, 0, 0, 0);
    EXPECT_EQ(log_moments(*log), (std::vector<LogMoment>{GUESS_MOMENT, REJECTED_MOMENT, FINAL_MOMENT}));
    EXPECT_EQ(pose_at(*log, REJECTED_MOMENT).x(), 9);
}

TEST(log_moments, iterations_without_details_have_a_pose_and_no_pairings)
{
    auto log = log_of_corners();
    log->iterations.resize(2);
    log->iterations[0].iteration = 2, log->iterations[0].pose = CPose3D(7, 0, 0, 0, 0, 0);
    log->iterations[1].iteration = 3, log->iterations[1].pose = CPose3D(8, 0, 0, 0, 0, 0);
    EXPECT_EQ(log_moments(*log),
              (std::vector<LogMoment>{GUESS_MOMENT, after(0), after(1), after(2), after(3), FINAL_MOMENT}));
    EXPECT_EQ(pose_at(*log, after(3)).x(), 8);
    EXPECT_EQ(moment_from_text(*log, "3"), after(3));
    bool stored = false;
    EXPECT_EQ(pairings_at(*log, after(3), stored), nullptr);
    EXPECT_NE(pairings_at(*log, after(2), stored), nullptr);
    EXPECT_TRUE(stored);
}

TEST(log_moments, poses_are_in_the_original_coordinates)
{
    const TPoint3D global_offset(1000, 2000, 30), local_offset(-500, 0, 7);
    const auto log = log_of(shared_map(CORNERS, global_offset), shared_map(CORNERS, local_offset),
                            CPose3D(3, 2, 1, 1, 0, 0));
    const CPose3D stored = log->iterationsDetails->at(1).optimalPose, original = pose_at(*log, after(1));
    for (const auto& p : CORNERS)  // stored p is local_offset + p originally, and so on
        EXPECT_LT((stored.composePoint(p) + global_offset - original.composePoint(p + local_offset)).norm(),
                  1e-9)
            << "rounding of doubles at 1e3";
    EXPECT_EQ(pose_at(*log, GUESS_MOMENT), CPose3D(3, 2, 1, 1, 0, 0)) << "as it was given";
}

TEST(log_moments, are_found_by_their_texts)
{
    const auto log = log_of_corners();
    EXPECT_EQ(moment_from_text(*log, "guess"), GUESS_MOMENT);
    EXPECT_EQ(moment_from_text(*log, "final"), FINAL_MOMENT);
    EXPECT_EQ(moment_from_text(*log, "2"), after(2));
    for (const char* wrong : {"-1", "1.5", "", "last", "nan", "1e99", "rejected"})
        EXPECT_THROW(moment_from_text(*log, wrong), std::invalid_argument) << wrong;
    try
    {
        moment_from_text(*log, "7");
        FAIL();
    }
    catch (const std::invalid_argument& e)
    {
        EXPECT_STREQ(e.what(), "iteration 7 was not logged; the log holds iterations 0, 1, 2");
    }
}

TEST(log_moments, of_many_a_choice_that_is_denser_at_the_beginning)
{
    std::vector<LogMoment> all;
    for (size_t i = 0; i < 100; i++) all.push_back(after(i));
    const auto some = some_moments(all, 12);
    ASSERT_EQ(some.size(), 12u);
    EXPECT_EQ(some.front(), all.front());
    EXPECT_EQ(some.back(), all.back());
    for (size_t i = 2; i < some.size(); i++)
        EXPECT_GE(some[i].iteration - some[i - 1].iteration, some[i - 1].iteration - some[i - 2].iteration);
    EXPECT_EQ(some[1].iteration, 1u);
    for (const size_t count : {12u, 13u, 99u})  // hardly more than there is room for: no moment twice
    {
        const std::vector<LogMoment> few(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(count));
        const auto chosen = some_moments(few, 12);
        ASSERT_EQ(chosen.size(), 12u);
        EXPECT_EQ(chosen.back(), few.back());
        for (size_t i = 1; i < 12; i++) EXPECT_GT(chosen[i].iteration, chosen[i - 1].iteration);
    }
    EXPECT_EQ(some_moments(all, 100).size(), 100u);
}
