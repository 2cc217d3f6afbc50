#include <mp2p_icp/Formula.h>

#include <atomic>
#include <cmath>
#include <thread>

#include "expect_problem.h"

using mp2p_icp::Formula;
using mp2p_icp::ParameterSource;
using mp2p_icp::RunVariables;
using mp2p_icp_test::expect_problem_with;

TEST(Formula, ADefaultOneIsZero)
{
    EXPECT_TRUE(Formula().is_constant());
    EXPECT_EQ(Formula().value(), 0.0);
    EXPECT_EQ(Formula().text(), "0");
}

TEST(Formula, ATextWithoutVariablesIsFoldedToAConstant)
{
    const Formula f("2*3 + 2^3");
    EXPECT_TRUE(f.is_constant());
    EXPECT_EQ(f.value(), 14.0);
    EXPECT_EQ(f.text(), "14");
    EXPECT_EQ(Formula("  1.25 ").value(), 1.25);
}

TEST(Formula, AConstantKeepsAllItsDigits)
{
    EXPECT_EQ(std::stod(Formula(0.1).text()), 0.1);
    EXPECT_EQ(std::stod(Formula(1.0 / 3).text()), 1.0 / 3);
    EXPECT_EQ(Formula("0.1").value(), 0.1);
}

TEST(Formula, VariablesTakeTheirValuesAtEachEvaluation)
{
    const Formula f("0.5 + 2*exp(-0.2*ICP_ITERATION) - b_2");
    EXPECT_FALSE(f.is_constant());
    EXPECT_EQ(f.text(), "0.5 + 2*exp(-0.2*ICP_ITERATION) - b_2");
    for (int i : {0, 3, 1, 50})
        EXPECT_NEAR(f.value({{"ICP_ITERATION", i}, {"b_2", 0.25}, {"unused", 7}}),
                    0.25 + 2 * std::exp(-0.2 * i), 1e-15);
}

TEST(Formula, CopiesAreIndependentOfTheOriginalsLife)
{
    Formula copy;
    {
        const Formula original("x+1");
        copy = original;
        EXPECT_EQ(original.value({{"x", 5}}), 6);
    }
    EXPECT_EQ(copy.value({{"x", 1}}), 2);
}

TEST(Formula, AMissingVariableIsNamedWithThoseThatAreKnown)
{
    const Formula f("max_dist * ICP_ITERATIONS");
    const RunVariables known = {{"ICP_ITERATION", 1}, {"max_dist", 2}, {"other", 3}};
    expect_problem_with<std::runtime_error>(
        {"max_dist * ICP_ITERATIONS", "'ICP_ITERATIONS'", "ICP_ITERATION, max_dist, other"},
        [&]() { f.value(known); });
    expect_problem_with<std::runtime_error>({"'ICP_ITERATIONS'", "no variables"}, [&]() { f.value(); });
}

TEST(Formula, AFailedEvaluationDoesNotSpoilTheNextOne)
{
    const Formula f("a + 10*b");
    EXPECT_THROW(f.value({{"a", 1}}), std::runtime_error);
    EXPECT_EQ(f.value({{"a", 2}, {"b", 3}}), 32);
}

TEST(Formula, SyntaxErrorsAreFoundWhenItIsSetAndQuoteTheText)
{
    for (const std::string text :
         {"1 +", "(2", "2)", "* 3", "sin(", "1..2", "a b c)", "$x", "0.5 +* ICP_ITERATION"})
        expect_problem_with<std::invalid_argument>({"'" + text + "'"}, [&]() { Formula f(text); });
    EXPECT_THROW(Formula(""), std::invalid_argument);
    EXPECT_THROW(Formula(" \t\n"), std::invalid_argument);
}

TEST(Formula, ATextThatIsNoNumberAtAllIsRefused)
{
    EXPECT_THROW(Formula("'hello'"), std::invalid_argument);
}

TEST(Formula, SeveralThreadsGetTheirOwnValues)
{
    // One shared formula, each thread with variables of its own: a value of another thread would show.
    const Formula f("1000*a + b");
    std::atomic<int> wrong{0};
    std::vector<std::thread> threads;
    for (int t = 0; t < 8; t++)
        threads.emplace_back(
            [&, t]()
            {
                for (int i = 0; i < 5000; i++)
                    if (f.value({{"a", t}, {"b", i}}) != 1000.0 * t + i) ++wrong;
            });
    for (auto& t : threads) t.join();
    EXPECT_EQ(wrong, 0);
}

TEST(ParameterSource, CopiesShareTheirValues)
{
    ParameterSource a;
    const ParameterSource b = a;
    a.updateVariable("x", 1);
    a.updateVariables({{"x", 2}, {"y", 3}});
    EXPECT_EQ(b.getVariableValues(), (RunVariables{{"x", 2}, {"y", 3}}));
    EXPECT_TRUE(ParameterSource().getVariableValues().empty());
}
