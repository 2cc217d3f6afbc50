// What write_certificate() says, checked by icp-certify.
#include <gtest/gtest.h>
#include <mp2p_icp/write_certificate.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "../solvers/exact_mixes.h"
#include "certificate_file.h"
#include "check_certificate.h"
#include "icp_certify.h"
#include "icp_solve.h"
#include "pairings_file.h"
#include "test_data.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;
using mp2p_icp_certify::Certificate;
using mp2p_icp_certify::Findings;

namespace
{
void write(const std::string& path, const std::string& text)
{
    std::ofstream(path, std::ios::binary) << text;
}

/// As another program reads it.
Certificate certificate_of(const Pairings& pairings, const CertifiedParameters& parameters = {})
{
    std::ostringstream text;
    write_certificate(text, pairings, parameters);
    const std::string path = temp_path(".yaml");
    write(path, text.str());
    return mp2p_icp_certify::read_certificate(path);
}

std::string failures(const Findings& f)
{
    std::string all;
    for (const auto& sentence : f.failures) all += sentence + "\n";
    return all;
}
bool holds(const Certificate& c)
{
    return check_certificate(c).holds();
}

Pairings ten_of_all(SeededRandom& random, double noise = 0.1)
{
    return random_pairings({2, 2, 2, 2, 2}, any_rotation(random), random_point(random, 20), random, noise);
}
}  // namespace

TEST(Certificates, of_all_mixes_hold)
{
    SeededRandom random(1);
    for (const auto& mix : exact_mixes())
        for (const auto* size : {&mix.minimal.front(), &mix.one_more.front(), &mix.ten})
            for (const double noise : {0.0, 0.15, 1.5})
            {
                SCOPED_TRACE(std::string(mix.name) + ", noise " + std::to_string(noise));
                CertifiedParameters p;
                p.weights.pair_weights.pl2pl_sign = mix.normals;
                p.all_minima = true;
                const auto c = certificate_of(
                    random_pairings(*size, any_rotation(random), random_point(random, 20), random, noise), p);
                EXPECT_NE(c.verdict, "gap");
                const Findings f = check_certificate(c);
                EXPECT_TRUE(f.holds()) << failures(f);
            }
}

TEST(Certificates, hold_with_weights_signs_a_prior_far_offsets_and_free_motions)
{
    SeededRandom random(2);
    Pairings pairings = ten_of_all(random);
    pairings.point_weights = {{1, 0.3}, {1, 2}}, pairings.pl2pl_weights = {{1, 5}, {1, 0}};
    CertifiedParameters p;
    p.weights.pair_weights.pt2pl = 3, p.weights.pair_weights.ln2ln_direction = 0.7;
    p.weights.pair_weights.ln2ln_sign = DirectionSign::Free;
    mrpt::poses::CPose3DPDFGaussianInf prior;
    prior.mean = CPose3D(1, 2, 3, 0.4, 0.5, 0.6);
    for (int i = 0; i < 6; i++)
        for (int j = 0; j < 6; j++) prior.cov_inv(i, j) = (i == j ? 2.0 + i : 0.1);
    p.prior = prior;
    const Findings with_prior = check_certificate(certificate_of(pairings, p));
    EXPECT_TRUE(with_prior.has_prior);
    EXPECT_TRUE(with_prior.holds()) << failures(with_prior);

    const Pairings far =
        random_pairings({0, 3, 3, 3, 3}, any_rotation(random), Vector3d(1e7, -2e7, 3e6), random, 0.1);
    const Findings offset = check_certificate(certificate_of(far));
    EXPECT_TRUE(offset.holds()) << failures(offset);

    const auto one_plane =
        certificate_of(random_pairings({0, 0, 0, 0, 1}, any_rotation(random), {1, 2, 3}, random));
    EXPECT_EQ(one_plane.verdict, "unobservable");
    EXPECT_TRUE(holds(one_plane)) << failures(check_certificate(one_plane));
}

TEST(Certificates, of_a_robust_problem_are_about_its_last_weights)
{
    SeededRandom random(3);
    Pairings pairings = random_pairings({30, 0, 0, 0, 0}, any_rotation(random), {1, 2, 3}, random, 0.01);
    for (size_t i = 0; i < 10; i++) add_pair(pairings, random_point(random, 5), random_point(random, 5));
    CertifiedParameters p;
    p.weights.outlier_rejection = OutlierRejection::GncTruncated, p.weights.outlier_threshold = 0.1;
    const auto c = certificate_of(pairings, p);
    EXPECT_EQ(c.pairings.size(), 30u);
    EXPECT_TRUE(holds(c)) << failures(check_certificate(c));
}

