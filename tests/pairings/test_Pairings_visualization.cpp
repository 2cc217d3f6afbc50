#include <gtest/gtest.h>
#include <mp2p_icp/Pairings.h>
#include <mp2p_icp/se3.h>
#include <mrpt/opengl/CSetOfLines.h>

#include <cmath>
#include <functional>
#include <limits>

#include "expect_problem.h"

using namespace mp2p_icp;
using Eigen::Vector3d;
using mrpt::math::TPoint3D;
using mrpt::opengl::CSetOfLines;
using mrpt::opengl::CSetOfObjects;
using mrpt::poses::CPose3D;

namespace
{
constexpr double NaN = std::numeric_limits<double>::quiet_NaN();
constexpr double INF = std::numeric_limits<double>::infinity();
const CPose3D POSE(1, 2, 3, 0.4, 0.5, 0.6);

plane_patch_t patch(const TPoint3D& centroid, const Vector3d& normal)
{
    plane_patch_t p;
    p.plane.coefs = {normal.x(), normal.y(), normal.z(), -normal.dot(to_eigen(centroid))};
    p.centroid = centroid;
    return p;
}
mrpt::math::TLine3D line(const TPoint3D& base, const mrpt::math::TVector3D& director)
{
    mrpt::math::TLine3D l;
    l.pBase = base, l.director = director;
    return l;
}

/// One pairing of each kind, lines and planes along axes, no unit vectors, nothing at rest.
const mrpt::tfest::TMatchingPair_d PT2PT(0, 0, 5, 6, 7, -1, 2, 4);
const point_line_pair_t PT2LN{line({1, -2, 0.5}, {0, 0, 2}), {4, 5, 6}};
const point_plane_pair_t PT2PL{patch({7, 8, 2}, {0, 0, 3}), {-3, 1, 5}};
const matched_line_t LN2LN{line({1, -2, 0.5}, {0, 0, -2}), line({3, 4, 5}, {0, 3, 0})};
const matched_plane_t PL2PL{patch({7, 8, 2}, {0, 0, 3}), patch({1, 1, 1}, {0.5, 0, 0})};

Pairings one_of_each()
{
    Pairings p;
    p.paired_pt2pt.push_back(PT2PT);
    p.paired_pt2ln = {PT2LN}, p.paired_pt2pl = {PT2PL}, p.paired_ln2ln = {LN2LN}, p.paired_pl2pl = {PL2PL};
    return p;
}

struct Segment
{
    Vector3d from, to;
    Vector3d along() const { return to - from; }
    Vector3d middle() const { return 0.5 * (from + to); }
};

/// Of one role of one kind; none if they are not there.
std::vector<Segment> segments_of(const CSetOfObjects::Ptr& kind, const std::string& role)
{
    std::vector<Segment> out;
    const auto lines = std::dynamic_pointer_cast<CSetOfLines>(kind->getByName(role));
    if (!lines) return out;
    for (const auto& s : *lines) out.push_back({to_eigen(s.point1), to_eigen(s.point2)});
    return out;
}
/// Of all kinds and roles.
std::vector<Segment> all_segments(const CSetOfObjects::Ptr& scene)
{
    std::vector<Segment> out;
    for (const char* kind : {"pt2pt", "pt2ln", "pt2pl", "ln2ln", "pl2pl"})
        for (const char* role : {"global", "local", "residuals"})
            if (const auto set = std::dynamic_pointer_cast<CSetOfObjects>(scene->getByName(kind)); set)
                for (const auto& s : segments_of(set, role)) out.push_back(s);
    return out;
}

void expect_near(const Vector3d& a, const Vector3d& b, double tolerance = 1e-12)
{
    EXPECT_LT((a - b).norm(), tolerance) << a.transpose() << " and " << b.transpose();
}
void expect_near(const Segment& s, const Vector3d& from, const Vector3d& to)
{
    expect_near(s.from, from), expect_near(s.to, to);
}

Vector3d moved(const TPoint3D& p)
{
    return to_eigen(POSE.composePoint(p));
}

/// The first four segments are the border of a square.
void expect_square(const std::vector<Segment>& s, const Vector3d& centre, const Vector3d& normal, double side)
{
    ASSERT_GE(s.size(), 4u);
    Vector3d sum = Vector3d::Zero();
    for (size_t i = 0; i < 4; i++)
    {
        const Segment &here = s[i], &next = s[(i + 1) % 4];
        expect_near(here.to, next.from);
        EXPECT_NEAR(here.along().norm(), side, 1e-12);
        EXPECT_NEAR(here.along().dot(next.along()), 0, 1e-12);
        EXPECT_NEAR((here.from - centre).dot(normal), 0, 1e-12);
        sum += here.from;
    }
    expect_near(sum / 4, centre);
}
}  // namespace

