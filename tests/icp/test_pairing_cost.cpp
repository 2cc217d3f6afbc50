#include <gtest/gtest.h>

#include "../../mp2p_icp/icp/src/pairing_cost.h"
#include "icp_test_tools.h"

/// \file test_pairing_cost.cpp What a log says of the fit of an iteration's pairings, by school geometry.
using namespace mp2p_icp;
using namespace mp2p_icp_test;
using mrpt::math::TPoint3D;

namespace
{
// The pose moves by 1 m along z, so that distances can be told without a formula.
const CPose3D UP(0, 0, 1, 0, 0, 0);
const plane_patch_t FLOOR(mrpt::math::TPlane(0, 0, 2, 0), TPoint3D(5, 5, 0));  // the normal's length is 2

mrpt::math::TLine3D line(const TPoint3D& base, const TPoint3D& direction)
{
    mrpt::math::TLine3D out;
    out.pBase = base, out.director = direction.unitarize();
    return out;
}

Pairings of_all_kinds()
{
    Pairings p;
    p.paired_pt2pt.push_back(mrpt::tfest::TMatchingPair_d(0, 0, {0, 0, 0}, {3, 4, -1}));  // 5 m
    p.paired_pt2ln.push_back({line({9, 0, 0}, {1, 0, 0}), {2, 0, 1}});                    // 2 m
    p.paired_pt2pl.push_back({FLOOR, {1, 2, 2}});                                         // 3 m
    p.paired_ln2ln.push_back({line({0, 7, 0}, {0, 1, 0}), line({4, 0, -1}, {0, 1, 0})});  // 4 m, parallel
    p.paired_pl2pl.push_back({FLOOR, {mrpt::math::TPlane(0, 0, 1, -5), {0, 0, 5}}});      // 6 m, parallel
    return p;
}
}  // namespace

TEST(pairing_cost, adds_the_squared_distances_of_all_kinds)
{
    Pairings p = of_all_kinds();
    const auto plain = pairing_cost(p, UP);
    EXPECT_NEAR(plain.weighted, 25 + 4 + 9 + 16 + 36, 1e-12);
    EXPECT_NEAR(plain.residual_rms, std::sqrt((25 + 4 + 9 + 16 + 36) / 5.0), 1e-12);
    p.point_weights = {{1, 2.0}}, p.pt2ln_weights = {{1, 3.0}}, p.pt2pl_weights = {{1, 0.5}};
    p.ln2ln_weights = {{1, 0.0}}, p.pl2pl_weights = {{1, 0.25}};
    const auto weighted = pairing_cost(p, UP);
    EXPECT_NEAR(weighted.weighted, 2 * 25 + 3 * 4 + 0.5 * 9 + 0.25 * 36, 1e-12);
    EXPECT_EQ(weighted.residual_rms, plain.residual_rms);
}

TEST(pairing_cost, counts_directions_of_lines_and_planes)
{
    Pairings p;
    p.paired_ln2ln.push_back({line({0, 0, 0}, {0, 1, 0}), line({0, 0, -1}, {1, 0, 0})});  // square to it
    EXPECT_NEAR(pairing_cost(p, UP).weighted, 1, 1e-12);
    p.paired_pl2pl.push_back({FLOOR, {mrpt::math::TPlane(1, 0, 0, 0), {0, 0, -1}}});  // |z - x|^2 = 2
    EXPECT_NEAR(pairing_cost(p, UP).weighted, 1 + 2, 1e-12);
    EXPECT_NEAR(pairing_cost(p, UP).residual_rms, 0, 1e-12);
}

TEST(pairing_cost, leaves_out_what_is_not_finite)
{
    Pairings p = of_all_kinds();
    p.paired_pt2pt.push_back(mrpt::tfest::TMatchingPair_d(0, 0, {NAN, 0, 0}, {0, 0, 0}));
    p.paired_pt2pl.push_back({plane_patch_t(mrpt::math::TPlane(0, 0, 0, 0), {0, 0, 0}), {1, 1, 1}});
    EXPECT_EQ(pairing_cost(p, UP).residual_rms, pairing_cost(of_all_kinds(), UP).residual_rms);
    EXPECT_EQ(pairing_cost(p, UP).weighted, pairing_cost(of_all_kinds(), UP).weighted);
}