TEST(Certificates, with_any_number_changed_do_not_hold)
{
    SeededRandom random(4);
    const Certificate right = certificate_of(ten_of_all(random));
    ASSERT_TRUE(holds(right)) << failures(check_certificate(right));
    const auto expect_refused = [&](const std::string& what, const auto& change)
    {
        for (const double sign : {1., -1.})
        {
            Certificate wrong = right;
            change(wrong, 1e-3L * sign);
            EXPECT_FALSE(holds(wrong)) << what;
        }
    };
    expect_refused("cost", [](auto& c, auto e) { c.cost += e * c.cost; });
    expect_refused("scale", [](auto& c, auto e) { c.scale += e * c.scale; });
    expect_refused("gap", [](auto& c, auto e) { c.gap += e * c.cost; });
    expect_refused("margin", [](auto& c, auto e) { c.margin += e * c.margin; });
    for (int i = 0; i < 9; i++)
        expect_refused("rotation", [i](auto& c, auto e) { c.pose.R(i / 3, i % 3) += e; });
    for (int i = 0; i < 3; i++) expect_refused("translation", [i](auto& c, auto e) { c.pose.t(i) += 5 * e; });
    const auto size = right.G.cwiseAbs().maxCoeff();
    for (int i = 0; i < 9; i++)
        for (int j = 0; j <= i; j++)
        {
            expect_refused("G", [=](auto& c, auto e) { c.G(i, j) += e * size; });
            expect_refused("G and its mirror",
                           [=](auto& c, auto e) { c.G(i, j) += e * size, c.G(j, i) = c.G(i, j); });
        }
    for (size_t k = 0; k < right.pairings.size(); k++)
    {
        expect_refused("a weight", [k](auto& c, auto e) { c.pairings[k].weight *= double(1 + e); });
        expect_refused("a pairing", [k](auto& c, auto e) { c.pairings[k].local.x() += double(5 * e); });
    }
    Certificate other = right;
    other.pairings = certificate_of(ten_of_all(random)).pairings;
    EXPECT_FALSE(holds(other));
}

TEST(Certificates, do_not_make_a_local_minimum_global)
{
    SeededRandom random(5);
    size_t rivals = 0;
    for (int round = 0; round < 20; round++)
    {
        CertifiedParameters p;
        p.all_minima = true;
        Certificate c =
            certificate_of(random_pairings({0, 2, 3, 0, 0}, any_rotation(random), {1, 2, 3}, random, 0.5), p);
        for (const auto& m : c.minima)
        {
            if (m.cost < c.cost + 1e-6L * c.scale) continue;
            Certificate wrong = c;
            wrong.pose = m.pose, wrong.scale += wrong.cost - m.cost, wrong.cost = m.cost;
            wrong.minima = {m};
            rivals++;
            EXPECT_FALSE(holds(wrong));
        }
    }
    EXPECT_GT(rivals, 10u);
}

TEST(Certificates, of_a_set_that_cannot_be_proven_are_bounds)
{
    const std::string file = shared_data("solver/choilam_pairs.txt");
    MP2P_ICP_SKIP_WITHOUT(file);
    std::ifstream in(file);
    Pairings pairings;
    for (std::string line; std::getline(in, line);)
    {
        std::istringstream numbers(line);
        std::vector<double> v;
        for (double x; numbers >> x;) v.push_back(x);
        if (v.size() < 10) continue;
        // The local point, a point of the plane, its normal, the weight.
        pairings.paired_pt2pl.push_back({patch({v[3], v[4], v[5]}, {v[6], v[7], v[8]}), {v[0], v[1], v[2]}});
        pairings.pt2pl_weights.emplace_back(1, v[9]);
    }
    ASSERT_EQ(pairings.size(), 68u);
    const Certificate c = certificate_of(pairings);
    EXPECT_EQ(c.verdict, "gap");
    EXPECT_TRUE(holds(c)) << failures(check_certificate(c));
}

// ---- icp-solve --------------------------------------------------------------------------------------------