// ---- The geometry of each kind ----------------------------------------------------------------------------

TEST(PairingsVisualization, PointsAreJoined)
{
    Pairings p = one_of_each();
    p.paired_pt2pt.emplace_back(0, 0, 1, 1, 1, 2, 3, 4);
    const auto scene = p.get_visualization_pt2pt(POSE, {});
    EXPECT_EQ(scene->size(), 1u);
    const auto s = segments_of(scene, "residuals");
    ASSERT_EQ(s.size(), 2u);
    expect_near(s[0], {5, 6, 7}, moved({-1, 2, 4}));
    expect_near(s[1], {1, 1, 1}, moved({2, 3, 4}));
}

TEST(PairingsVisualization, PointAndLineAreJoinedAtTheFootOfThePoint)
{
    render_params_pairings_pt2ln_t p;
    p.lineLength = 0.8;
    const auto scene = one_of_each().get_visualization_pt2ln(POSE, p);
    EXPECT_EQ(scene->size(), 2u);
    const auto lines = segments_of(scene, "global"), residuals = segments_of(scene, "residuals");
    ASSERT_EQ(lines.size(), 1u);
    ASSERT_EQ(residuals.size(), 1u);
    const Vector3d point = moved({4, 5, 6}), foot(1, -2, point.z());
    expect_near(lines[0], foot - Vector3d(0, 0, 0.4), foot + Vector3d(0, 0, 0.4));
    expect_near(residuals[0], foot, point);
}

TEST(PairingsVisualization, PointAndPlaneAreJoinedAtTheFootOfThePoint)
{
    render_params_pairings_pt2pl_t p;
    p.planePatchSize = 0.6;
    const auto scene = one_of_each().get_visualization_pt2pl(POSE, p);
    EXPECT_EQ(scene->size(), 2u);
    const auto border = segments_of(scene, "global"), residuals = segments_of(scene, "residuals");
    ASSERT_EQ(border.size(), 4u);
    ASSERT_EQ(residuals.size(), 1u);
    expect_square(border, {7, 8, 2}, {0, 0, 1}, 0.6);
    const Vector3d point = moved({-3, 1, 5});
    expect_near(residuals[0], {point.x(), point.y(), 2}, point);
}

TEST(PairingsVisualization, LinesAreJoinedFromTheFootOfTheLocalBasePoint)
{
    render_params_pairings_ln2ln_t p;
    p.lineLength = 0.8;
    const auto scene = one_of_each().get_visualization_ln2ln(POSE, p);
    EXPECT_EQ(scene->size(), 3u);
    const auto global = segments_of(scene, "global"), local = segments_of(scene, "local"),
               residuals = segments_of(scene, "residuals");
    ASSERT_EQ(global.size(), 1u);
    ASSERT_EQ(local.size(), 1u);
    ASSERT_EQ(residuals.size(), 1u);
    const Vector3d base = moved({3, 4, 5}), foot(1, -2, base.z());
    expect_near(global[0], foot + Vector3d(0, 0, 0.4), foot - Vector3d(0, 0, 0.4));
    expect_near(local[0], moved({3, 3.6, 5}), moved({3, 4.4, 5}));
    expect_near(residuals[0], foot, base);
}

