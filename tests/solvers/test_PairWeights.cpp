#include <mp2p_icp/WeightParameters.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/optimal_tf_gauss_newton.h>
#include <mp2p_icp/optimal_tf_horn.h>
#include <mp2p_icp/optimal_tf_olae.h>

#include <sstream>

#include "expect_problem.h"
#include "random_pairings.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
const Mix ALL{8, 5, 6, 7, 8}, WITHOUT_POINTS{0, 0, 0, 7, 8}, ONE_POINT{1, 0, 0, 7, 8},
    ON_LINES_AND_PLANES{0, 5, 6, 7, 8};

PairWeights loaded(const std::string& text)
{
    PairWeights w;
    w.load_parameters(yaml_from_text(text, "f.yaml"), {"f.yaml", "w"});
    return w;
}

Vector3d direction(const mrpt::math::TLine3D& l)
{
    return to_eigen(l.director).normalized();
}
Vector3d direction(const plane_patch_t& p)
{
    return Vector3d(p.plane.coefs[0], p.plane.coefs[1], p.plane.coefs[2]).normalized();
}

/// The rms radius of the local points of points, lines and planes, written out; 1 where it does not exist.
double rms_radius(const Pairings& p, const PairWeights& kinds)
{
    std::vector<std::pair<double, Vector3d>> points;
    for (size_t i = 0; i < p.paired_pt2pt.size(); i++) points.emplace_back(kinds.pt2pt, local_of(p, i));
    for (const auto& x : p.paired_pt2ln) points.emplace_back(kinds.pt2ln, to_eigen(x.pt_local));
    for (const auto& x : p.paired_pt2pl) points.emplace_back(kinds.pt2pl, to_eigen(x.pt_local));
    if (points.size() < 2) return 1;
    double w = 0, squares = 0;
    Vector3d mean = Vector3d::Zero();
    for (const auto& [weight, b] : points) w += weight, mean += weight * b;
    mean /= w;
    for (const auto& [weight, b] : points) squares += weight * (b - mean).squaredNorm();
    return std::sqrt(squares / w);
}

/// What the header says that pairings cost at a pose.
double stated_cost(const Pairings& p, const PairWeights& k, const CPose3D& pose)
{
    const Matrix3d R = rotation_of(pose);
    const Vector3d t = translation_of(pose);
    const double L_sq = std::pow(rms_radius(p, k), 2);
    const auto off_line = [&](const mrpt::math::TLine3D& l, const Vector3d& b)
    { return (R * b + t - to_eigen(l.pBase)).cross(direction(l)).squaredNorm(); };
    const auto off_plane = [&](const plane_patch_t& g, const Vector3d& b)
    { return std::pow((R * b + t - to_eigen(g.centroid)).dot(direction(g)), 2); };
    const auto turned = [&](const Vector3d& global, const Vector3d& local, DirectionSign sign)
    {
        return sign == DirectionSign::Free ? 1 - std::pow(global.dot(R * local), 2)
                                           : (global - R * local).squaredNorm();
    };
    double sum = 0;
    for (size_t i = 0; i < p.paired_pt2pt.size(); i++)
        sum += k.pt2pt * (R * local_of(p, i) + t - global_of(p, i)).squaredNorm();
    for (const auto& x : p.paired_pt2ln) sum += k.pt2ln * off_line(x.ln_global, to_eigen(x.pt_local));
    for (const auto& x : p.paired_pt2pl) sum += k.pt2pl * off_plane(x.pl_global, to_eigen(x.pt_local));
    for (const auto& x : p.paired_ln2ln)
        sum += k.ln2ln * off_line(x.ln_global, to_eigen(x.ln_local.pBase)) +
               k.ln2ln_direction.value_or(k.ln2ln * L_sq) *
                   turned(direction(x.ln_global), direction(x.ln_local), k.ln2ln_sign);
    for (const auto& x : p.paired_pl2pl)
        sum += k.pl2pl * off_plane(x.p_global, to_eigen(x.p_local.centroid)) +
               k.pl2pl_direction.value_or(k.pl2pl * L_sq) *
                   turned(direction(x.p_global), direction(x.p_local), k.pl2pl_sign);
    return sum;
}

double cost_of_library(const Pairings& p, const PairWeights& kinds, const CPose3D& pose)
{
    OptimalTF_GN_Parameters at_once;
    at_once.linearizationPoint = pose, at_once.pairWeights = kinds, at_once.maxInnerLoopIterations = 0;
    OptimalTF_Result result;
    GaussNewtonReport report;
    EXPECT_TRUE(optimal_tf_gauss_newton(p, result, at_once, &report));
    return report.cost;
}

void expect_stated_cost(const Mix& mix, const PairWeights& kinds, uint64_t seed)
{
    SCOPED_TRACE(::testing::Message() << "seed " << seed);
    SeededRandom random(seed);
    const Matrix3d R = any_rotation(random);
    const Vector3d t = random_point(random, 10);
    const Pairings p = random_pairings(mix, R, t, random, 0.3);
    for (const auto& pose : {make_pose(R, t), any_pose(random, 5)})
    {
        const double cost = stated_cost(p, kinds, pose);
        EXPECT_GT(cost, 0.01);
        EXPECT_NEAR(cost_of_library(p, kinds, pose), cost, 1e-12 * cost);
    }
}

