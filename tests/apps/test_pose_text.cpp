#include <mp2p_icp/errors.h>
#include <mp2p_icp/random.h>

#include "pose_text.h"
#include "run_tools.h"

using namespace mp2p_icp_apps;
using namespace mp2p_icp_test;

namespace
{
void expect_refused(const std::string& text, const std::string& word)
{
    try
    {
        pose_from_text(text);
        ADD_FAILURE() << "accepted: " << text;
    }
    catch (const std::invalid_argument& e)
    {
        EXPECT_TRUE(contains(e.what(), word)) << e.what();
    }
}
}  // namespace

TEST(pose_text, takes_metres_and_degrees_in_all_forms)
{
    for (const char* text : {"[1 -2.5 3e-1 10 -20 30]", "1 -2.5 0.3 10 -20 30", "[1, -2.5, 0.3, 10, -20, 30]",
                             " [ 1,-2.5,.3,10,-20,+30 ] "})
    {
        const auto p = pose_from_text(text);
        EXPECT_EQ(p.x, 1) << text;
        EXPECT_EQ(p.y, -2.5) << text;
        EXPECT_EQ(p.z, 0.3) << text;
        EXPECT_EQ(p.yaw, mrpt::DEG2RAD(10.0)) << text;
        EXPECT_EQ(p.pitch, mrpt::DEG2RAD(-20.0)) << text;
        EXPECT_EQ(p.roll, mrpt::DEG2RAD(30.0)) << text;
    }
}

TEST(pose_text, says_what_is_wrong)
{
    expect_refused("[1 2 3 4 5]", "found 5");
    expect_refused("[1 2 3 4 5 6 7]", "found 7");
    expect_refused("[]", "found 0");
    expect_refused("", "found 0");
    expect_refused("[1 2 3 4 5 six]", "'six'");
    expect_refused("[1 2 3 4 5 6", "brackets");
    expect_refused("[", "brackets");
    expect_refused("[1 2 3 4 5 nan]", "finite");
    expect_refused("[1 2 3 4 5 .inf]", "finite");
    expect_refused("[1 2 3 4 5 6m]", "'6m'");
}

TEST(pose_text, takes_a_matrix_file_and_makes_its_rotation_exact)
{
    const Folder folder;
    const auto truth = pose_deg(1, 2, 3, 40, 10, -20);
    std::ostringstream four_digits;
    four_digits.precision(4);
    const auto T = truth.getHomogeneousMatrixVal<mrpt::math::CMatrixDouble44>();
    for (int r = 0; r < 4; r++, four_digits << ";\n")
        for (int c = 0; c < 4; c++) four_digits << T(r, c) << ", ";
    const CPose3D found(pose_from_matrix_file(folder.text("T.txt", "[" + four_digits.str() + "]")));
    expect_near(found, truth, 1e-12, 0.01);  // rounding to 1e-4 turns by at most about 1e-4 rad
    const auto R = mp2p_icp::rotation_of(found);
    EXPECT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-14);
}

TEST(pose_text, refuses_files_that_hold_no_pose)
{
    const Folder folder;
    const auto refused = [&](const std::string& content, const std::string& word)
    {
        try
        {
            pose_from_argument("--ground-truth", folder.text("T.txt", content));
            ADD_FAILURE() << "accepted: " << content;
        }
        catch (const std::invalid_argument& e)
        {
            EXPECT_TRUE(contains(e.what(), word) && contains(e.what(), "--ground-truth") &&
                        contains(e.what(), "T.txt"))
                << e.what();
        }
    };
    refused("", "0 numbers");
    refused("1 0 0 0 0 1 0 0 0 0 1 0", "12 numbers");
    refused("1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 x", "'x'");
    refused("1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1", "last row");
    refused("2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1", "rotation");
    refused("1 0 0 0 0 1 0 0 0 0 -1 0 0 0 0 1", "rotation");  // a mirror
    refused("nan 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1", "finite");
}

TEST(pose_text, typed_degrees_come_back_as_typed)
{
    for (const double typed :
         {0.0, 10.0, -10.0, 0.1, 33.3, 89.0, 135.0, -179.5, 1e-3, 12.345678, 123.456789012})
    {
        const CPose3D pose(0, 0, 0, mrpt::DEG2RAD(typed), 0, 0);
        EXPECT_EQ(degrees_of(pose.yaw()), typed);
    }
}

TEST(pose_text, degrees_lead_back_to_the_same_bits)
{
    mp2p_icp::SeededRandom random(7);
    for (int i = 0; i < 2000; i++)
    {
        const double typed_deg = random.uniform(-180, 180);
        const CPose3D pose(0, 0, 0, mrpt::DEG2RAD(typed_deg), mrpt::DEG2RAD(typed_deg / 3), 0);
        const CPose3D back(0, 0, 0, mrpt::DEG2RAD(degrees_of(pose.yaw())),
                           mrpt::DEG2RAD(degrees_of(pose.pitch())), 0);
        EXPECT_EQ(back.yaw(), pose.yaw());
        EXPECT_EQ(back.pitch(), pose.pitch());
    }
    EXPECT_TRUE(std::isnan(degrees_of(std::nan(""))));
}
