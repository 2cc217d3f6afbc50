#include <gtest/gtest.h>
#include <mp2p_icp/errors.h>
#include <mrpt/core/exceptions.h>

using namespace mp2p_icp;

TEST(Errors, ADataErrorSaysWhereWhatAndWhatInstead)
{
    EXPECT_STREQ(DataError("a.ply", place_line(12), "3 numbers", "'x'").what(),
                 "a.ply, line 12: expected 3 numbers, found 'x'");
    EXPECT_STREQ(DataError("a.ply", place_byte(1024), "data", "the end").what(),
                 "a.ply, byte 1024: expected data, found the end");
    EXPECT_STREQ(DataError("a.ply", "", "data", "nothing").what(), "a.ply: expected data, found nothing");
    EXPECT_STREQ(DataError("a.ply", "is a directory").what(), "a.ply: is a directory");
}

TEST(Errors, PlacesHoldTheLargestOffsets)
{
    EXPECT_EQ(place_byte(UINT64_MAX), "byte 18446744073709551615");
    EXPECT_EQ(place_line(1), "line 1");
}

TEST(Errors, TheKindsAreCaughtByTheirStandardBases)
{
    EXPECT_THROW(throw ConfigError("x"), std::invalid_argument);
    EXPECT_THROW(throw DataError("x", "y"), std::runtime_error);
}

TEST(Errors, TheShortReasonOfAnMrptExceptionHasNoLocationOrCallStack)
{
    try
    {
        THROW_EXCEPTION("the thing is broken");
    }
    catch (const std::exception& e)
    {
        EXPECT_EQ(short_reason(e), "the thing is broken");
    }
    try
    {
        const int x = 1;
        ASSERT_EQUAL_(x, 2);
    }
    catch (const std::exception& e)
    {
        EXPECT_EQ(short_reason(e).find(".cpp"), std::string::npos) << short_reason(e);
        EXPECT_EQ(short_reason(e).find('\n'), std::string::npos) << short_reason(e);
        EXPECT_FALSE(short_reason(e).empty());
    }
}

TEST(Errors, TheShortReasonIsOneTrimmedLine)
{
    EXPECT_EQ(short_reason(std::runtime_error("plain")), "plain");
    EXPECT_EQ(short_reason(std::runtime_error("\n\n  first \nsecond\n")), "first");
    EXPECT_EQ(short_reason(std::runtime_error("")), "unknown error");
    EXPECT_EQ(short_reason(std::runtime_error(" \n\t")), "unknown error");
}