/// The poses of the three solvers.
std::vector<CPose3D> poses(const Pairings& p, const PairWeights& kinds, const CPose3D& guess)
{
    WeightParameters wp;
    wp.pair_weights = kinds;
    OptimalTF_GN_Parameters gn;
    gn.pairWeights = kinds, gn.linearizationPoint = guess, gn.maxInnerLoopIterations = 50,
    gn.minDelta = 1e-13;
    OptimalTF_Result horn, olae, gauss_newton;
    EXPECT_TRUE(optimal_tf_horn(p, wp, horn, guess));
    EXPECT_TRUE(optimal_tf_olae(p, wp, olae, guess));
    EXPECT_TRUE(optimal_tf_gauss_newton(p, gauss_newton, gn));
    return {horn.optimalPose, olae.optimalPose, gauss_newton.optimalPose};
}

void expect_same(const std::vector<CPose3D>& a, const std::vector<CPose3D>& b, bool same)
{
    for (size_t i = 0; i < a.size(); i++)
    {
        const double angle = angle_between(rotation_of(a[i]), rotation_of(b[i]));
        if (same)
            EXPECT_LT(angle, 1e-10) << "solver " << i;
        else
            EXPECT_GT(angle, 1e-5) << "solver " << i;
    }
}
}  // namespace

// ---- YAML -------------------------------------------------------------------------------------------------

TEST(PairWeights, KeysOfDirectionsAndSignsAreLoaded)
{
    const PairWeights w = loaded(
        "{ln2ln_direction: 2.5, pl2pl_direction: 0, ln2ln_sign: Oriented, pl2pl_sign: DirectionSign::Free}");
    EXPECT_EQ(w.ln2ln_direction, std::optional<double>(2.5));
    EXPECT_EQ(w.pl2pl_direction, std::optional<double>(0));
    EXPECT_EQ(w.ln2ln_sign, DirectionSign::Oriented);
    EXPECT_EQ(w.pl2pl_sign, DirectionSign::Free);
    WeightParameters whole;
    whole.load_parameters(yaml_from_text("pair_weights: {pl2pl_direction: 7, ln2ln_sign: Oriented}"));
    EXPECT_EQ(whole.pair_weights.pl2pl_direction, std::optional<double>(7));
    EXPECT_EQ(whole.pair_weights.ln2ln_sign, DirectionSign::Oriented);
}

TEST(PairWeights, WithoutKeysLinesAreFreeNormalsOrientedAndDirectionsWeighByTheRadius)
{
    const PairWeights w = loaded("{pt2pt: 1}");
    EXPECT_FALSE(w.ln2ln_direction.has_value());
    EXPECT_FALSE(w.pl2pl_direction.has_value());
    EXPECT_EQ(w.ln2ln_sign, DirectionSign::Free);
    EXPECT_EQ(w.pl2pl_sign, DirectionSign::Oriented);
}

TEST(PairWeights, ValuesThatMakeNoSenseAreRefusedWithTheirPlace)
{
    const auto refused = [](const std::string& text, const std::vector<std::string>& parts)
    { expect_problem_with<ConfigError>(parts, [&]() { loaded(text); }); };
    refused("ln2ln_direction: -1", {"f.yaml:1", "w.ln2ln_direction"});
    refused("pl2pl_direction: .nan", {"w.pl2pl_direction"});
    refused("pl2pl_direction: .inf", {"w.pl2pl_direction"});
    refused("pl2pl_direction: much", {"w.pl2pl_direction"});
    refused("ln2ln_sign: free_", {"w.ln2ln_sign", "Free"});
    refused("pl2pl_directions: 1", {"w.pl2pl_directions", "did you mean 'pl2pl_direction'"});
}

TEST(PairWeights, WhatIsSavedLoadsAgainAlsoWhatIsNotSet)
{
    PairWeights w;
    w.ln2ln_direction = 1.0 / 3, w.ln2ln_sign = DirectionSign::Oriented, w.pl2pl_sign = DirectionSign::Free;
    std::ostringstream text;
    w.save_parameters().printAsYAML(text);
    const PairWeights back = loaded(text.str());
    EXPECT_EQ(back.ln2ln_direction, w.ln2ln_direction) << text.str();
    EXPECT_FALSE(back.pl2pl_direction.has_value()) << text.str();
    EXPECT_EQ(back.ln2ln_sign, DirectionSign::Oriented);
    EXPECT_EQ(back.pl2pl_sign, DirectionSign::Free);
}

// ---- What they mean ---------------------------------------------------------------------------------------

