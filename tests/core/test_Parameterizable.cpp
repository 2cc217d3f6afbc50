#include <mp2p_icp/Parameterizable.h>
#include <mp2p_icp/errors.h>

#include <cmath>
#include <sstream>

#include "expect_problem.h"

using namespace mp2p_icp;
using mp2p_icp_test::expect_problem_with;

namespace
{
enum class Fruit : uint8_t
{
    Apple,
    Pear,
    Plum
};

struct Inner : public Parameterizable
{
    double depth = 1.5;
    bool on = true;
    void declare_parameters(ParameterDeclaration& declare) override
    {
        declare.number("depth", depth, "m", Range::positive(), "how deep");
        declare.flag("on", on, "a switch");
    }
};

/// One parameter of every kind.
struct Part : public Parameterizable
{
    double number = 0.1, half_open = 0.5;
    uint32_t count = 3;
    bool flag = false;
    std::string text = "raw";
    Formula formula = 2.0;
    Formula corner[3] = {1.0, 2.0, 3.0};
    std::vector<std::string> names = {"a", "b"};
    Inner inner;
    Fruit fruit = Fruit::Pear;

    void declare_parameters(ParameterDeclaration& declare) override
    {
        declare.number("number", number, "m", Range::between(-1, 1), "a number");
        declare.number("half_open", half_open, "", {0, 1, true, false}, "open below, closed above");
        declare.integer("count", count, Range::between(1, 10), "a count");
        declare.flag("flag", flag, "a flag");
        declare.text("text", text, "a text");
        declare.formula("formula", formula, "deg", Range::positive(), "a formula");
        declare.formulas("corner", corner, 3, "m", "three of them");
        declare.texts("names", names, "some texts");
        declare.group("inner", inner, "a part");
        declare.choice<Fruit>("fruit", fruit, "Fruit",
                              {{Fruit::Apple, "Apple"}, {Fruit::Pear, "Pear"}, {Fruit::Plum, "Plum"}},
                              "which one");
        declare.older_name("size", "number");
    }
    RunVariables seen_variables(const RunVariables& run) const { return variables(run); }
};

struct Needy : public Parameterizable
{
    double needed = 0, optional = 7;
    uint32_t lo = 1, hi = 2;
    void declare_parameters(ParameterDeclaration& declare) override
    {
        declare.number("needed", needed, "m", Range::any(), "must be given", Need::Required);
        declare.number("optional", optional, "m", Range::any(), "may be given");
        declare.integer("lo", lo, Range::any(), "");
        declare.integer("hi", hi, Range::any(), "");
        declare.older_name("needed_before", "needed");
        declare.rule([this]() { return lo < hi ? std::string() : std::string("lo must be below hi"); });
    }
};

template <class P = Part>
P loaded(const std::string& text)
{
    P p;
    p.load_parameters(yaml_from_text(text, "f.yaml"), {"f.yaml", "params"});
    return p;
}

template <class P = Part>
void expect_refused(const std::string& text, const std::vector<std::string>& parts)
{
    SCOPED_TRACE(text);
    expect_problem_with<ConfigError>(parts, [&]() { loaded<P>(text); });
}

void expect_equal(const Part& a, const Part& b)
{
    EXPECT_EQ(a.number, b.number);
    EXPECT_EQ(a.half_open, b.half_open);
    EXPECT_EQ(a.count, b.count);
    EXPECT_EQ(a.flag, b.flag);
    EXPECT_EQ(a.text, b.text);
    EXPECT_EQ(a.formula.text(), b.formula.text());
    for (int i = 0; i < 3; i++) EXPECT_EQ(a.corner[i].text(), b.corner[i].text());
    EXPECT_EQ(a.names, b.names);
    EXPECT_EQ(a.inner.depth, b.inner.depth);
    EXPECT_EQ(a.inner.on, b.inner.on);
    EXPECT_EQ(a.fruit, b.fruit);
}

Part unusual_part()
{
    Part p;
    p.number = 1.0 / 3, p.half_open = std::nextafter(1.0, 0.0), p.count = 10, p.flag = true;
    p.text = "a text: with, signs # and 'quotes'";
    p.formula = Formula("1 + 2*exp(-ICP_ITERATION)");
    p.corner[0] = -0.1, p.corner[1] = Formula("-SIZE"), p.corner[2] = 1e-300;
    p.names = {"x y", "1.50", "true"};
    p.inner.depth = 1e-7, p.inner.on = false;
    p.fruit = Fruit::Plum;
    return p;
}
}  // namespace