TEST(PairingsVisualization, PlanesHaveNormalsAndTheirCentroidsAreJoined)
{
    render_params_pairings_pl2pl_t p;
    p.planePatchSize = 0.6;
    p.normalLength = 0.3;
    const auto scene = one_of_each().get_visualization_pl2pl(POSE, p);
    EXPECT_EQ(scene->size(), 3u);
    const auto global = segments_of(scene, "global"), local = segments_of(scene, "local"),
               residuals = segments_of(scene, "residuals");
    ASSERT_EQ(global.size(), 5u);
    ASSERT_EQ(local.size(), 5u);
    ASSERT_EQ(residuals.size(), 1u);
    expect_square(global, {7, 8, 2}, {0, 0, 1}, 0.6);
    expect_near(global[4], {7, 8, 2}, {7, 8, 2.3});
    expect_square(local, moved({1, 1, 1}), rotation_of(POSE) * Vector3d(1, 0, 0), 0.6);
    expect_near(local[4], moved({1, 1, 1}), moved({1.3, 1, 1}));
    expect_near(residuals[0], {7, 8, 2}, moved({1, 1, 1}));
}

TEST(PairingsVisualization, PrimitivesInGeneralPositionKeepRightAngles)
{
    const Vector3d u = Vector3d(1, -2, 0.7).normalized();
    Pairings p;
    p.paired_pt2ln = {{line({1, 2, 3}, to_mrpt(5 * u)), {4, -5, 6}}};
    p.paired_pt2pl = {{patch({1, 2, 3}, 0.1 * u), {4, -5, 6}}};
    const auto on_line = segments_of(p.get_visualization_pt2ln(POSE, {}), "residuals");
    const auto on_plane = segments_of(p.get_visualization_pt2pl(POSE, {}), "residuals");
    const auto border = segments_of(p.get_visualization_pt2pl(POSE, {}), "global");
    ASSERT_EQ(on_line.size(), 1u);
    ASSERT_EQ(on_plane.size(), 1u);
    expect_square(border, {1, 2, 3}, u, 0.2);
    expect_near(on_line[0].to, moved({4, -5, 6}));
    EXPECT_NEAR(on_line[0].along().dot(u), 0, 1e-12);
    expect_near((on_line[0].from - Vector3d(1, 2, 3)).cross(u), Vector3d::Zero());
    expect_near(on_plane[0].to, moved({4, -5, 6}));
    expect_near(on_plane[0].along().cross(u), Vector3d::Zero());
    EXPECT_NEAR((on_plane[0].from - Vector3d(1, 2, 3)).dot(u), 0, 1e-12);
}

TEST(PairingsVisualization, LocalPrimitivesMoveRigidlyAndGlobalOnesStay)
{
    const auto at_rest = one_of_each().get_visualization(CPose3D()),
               after = one_of_each().get_visualization(POSE);
    const auto kind = [](const auto& scene, const char* name)
    { return std::dynamic_pointer_cast<CSetOfObjects>(scene->getByName(name)); };
    for (const char* name : {"ln2ln", "pl2pl"})
    {
        const auto before = segments_of(kind(at_rest, name), "local"),
                   now = segments_of(kind(after, name), "local");
        ASSERT_EQ(before.size(), now.size());
        for (size_t i = 0; i < now.size(); i++)
            expect_near(now[i], moved(to_mrpt(before[i].from)), moved(to_mrpt(before[i].to)));
    }
    for (const char* name : {"pt2pl", "pl2pl"})
    {
        const auto before = segments_of(kind(at_rest, name), "global"),
                   now = segments_of(kind(after, name), "global");
        ASSERT_EQ(before.size(), now.size());
        for (size_t i = 0; i < now.size(); i++) expect_near(now[i], before[i].from, before[i].to);
    }
}

// ---- What is drawn, and in which colours ------------------------------------------------------------------

TEST(PairingsVisualization, EveryKindIsOneSet)
{
    const auto scene = one_of_each().get_visualization(POSE);
    EXPECT_EQ(scene->size(), 5u);
    EXPECT_EQ(all_segments(scene).size(), 1u + 2 + 5 + 3 + 11);
    EXPECT_TRUE(Pairings().get_visualization(POSE)->empty());
    Pairings lines;
    lines.paired_ln2ln = {LN2LN};
    const auto only_lines = lines.get_visualization(POSE);
    EXPECT_EQ(only_lines->size(), 1u);
    EXPECT_TRUE(only_lines->getByName("ln2ln"));
}