TEST(PairWeights, EmptyDirectionWeightsAreThePositionsTimesTheSquaredRadius)
{
    PairWeights uneven;
    uneven.pt2pt = 0.5, uneven.pt2ln = 3, uneven.pt2pl = 0.2, uneven.ln2ln = 2, uneven.pl2pl = 0.7;
    for (uint64_t seed = 1; seed <= 5; seed++)
        for (const Mix& mix : {ALL, ON_LINES_AND_PLANES, WITHOUT_POINTS, ONE_POINT})
        {
            expect_stated_cost(mix, {}, seed);
            expect_stated_cost(mix, uneven, seed);
        }
}

TEST(PairWeights, CoincidingPointsHaveARadiusOfOne)
{
    SeededRandom random(3);
    Pairings p = random_pairings(WITHOUT_POINTS, Matrix3d::Identity(), {0, 0, 0}, random, 0.3);
    for (int k = 0; k < 3; k++) add_pair(p, {0.1, 0.2, 0.35}, {0.1, 0.2, 0.3});
    PairWeights unity;
    unity.ln2ln_direction = unity.pl2pl_direction = 1;
    const CPose3D pose(0.1, 0.2, 0.3, 0.4, 0.5, 0.6);
    EXPECT_NEAR(cost_of_library(p, {}, pose), stated_cost(p, unity, pose), 1e-10);
}

TEST(PairWeights, GivenDirectionWeightsAreUsedAsTheyAre)
{
    for (uint64_t seed = 1; seed <= 5; seed++)
        for (const double line_weight : {0.0, 0.3, 50.0})
            for (const double plane_weight : {0.0, 2.0})
            {
                PairWeights kinds;
                kinds.ln2ln_direction = line_weight, kinds.pl2pl_direction = plane_weight;
                kinds.ln2ln = 0.1, kinds.pl2pl = 20;
                expect_stated_cost(ALL, kinds, seed);
                kinds.ln2ln = kinds.pl2pl = 0;  // then only the directions count
                expect_stated_cost(ALL, kinds, seed);
            }
}

TEST(PairWeights, BothSignSettingsCostWhatTheySay)
{
    for (const auto lines : {DirectionSign::Free, DirectionSign::Oriented})
        for (const auto planes : {DirectionSign::Free, DirectionSign::Oriented})
        {
            PairWeights kinds;
            kinds.ln2ln_sign = lines, kinds.pl2pl_sign = planes;
            expect_stated_cost(ALL, kinds, 1);
            expect_stated_cost(WITHOUT_POINTS, kinds, 2);
        }
}

TEST(PairWeights, AllSolversTakeTheDefaultForTheRadiusSquared)
{
    SeededRandom random(4);
    const Matrix3d R = any_rotation(random);
    const Pairings p = random_pairings(ALL, R, {1, 2, 3}, random, 0.3);
    const CPose3D guess = make_pose(R, {1, 2, 3});
    PairWeights same;
    same.pl2pl = 3;
    PairWeights stated = same, other = same;
    const double L_sq = std::pow(rms_radius(p, same), 2);
    stated.ln2ln_direction = L_sq, stated.pl2pl_direction = 3 * L_sq;
    other.ln2ln_direction = L_sq, other.pl2pl_direction = L_sq;
    expect_same(poses(p, same, guess), poses(p, stated, guess), true);
    expect_same(poses(p, same, guess), poses(p, other, guess), false);
}

TEST(PairWeights, FlippingADirectionCountsForOrientedOnesOnly)
{
    SeededRandom random(5);
    const Matrix3d R = any_rotation(random);
    const Pairings p = random_pairings(ALL, R, {1, 2, 3}, random, 0.1);
    const CPose3D guess = make_pose(R, {1, 2, 3});
    Pairings line_flipped = p, plane_flipped = p;
    auto& u = line_flipped.paired_ln2ln[1].ln_local.director;
    u = mrpt::math::TVector3D(-u.x, -u.y, -u.z);
    for (double& c : plane_flipped.paired_pl2pl[2].p_global.plane.coefs) c = -c;
    for (const auto sign : {DirectionSign::Free, DirectionSign::Oriented})
    {
        SCOPED_TRACE(sign == DirectionSign::Free ? "free" : "oriented");
        PairWeights lines, planes;
        lines.ln2ln_sign = sign, planes.pl2pl_sign = sign;
        expect_same(poses(p, lines, guess), poses(line_flipped, lines, guess), sign == DirectionSign::Free);
        expect_same(poses(p, planes, guess), poses(plane_flipped, planes, guess),
                    sign == DirectionSign::Free);
    }
}

TEST(PairWeights, ADirectionWeightOfZeroLeavesDirectionsOut)
{
    SeededRandom random(6);
    const Matrix3d R = any_rotation(random);
    const Pairings p = random_pairings(ALL, R, {1, 2, 3}, random, 0.1);
    const CPose3D guess = make_pose(R, {1, 2, 3});
    Pairings other_directions = p;
    for (auto& x : other_directions.paired_ln2ln) x.ln_local.director = to_mrpt(random_direction(random));
    PairWeights none;
    none.ln2ln_direction = 0;
    expect_same(poses(p, none, guess), poses(other_directions, none, guess), true);
    expect_same(poses(p, {}, guess), poses(other_directions, {}, guess), false);
}