// ---- Ranges -----------------------------------------------------------------------------------------------

TEST(Range, EndsAreInOrOutAsStated)
{
    const double inf = std::numeric_limits<double>::infinity(), nan = std::nan("");
    EXPECT_TRUE(Range::between(0, 1).contains(0) && Range::between(0, 1).contains(1));
    EXPECT_FALSE(Range::open(0, 1).contains(0) || Range::open(0, 1).contains(1));
    EXPECT_TRUE(Range::open(0, 1).contains(std::nextafter(0.0, 1.0)));
    EXPECT_TRUE(Range::open(0, 1).contains(std::nextafter(1.0, 0.0)));
    EXPECT_FALSE(Range::between(0, 1).contains(std::nextafter(1.0, 2.0)));
    EXPECT_FALSE(Range::positive().contains(0) || Range::positive().contains(inf));
    EXPECT_TRUE(Range::positive().contains(5e-324) && Range::positive().contains(1e308));
    EXPECT_TRUE(Range::not_negative().contains(0) && Range::not_negative().contains(-0.0));
    EXPECT_FALSE(Range::not_negative().contains(inf) || Range::not_negative().contains(-5e-324));
    EXPECT_TRUE(Range::any().contains(inf) && Range::any().contains(-inf));
    for (const auto& range : {Range::any(), Range::positive(), Range::not_negative(), Range::between(0, 1)})
        EXPECT_FALSE(range.contains(nan));
}

TEST(Range, IsWrittenAsAnInterval)
{
    EXPECT_EQ(Range::positive().text(), "(0, inf)");
    EXPECT_EQ(Range::not_negative().text(), "[0, inf)");
    EXPECT_EQ(Range::between(-1, 0.5).text(), "[-1, 0.5]");
    EXPECT_EQ(Range::open(0, 1).text(), "(0, 1)");
    EXPECT_EQ((Range{0, 1, true, false}.text()), "(0, 1]");
    EXPECT_EQ(Range::any().text(), "any");
}

// ---- Loading ----------------------------------------------------------------------------------------------

TEST(Parameterizable, EveryKindIsLoaded)
{
    const Part p = loaded(
        "number: -0.25\nhalf_open: 1\ncount: 4\nflag: true\ntext: other layer\nformula: 3*ICP_ITERATION\n"
        "corner: [-1, 2*B, 1e3]\nnames: [one, two, three]\ninner: {depth: 2, on: false}\nfruit: "
        "Fruit::Plum\n");
    EXPECT_EQ(p.number, -0.25);
    EXPECT_EQ(p.half_open, 1.0);
    EXPECT_EQ(p.count, 4u);
    EXPECT_TRUE(p.flag);
    EXPECT_EQ(p.text, "other layer");
    EXPECT_EQ(p.formula.value({{"ICP_ITERATION", 5}}), 15);
    EXPECT_EQ(p.corner[0].value(), -1);
    EXPECT_EQ(p.corner[1].value({{"B", 2}}), 4);
    EXPECT_EQ(p.corner[2].value(), 1000);
    EXPECT_EQ(p.names, (std::vector<std::string>{"one", "two", "three"}));
    EXPECT_EQ(p.inner.depth, 2);
    EXPECT_FALSE(p.inner.on);
    EXPECT_EQ(p.fruit, Fruit::Plum);
}