TEST(PairingsVisualization, WhatIsNotVisibleIsNotDrawn)
{
    const std::pair<const char*, bool* (*)(pairings_render_params_t&)> kinds[] = {
        {"pt2pt", [](auto& p) { return &p.pt2pt.visible; }},
        {"pt2ln", [](auto& p) { return &p.pt2ln.visible; }},
        {"pt2pl", [](auto& p) { return &p.pt2pl.visible; }},
        {"ln2ln", [](auto& p) { return &p.ln2ln.visible; }},
        {"pl2pl", [](auto& p) { return &p.pl2pl.visible; }}};
    pairings_render_params_t none;
    for (const auto& [name, visible] : kinds)
    {
        pairings_render_params_t p;
        *visible(p) = *visible(none) = false;
        const auto scene = one_of_each().get_visualization(POSE, p);
        EXPECT_EQ(scene->size(), 4u);
        EXPECT_FALSE(scene->getByName(name)) << name;
    }
    const Pairings all = one_of_each();
    EXPECT_TRUE(all.get_visualization(POSE, none)->empty());
    EXPECT_TRUE(all.get_visualization_pt2pt(POSE, none.pt2pt)->empty());
    EXPECT_TRUE(all.get_visualization_pt2ln(POSE, none.pt2ln)->empty());
    EXPECT_TRUE(all.get_visualization_pt2pl(POSE, none.pt2pl)->empty());
    EXPECT_TRUE(all.get_visualization_ln2ln(POSE, none.ln2ln)->empty());
    EXPECT_TRUE(all.get_visualization_pl2pl(POSE, none.pl2pl)->empty());
}

TEST(PairingsVisualization, ParametersOfEachKindArePassedOn)
{
    pairings_render_params_t p;
    p.pt2ln.lineLength = 1, p.pt2pl.planePatchSize = 2, p.ln2ln.lineLength = 3;
    p.pl2pl.planePatchSize = 4, p.pl2pl.normalLength = 5;
    const auto scene = one_of_each().get_visualization(POSE, p);
    const auto first_length = [&](const char* name, size_t i)
    {
        const auto kind = std::dynamic_pointer_cast<CSetOfObjects>(scene->getByName(name));
        return segments_of(kind, "global").at(i).along().norm();
    };
    EXPECT_NEAR(first_length("pt2ln", 0), 1, 1e-12);
    EXPECT_NEAR(first_length("pt2pl", 0), 2, 1e-12);
    EXPECT_NEAR(first_length("ln2ln", 0), 3, 1e-12);
    EXPECT_NEAR(first_length("pl2pl", 0), 4, 1e-12);
    EXPECT_NEAR(first_length("pl2pl", 4), 5, 1e-12);
}

TEST(PairingsVisualization, ColoursAreThoseOfTheParameters)
{
    using mrpt::img::TColor;
    const TColor global(1, 2, 3, 200), local(4, 5, 6, 201), residual(7, 8, 9, 202);
    pairings_render_params_t p;
    p.pt2pt.color = residual;
    p.pt2ln.color = p.pt2pl.color = p.ln2ln.color = p.pl2pl.color = global;
    p.ln2ln.localColor = p.pl2pl.localColor = local;
    p.pt2ln.segmentColor = p.pt2pl.segmentColor = p.ln2ln.segmentColor = p.pl2pl.segmentColor = residual;
    const auto scene = one_of_each().get_visualization(POSE, p);
    size_t seen = 0;
    for (const auto& kind : *scene)
        for (const auto& lines : *std::dynamic_pointer_cast<CSetOfObjects>(kind))
        {
            const TColor& expected = lines->getName() == "global"  ? global
                                     : lines->getName() == "local" ? local
                                                                   : residual;
            EXPECT_EQ(lines->getColor_u8(), expected) << kind->getName() << " " << lines->getName();
            seen++;
        }
    EXPECT_EQ(seen, 1u + 2 + 2 + 3 + 3);
}

TEST(PairingsVisualization, DerivedClassesMayDrawAKindTheirWay)
{
    struct Mine : public Pairings
    {
        CSetOfObjects::Ptr get_visualization_pt2pl(const CPose3D&,
                                                   const render_params_pairings_pt2pl_t&) const override
        {
            auto o = CSetOfObjects::Create();
            o->insert(CSetOfLines::Create());
            o->setName("mine");
            return o;
        }
    };
    const auto scene = Mine().get_visualization(POSE);
    EXPECT_EQ(scene->size(), 1u);
    EXPECT_TRUE(scene->getByName("mine"));
}

