#include <gtest/gtest.h>
#include <mp2p_icp/numbers.h>
#include <mp2p_icp/random.h>

#include <clocale>
#include <cstring>
#include <limits>
#include <locale>

using mp2p_icp::to_number;
using mp2p_icp::to_text;

namespace
{
uint64_t bits_of(double v)
{
    uint64_t bits = 0;
    std::memcpy(&bits, &v, sizeof(v));
    return bits;
}

double from_bits(uint64_t bits)
{
    double v = 0;
    std::memcpy(&v, &bits, sizeof(v));
    return v;
}

/// Decimal commas and grouped thousands.
struct Commas : std::numpunct<char>
{
    char do_decimal_point() const override { return ','; }
    char do_thousands_sep() const override { return '.'; }
    std::string do_grouping() const override { return "\3"; }
};
}  // namespace

TEST(Numbers, AnyBitPatternReadsBackTheSame)
{
    mp2p_icp::SeededRandom random(20240501);
    for (int i = 0; i < 200000; i++)
    {
        const double v = from_bits(random());
        if (std::isnan(v)) continue;
        const auto back = to_number(to_text(v));
        ASSERT_TRUE(back.has_value()) << to_text(v);
        ASSERT_EQ(bits_of(*back), bits_of(v)) << to_text(v);
        ASSERT_LE(to_text(v).size(), 24u) << to_text(v);  // -1.2345678901234567e-300
    }
}

TEST(Numbers, TheEndsOfTheRangeReadBackTheSame)
{
    using limits = std::numeric_limits<double>;
    for (const double v : {0.0, -0.0, limits::min(), limits::max(), limits::lowest(), limits::denorm_min(),
                           limits::epsilon(), 1e22, 1e23, 123456789012345678.0, 5e-324})
    {
        const auto back = to_number(to_text(v));
        ASSERT_TRUE(back.has_value()) << to_text(v);
        EXPECT_EQ(bits_of(*back), bits_of(v)) << to_text(v);
    }
}

TEST(Numbers, TheShortestTextIsWritten)
{
    EXPECT_EQ(to_text(0.1), "0.1");
    EXPECT_EQ(to_text(-2.5), "-2.5");
    EXPECT_EQ(to_text(3.0), "3");
}

TEST(Numbers, InfinityAndNanAreWrittenAsYamlDoes)
{
    const double inf = std::numeric_limits<double>::infinity();
    EXPECT_EQ(to_text(inf), ".inf");
    EXPECT_EQ(to_text(-inf), "-.inf");
    EXPECT_EQ(to_text(std::nan("")), ".nan");
    EXPECT_EQ(to_text(-std::nan("")), ".nan");
    for (const char* text : {".inf", "+.inf", ".Inf", ".INF"})
    {
        ASSERT_TRUE(to_number(text).has_value()) << text;
        EXPECT_EQ(*to_number(text), inf) << text;
    }
    for (const char* text : {"-.inf", "-.Inf", "-.INF"})
    {
        ASSERT_TRUE(to_number(text).has_value()) << text;
        EXPECT_EQ(*to_number(text), -inf) << text;
    }
    for (const char* text : {".nan", ".NaN", ".NAN"})
    {
        ASSERT_TRUE(to_number(text).has_value()) << text;
        EXPECT_TRUE(std::isnan(*to_number(text))) << text;
    }
}

TEST(Numbers, OrdinarySpellingsAreRead)
{
    EXPECT_EQ(to_number("+1.5"), 1.5);
    EXPECT_EQ(to_number("-.5"), -0.5);
    EXPECT_EQ(to_number("5."), 5.0);
    EXPECT_EQ(to_number("1e3"), 1000.0);
    EXPECT_EQ(to_number("1E-3"), 0.001);
    EXPECT_EQ(to_number("007"), 7.0);
}

TEST(Numbers, WhatIsNoNumberAsAWholeIsNotRead)
{
    for (const char* text :
         {"",      " ",   "+",   "-",   ".",   "e5",   "1e",   "1 ",  " 1",  "1,5",       "1.5m",
          "1.2.3", "--1", "+-1", "-+1", "++1", "0x10", "true", "one", "1\n", ".infinity", "nan(1)"})
        EXPECT_FALSE(to_number(text).has_value()) << "'" << text << "' gave " << *to_number(text);
}

TEST(Numbers, TheLocaleHasNoInfluence)
{
    const std::locale before = std::locale::global(std::locale(std::locale::classic(), new Commas));
    const char* c_locale = std::setlocale(LC_ALL, "de_DE.UTF-8");  // null where it is not installed
    EXPECT_EQ(to_text(1234567.25), "1234567.25");
    EXPECT_EQ(to_number("1234567.25"), 1234567.25);
    EXPECT_FALSE(to_number("1,5").has_value());
    if (c_locale) std::setlocale(LC_ALL, "C");
    std::locale::global(before);
}