TEST(Parameterizable, WhatIsNotGivenKeepsItsValue)
{
    expect_equal(loaded("~"), Part());
    expect_equal(loaded("{}"), Part());
    expect_equal(loaded(""), Part());
    Part p = unusual_part();
    p.load_parameters(yaml_from_text("count: 2\ninner: {on: true}"));
    EXPECT_EQ(p.count, 2u);
    EXPECT_TRUE(p.inner.on);
    EXPECT_EQ(p.inner.depth, 1e-7);
    EXPECT_EQ(p.number, 1.0 / 3);
}

TEST(Parameterizable, ANumberMayBeWrittenAsAConstantFormula)
{
    EXPECT_EQ(loaded("number: 1/4").number, 0.25);
    EXPECT_EQ(loaded("count: 2+3").count, 5u);
    expect_refused("number: ICP_ITERATION/100", {"params.number", "a number"});
}

TEST(Parameterizable, ValuesSetFromCppAreTakenWithAllDigits)
{
    yaml params = yaml::Map();
    params["number"] = 1.0 / 3;
    params["count"] = 4;
    params["flag"] = true;
    params["formula"] = 0.1;
    params["text"] = "t";
    Part p;
    p.load_parameters(params);
    EXPECT_EQ(p.number, 1.0 / 3);
    EXPECT_EQ(p.count, 4u);
    EXPECT_TRUE(p.flag);
    EXPECT_EQ(p.formula.value(), 0.1);
    EXPECT_EQ(p.text, "t");
}

TEST(Parameterizable, AnUnknownKeyIsRefusedWithItsLineAndTheNearestKey)
{
    expect_refused("number: 1\nformulla: 2\n", {"f.yaml:2", "params.formulla", "did you mean 'formula'"});
    expect_refused("number: 0\ninner:\n  on: true\n  dept: 2\n",
                   {"f.yaml:4", "params.inner.dept", "did you mean 'depth'"});
    expect_refused("Number: 0", {"did you mean 'number'"});  // keys are case-sensitive
}

TEST(Parameterizable, SomethingElseThanAMapIsRefused)
{
    expect_refused("[1, 2]", {"params"});
    expect_refused("text", {"params"});
    expect_refused("inner: 5", {"params.inner"});
    expect_refused("inner: [depth, 5]", {"params.inner"});
}

TEST(Parameterizable, ValuesOutOfRangeAreRefusedWithTheRange)
{
    expect_refused("\nnumber: 1.0000001", {"f.yaml:2", "params.number", "[-1, 1]", "1.0000001"});
    expect_refused("half_open: 0", {"params.half_open", "(0, 1]"});
    expect_refused("half_open: 1.5", {"params.half_open", "(0, 1]"});
    expect_refused("count: 0", {"params.count", "[1, 10]"});
    expect_refused("count: 11", {"params.count", "[1, 10]"});
    expect_refused("formula: 0", {"params.formula", "(0, inf)"});
    expect_refused("formula: 2-3", {"params.formula", "(0, inf)"});
    expect_refused("formula: .inf", {"params.formula"});
    EXPECT_EQ(loaded("number: 1").number, 1.0);
    EXPECT_EQ(loaded("number: -1").number, -1.0);
}

TEST(Parameterizable, NanIsNeverANumber)
{
    for (const char* nan : {".nan", "nan", ".NaN", "0/0", "sqrt(-1)"})
    {
        expect_refused(std::string("number: ") + nan, {"params.number"});
        expect_refused(std::string("formula: ") + nan, {"params.formula"});
        expect_refused(std::string("count: ") + nan, {"params.count"});
        expect_refused(std::string("corner: [0, ") + nan + ", 0]", {"params.corner[1]"});
        expect_refused<Needy>(std::string("needed: ") + nan, {"params.needed"});  // any number
    }
}