// ---- Bad input --------------------------------------------------------------------------------------------

namespace
{
/// All numbers of a pairing.
std::vector<double*> numbers_of(TPoint3D& p)
{
    return {&p.x, &p.y, &p.z};
}
template <class... Parts>
std::vector<double*> numbers_of(TPoint3D& first, Parts&... more)
{
    std::vector<double*> all = numbers_of(first);
    for (double* number : numbers_of(more...)) all.push_back(number);
    return all;
}
std::vector<double*> numbers_of(plane_patch_t& p)
{
    auto all = numbers_of(p.centroid);
    for (double& c : p.plane.coefs) all.push_back(&c);
    return all;
}
std::vector<double*> numbers_of(point_line_pair_t& p)
{
    return numbers_of(p.ln_global.pBase, p.ln_global.director, p.pt_local);
}
std::vector<double*> numbers_of(point_plane_pair_t& p)
{
    auto all = numbers_of(p.pl_global);
    for (double* number : numbers_of(p.pt_local)) all.push_back(number);
    return all;
}
std::vector<double*> numbers_of(matched_line_t& p)
{
    return numbers_of(p.ln_global.pBase, p.ln_global.director, p.ln_local.pBase, p.ln_local.director);
}
std::vector<double*> numbers_of(matched_plane_t& p)
{
    auto all = numbers_of(p.p_global);
    for (double* number : numbers_of(p.p_local)) all.push_back(number);
    return all;
}

/// A bad pairing between two good ones must leave what the two good ones draw.
void expect_left_out(const Pairings& good_bad_good, const Pairings& good_good, const std::string& what)
{
    const auto with = all_segments(good_bad_good.get_visualization(POSE)),
               without = all_segments(good_good.get_visualization(POSE));
    ASSERT_FALSE(without.empty());
    ASSERT_EQ(with.size(), without.size()) << what;
    for (size_t i = 0; i < with.size(); i++)
    {
        EXPECT_EQ(with[i].from, without[i].from) << what;
        EXPECT_EQ(with[i].to, without[i].to) << what;
    }
}

template <class List, class Pair>
void expect_every_bad_number_is_left_out(List Pairings::*list, const Pair& good, size_t number_count)
{
    Pairings good_good;
    good_good.*list = {good, good};
    for (const double bad : {NaN, INF, -INF})
        for (size_t i = 0; i < number_count; i++)
        {
            Pair damaged = good;
            const auto numbers = numbers_of(damaged);
            ASSERT_EQ(numbers.size(), number_count);
            *numbers[i] = bad;
            Pairings p;
            p.*list = {good, damaged, good};
            expect_left_out(p, good_good, "number " + std::to_string(i) + " is " + std::to_string(bad));
        }
}

template <class List, class Pair>
void expect_is_left_out(List Pairings::*list, const Pair& good, const Pair& bad, const char* what)
{
    Pairings good_good, good_bad_good;
    good_good.*list = {good, good};
    good_bad_good.*list = {good, bad, good};
    expect_left_out(good_bad_good, good_good, what);
}
}  // namespace

TEST(PairingsVisualization, PointPairsThatAreNotFiniteAreLeftOut)
{
    Pairings good_good;
    good_good.paired_pt2pt.push_back(PT2PT), good_good.paired_pt2pt.push_back(PT2PT);
    for (const double bad : {NaN, INF, -INF, 1e39, -1e300})
        for (int i = 0; i < 6; i++)
        {
            auto damaged = PT2PT;
            (i < 3 ? damaged.global : damaged.local)[static_cast<size_t>(i % 3)] = bad;
            Pairings p;
            for (const auto& pair : {PT2PT, damaged, PT2PT}) p.paired_pt2pt.push_back(pair);
            expect_left_out(p, good_good, std::to_string(i) + ": " + std::to_string(bad));
        }
}