TEST(icp_solve, solves_a_file_of_pairings_and_its_certificate_holds)
{
    const std::string pairings = temp_path(".csv"), certificate = temp_path(".yaml");
    // A quarter turn about z and (1, 2, 3).
    write(pairings,
          "# a comment\npt2pt,1, 1,2,3, 0,0,0\npt2pt,2, 1,3,3, 1,0,0\npt2pl,1, 0,2,3, 1,0,0, 0,1,0\n"
          "pl2pl,1,0.5,oriented, 1,2,3, 0,0,2, 0,0,0, 0,0,1\n");
    std::ostringstream out, err;
    EXPECT_EQ(mp2p_icp_apps::icp_solve({pairings, "--certificate", certificate}, out, err), 0) << err.str();
    EXPECT_NE(out.str().find("x=1.0000 y=2.0000 z=3.0000 m, yaw=90.0000 pitch=0.0000 roll=0.0000"),
              std::string::npos)
        << out.str();
    EXPECT_NE(out.str().find("verdict: global: "), std::string::npos) << out.str();
    std::ostringstream checked;
    EXPECT_EQ(mp2p_icp_certify::icp_certify({certificate}, checked, err), 0) << checked.str() << err.str();
    // The pairings of a certificate can be solved again.
    std::ostringstream again;
    EXPECT_EQ(mp2p_icp_apps::icp_solve({certificate}, again, err), 0) << err.str();
    EXPECT_EQ(again.str(), out.str());
}

TEST(icp_solve, says_what_is_not_determined)
{
    const std::string pairings = temp_path(".csv");
    write(pairings, "pt2pt,1, 1,2,3, 0,0,0\npt2pt,2, 1,3,3, 1,0,0\n");
    for (const std::string solver : {"certified", "horn", "olae", "gauss-newton"})
    {
        std::ostringstream out, err;
        EXPECT_EQ(mp2p_icp_apps::icp_solve({pairings, "--solver", solver}, out, err), 2) << err.str();
        EXPECT_NE(out.str().find("pairings determine 5 of 6"), std::string::npos) << out.str();
        EXPECT_NE(out.str().find("free motion:  rotation pitch along ["), std::string::npos)
            << solver << out.str();
    }
}

TEST(icp_solve, wrong_input_is_one_line)
{
    const std::string pairings = temp_path(".csv");
    const auto error_of = [&](const std::string& text, std::vector<std::string> options = {})
    {
        write(pairings, text);
        std::ostringstream out, err;
        options.insert(options.begin(), pairings);
        EXPECT_EQ(mp2p_icp_apps::icp_solve(options, out, err), 1) << out.str();
        const std::string message = err.str();
        EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 1) << message;
        return message;
    };
    EXPECT_NE(error_of("pt2xx,1,2\n").find("line 1"), std::string::npos);
    EXPECT_NE(error_of("# nothing\n").find(pairings + ": no pairing"), std::string::npos);
    EXPECT_NE(
        error_of("ln2ln,1,1,free, 0,0,0, 1,0,0, 0,0,0, 1,0,0\nln2ln,1,2,free, 0,0,0, 1,0,0, 0,0,0, 1,0,0\n")
            .find("ratio"),
        std::string::npos);
    EXPECT_NE(error_of("pt2pt,1, 1,2,3, 0,0,0\n", {"--solver", "magic"}).find("magic"), std::string::npos);
    EXPECT_NE(error_of("pt2pt,1, 1,2,3, 0,0,0\n", {"--solver", "horn", "--all-minima"}).find("--all-minima"),
              std::string::npos);
}

TEST(icp_solve, a_file_of_pairings_keeps_weights_and_signs)
{
    const std::string path = temp_path(".csv");
    write(path,
          "ln2ln,2,6,free, 0,0,0, 1,0,0, 0,0,0, 0,2,0\nln2ln,1,3,free, 0,0,1, 0,1,0, 0,0,1, 1,0,0\n"
          "pl2pl,0,4,free, 0,0,1, 0,1,0, 0,0,1, 1,0,0\n");
    const auto file = mp2p_icp_apps::load_pairings(path);
    SeededRandom random(1);
    const auto sums = pose_quadratic(file.pairings, file.weights);
    for (int k = 0; k < 10; k++)
    {
        const Matrix3d R = any_rotation(random);
        const Vector3d t = random_point(random, 2);
        const auto across = [](const Vector3d& v, const Vector3d& u)
        { return (v - u * u.dot(v)).squaredNorm(); };
        const Vector3d x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
        const double cost = 2 * across(t, x) + 6 * across(R * y, x) + across(R * z + t - z, y) +
                            3 * across(R * x, y) + 4 * across(R * x, y);
        EXPECT_NEAR(sums.cost(make_pose(R, t)), cost, 1e-12 * cost);
    }
}