TEST(Parameterizable, WrongTypesAreRefused)
{
    expect_refused("number: a lot", {"params.number"});
    expect_refused("number: [1]", {"params.number"});
    expect_refused("number: {a: 1}", {"params.number"});
    expect_refused("number: ~", {"params.number"});
    expect_refused("number:", {"f.yaml:1", "number"});
    expect_refused("count: 2.5", {"params.count", "whole"});
    expect_refused("count: -3", {"params.count"});
    expect_refused<Needy>("needed: 1\nlo: -1", {"params.lo", "not negative"});
    expect_refused<Needy>("needed: 1\nlo: 4294967296", {"params.lo"});
    expect_refused<Needy>("needed: 1\nlo: .inf", {"params.lo"});
    expect_refused("flag: maybe", {"params.flag", "true or false", "maybe"});
    expect_refused("flag: 2", {"params.flag"});
    expect_refused("flag: [true]", {"params.flag"});
    expect_refused("text: [a]", {"params.text"});
    expect_refused("formula: 1 +", {"params.formula"});
    expect_refused("corner: 5", {"params.corner", "list of 3"});
    expect_refused("corner: [1, 2]", {"params.corner", "list of 3"});
    expect_refused("corner: [1, 2, 3, 4]", {"params.corner", "list of 3"});
    expect_refused("corner: [1, [2], 3]", {"params.corner[1]"});
    expect_refused("names: {a: 1}", {"params.names"});
    expect_refused("names: [a, [b]]", {"params.names[1]"});
}

TEST(Parameterizable, FlagsHaveTheUsualSpellings)
{
    for (const char* yes : {"true", "True", "TRUE", "yes", "on", "1"})
        EXPECT_TRUE(loaded(std::string("flag: ") + yes).flag) << yes;
    for (const char* no : {"false", "False", "no", "off", "0"})
    {
        Part p;
        p.flag = true;
        p.load_parameters(yaml_from_text(std::string("flag: ") + no));
        EXPECT_FALSE(p.flag) << no;
    }
}

TEST(Parameterizable, OneTextStandsForAListOfOne)
{
    EXPECT_EQ(loaded("names: single").names, (std::vector<std::string>{"single"}));
    EXPECT_TRUE(loaded("names: []").names.empty());
    EXPECT_EQ(loaded("text: ~").text, "");
    EXPECT_EQ(loaded("text: \"\"").text, "");
    EXPECT_EQ(loaded("text: 1.50").text, "1.50");
}

TEST(Parameterizable, AChoiceIsWrittenWithOrWithoutItsEnum)
{
    EXPECT_EQ(loaded("fruit: Fruit::Apple").fruit, Fruit::Apple);
    EXPECT_EQ(loaded("fruit: Apple").fruit, Fruit::Apple);
    expect_refused("\n\nfruit: Fruit::Aple",
                   {"f.yaml:3", "params.fruit", "Apple, Pear, Plum", "did you mean 'Fruit::Apple'"});
    expect_refused("fruit: Fruits::Apple", {"params.fruit"});
    expect_refused("fruit: apple", {"params.fruit", "Fruit::Apple"});
    expect_refused("fruit: 0", {"params.fruit", "Apple, Pear, Plum"});
    expect_refused("fruit: \"Fruit::\"", {"params.fruit"});
    expect_refused("fruit: \"\"", {"params.fruit"});
}

TEST(Parameterizable, ARequiredKeyMustBeThere)
{
    expect_refused<Needy>("optional: 1", {"params", "'needed'", "must be given"});
    expect_refused<Needy>("~", {"'needed'"});
    expect_refused<Needy>("{}", {"'needed'"});
    EXPECT_EQ(loaded<Needy>("needed: 4").needed, 4);
}

TEST(Parameterizable, AnOlderNameStandsForTheNewOneButNotBesideIt)
{
    EXPECT_EQ(loaded("size: 0.75").number, 0.75);
    EXPECT_EQ(loaded<Needy>("needed_before: 4").needed, 4);
    expect_refused("size: 0.75\nnumber: 0.75", {"size", "number", "only one"});
    expect_refused("size: 5", {"params.size", "[-1, 1]"});
}