TEST(PairingsVisualization, PrimitivesThatAreNotFiniteAreLeftOut)
{
    expect_every_bad_number_is_left_out(&Pairings::paired_pt2ln, PT2LN, 9);
    expect_every_bad_number_is_left_out(&Pairings::paired_pt2pl, PT2PL, 10);
    expect_every_bad_number_is_left_out(&Pairings::paired_ln2ln, LN2LN, 12);
    expect_every_bad_number_is_left_out(&Pairings::paired_pl2pl, PL2PL, 14);
}

TEST(PairingsVisualization, DirectionsOfZeroLengthAreLeftOut)
{
    auto pt2ln = PT2LN;
    pt2ln.ln_global.director = {0, 0, 0};
    expect_is_left_out(&Pairings::paired_pt2ln, PT2LN, pt2ln, "pt2ln");
    auto pt2pl = PT2PL;
    pt2pl.pl_global.plane.coefs = {0, 0, 0, 1};
    expect_is_left_out(&Pairings::paired_pt2pl, PT2PL, pt2pl, "pt2pl");
    auto global_line = LN2LN, local_line = LN2LN;
    global_line.ln_global.director = local_line.ln_local.director = {0, 0, 0};
    expect_is_left_out(&Pairings::paired_ln2ln, LN2LN, global_line, "ln2ln global");
    expect_is_left_out(&Pairings::paired_ln2ln, LN2LN, local_line, "ln2ln local");
    auto global_plane = PL2PL, local_plane = PL2PL;
    global_plane.p_global.plane.coefs = local_plane.p_local.plane.coefs = {0, 0, 0, 1};
    expect_is_left_out(&Pairings::paired_pl2pl, PL2PL, global_plane, "pl2pl global");
    expect_is_left_out(&Pairings::paired_pl2pl, PL2PL, local_plane, "pl2pl local");
}

TEST(PairingsVisualization, VeryShortAndVeryLongDirectionsAreStillDirections)
{
    const auto expected = all_segments(one_of_each().get_visualization(POSE));
    for (const double scale : {1e-200, 1e200})
    {
        Pairings p = one_of_each();
        p.paired_pt2ln[0].ln_global.director *= scale;
        p.paired_ln2ln[0].ln_global.director *= scale, p.paired_ln2ln[0].ln_local.director *= scale;
        for (auto* plane : {&p.paired_pt2pl[0].pl_global.plane, &p.paired_pl2pl[0].p_global.plane,
                            &p.paired_pl2pl[0].p_local.plane})
            for (double& c : plane->coefs) c *= scale;
        const auto s = all_segments(p.get_visualization(POSE));
        ASSERT_EQ(s.size(), expected.size());
        for (size_t i = 0; i < s.size(); i++) expect_near(s[i], expected[i].from, expected[i].to);
    }
}

TEST(PairingsVisualization, APoseThatIsNotFiniteDrawsNothing)
{
    for (const double bad : {NaN, INF})
    {
        CPose3D pose = POSE;
        pose.x(bad);
        EXPECT_TRUE(one_of_each().get_visualization(pose)->empty());
    }
}

TEST(PairingsVisualization, BadSizesAreNamed)
{
    using Params = pairings_render_params_t;
    const std::pair<const char*, double* (*)(Params&)> sizes[] = {
        {"pt2ln.lineLength", [](Params& p) { return &p.pt2ln.lineLength; }},
        {"pt2pl.planePatchSize", [](Params& p) { return &p.pt2pl.planePatchSize; }},
        {"ln2ln.lineLength", [](Params& p) { return &p.ln2ln.lineLength; }},
        {"pl2pl.planePatchSize", [](Params& p) { return &p.pl2pl.planePatchSize; }},
        {"pl2pl.normalLength", [](Params& p) { return &p.pl2pl.normalLength; }}};
    for (const auto& [name, size] : sizes)
    {
        for (const double bad : {-0.1, NaN, INF})
        {
            Params p;
            *size(p) = bad;
            mp2p_icp_test::expect_problem_with<std::invalid_argument>(
                {name}, [&, &params = p]() { one_of_each().get_visualization(POSE, params); });
        }
        Params p;
        *size(p) = 0;
        EXPECT_EQ(one_of_each().get_visualization(POSE, p)->size(), 5u);
    }
}