TEST(Parameterizable, RulesSeeTheLoadedValues)
{
    EXPECT_EQ(loaded<Needy>("{needed: 1, lo: 5, hi: 6}").lo, 5u);
    expect_refused<Needy>("{needed: 1, lo: 6, hi: 6}", {"params", "lo must be below hi"});
}

// ---- Saving -----------------------------------------------------------------------------------------------

TEST(Parameterizable, EveryKindSurvivesSavingAndLoading)
{
    const Part p = unusual_part();
    Part back;
    back.load_parameters(p.save_parameters());
    expect_equal(back, p);
}

TEST(Parameterizable, EveryKindSurvivesBeingWrittenAsText)
{
    Part p = unusual_part();
    p.text = "raw 2", p.names = {"x y", "1.50"};  // MRPT's writer sets no quotes where YAML needs some
    std::ostringstream text;
    p.save_parameters().printAsYAML(text);
    Part back;
    back.load_parameters(yaml_from_text(text.str()));
    expect_equal(back, p);
}

TEST(Parameterizable, SavingAndDescribingChangeNothing)
{
    const Part p = unusual_part();
    p.save_parameters();
    p.describe_parameters();
    expect_equal(p, unusual_part());
}

TEST(Parameterizable, TheNewNameIsSaved)
{
    const yaml saved = loaded("size: 0.75").save_parameters();
    EXPECT_TRUE(saved.has("number"));
    EXPECT_FALSE(saved.has("size"));
}

// ---- The reference ----------------------------------------------------------------------------------------

TEST(Parameterizable, TheDescriptionNamesTypeUnitDefaultRangeAndHelp)
{
    const std::string text = Part().describe_parameters();
    for (const char* part :
         {"number: number [m], default 0.1, range [-1, 1], older name size\n      a number", "half_open",
          "(0, 1]", "count: integer, default 3", "flag: true/false, default false",
          "text: text, default \"raw\"", "formula: number or formula [deg], default 2, range (0, inf)",
          "corner: list of 3", "[1, 2, 3]", "names", "[a, b]", "inner: map", "depth: number [m], default 1.5",
          "how deep", "fruit: Fruit, default Fruit::Pear, range Apple, Pear, Plum"})
        EXPECT_NE(text.find(part), std::string::npos) << part << "\nis not in\n" << text;
    EXPECT_NE(Needy().describe_parameters().find("needed: number [m], required"), std::string::npos);
}

// ---- Variables --------------------------------------------------------------------------------------------

TEST(Parameterizable, VariablesOfTheRunWinOverThoseOfTheAttachedSource)
{
    Part p;
    EXPECT_EQ(p.seen_variables({{"a", 1}}), (RunVariables{{"a", 1}}));
    ParameterSource source;
    p.attachToParameterSource(source);
    source.updateVariables({{"a", 10}, {"b", 20}});
    EXPECT_EQ(p.seen_variables({{"a", 1}}), (RunVariables{{"a", 1}, {"b", 20}}));
}

TEST(Parameterizable, AnAttachedSourceOutlivesItsHandle)
{
    Part p;
    {
        ParameterSource source;
        source.updateVariable("a", 5);
        p.attachToParameterSource(source);
    }
    EXPECT_EQ(p.seen_variables({}), (RunVariables{{"a", 5}}));
}

TEST(CheckedValue, RefusesWhatAFormulaGivesOutOfRange)
{
    const Formula f("2 - ICP_ITERATION");
    EXPECT_EQ(checked_value(f, {{"ICP_ITERATION", 0.5}}, "threshold", Range::positive()), 1.5);
    expect_problem_with<std::runtime_error>(
        {"threshold", "2 - ICP_ITERATION", "-1", "(0, inf)"},
        [&]() {
            checked_value(f, {{"ICP_ITERATION", 3}}, "threshold", Range::positive());
        });
    const Formula nan("sqrt(-x)");
    EXPECT_THROW(checked_value(nan, {{"x", 1}}, "t", Range::any()), std::runtime_error);
}
