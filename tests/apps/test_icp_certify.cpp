// Certificates are made here by other means than those that check them: forms from Kronecker products in
// double, coefficients from the closed form of least Frobenius norm.

#include <gtest/gtest.h>
#include <mp2p_icp/yaml_tools.h>
#include <sys/wait.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iomanip>
#include <map>
#include <random>
#include <regex>
#include <set>
#include <sstream>

#include "cost_form.h"
#include "findings_text.h"
#include "icp_certify.h"
#include "quartic.h"
#include "test_data.h"
#include "test_repetitions.h"

namespace certify = mp2p_icp_certify;
using certify::Pairing;
using certify::PairingKind;
using certify::Real;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector4d;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Matrix9d = Eigen::Matrix<double, 9, 9>;
using Matrix10d = Eigen::Matrix<double, 10, 10>;
using Matrix13d = Eigen::Matrix<double, 13, 13>;

// ---- Random things ----------------------------------------------------------------------------------------
namespace
{
class Random
{
 public:
    explicit Random(uint32_t seed) : engine_(seed) {}
    double uniform(double low, double high) { return std::uniform_real_distribution<>(low, high)(engine_); }
    double normal() { return std::normal_distribution<>()(engine_); }
    Vector3d vector(double sigma = 1)
    {
        const double x = normal(), y = normal(), z = normal();
        return sigma * Vector3d(x, y, z);
    }
    Vector4d quaternion()
    {
        const double w = normal();
        const Vector3d v = vector();
        return Vector4d(w, v.x(), v.y(), v.z()).normalized();
    }
    size_t index(size_t count) { return std::uniform_int_distribution<size_t>(0, count - 1)(engine_); }

 private:
    std::mt19937 engine_;
};

Matrix3d cross_matrix(const Vector3d& v)
{
    Matrix3d m;
    m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
    return m;
}

/// |q|^2 times the rotation of q = (w, x, y, z).
Matrix3d rotation(const Vector4d& q)
{
    const Vector3d v = q.tail<3>();
    return (q[0] * q[0] - v.dot(v)) * Matrix3d::Identity() + 2 * v * v.transpose() +
           2 * q[0] * cross_matrix(v);
}

struct TestPose
{
    Matrix3d R = Matrix3d::Identity();
    Vector3d t = Vector3d::Zero();
    certify::Pose wide() const { return {R.cast<Real>(), t.cast<Real>()}; }
};

TestPose random_pose(Random& random)
{
    return {rotation(random.quaternion()), random.vector(2)};
}

/// What is generated: how many of which kind, how noisy.
struct Mix
{
    std::array<size_t, certify::NUMBER_OF_KINDS> counts{};
    double noise = 0.02;
    int oriented = 2;  ///< 0: free, 1: oriented, 2: by turns
};
const Mix POINTS_AND_ORIENTED_PLANES = {{20, 0, 0, 0, 12}, 0.02, 1};
const Mix ALL_KINDS = {{30, 30, 30, 30, 30}, 0.02, 2};

/// Pairings that fit to a pose up to noise. The scene is some metres large.
std::vector<Pairing> random_pairings(Random& random, const TestPose& truth, const Mix& mix)
{
    std::vector<Pairing> pairings;
    for (size_t kind = 0; kind < mix.counts.size(); kind++)
        for (size_t i = 0; i < mix.counts[kind]; i++)
        {
            Pairing p;
            p.kind = static_cast<PairingKind>(kind);
            p.weight = random.uniform(0.2, 3);
            p.local = random.vector();
            p.global = truth.R * p.local + truth.t + random.vector(mix.noise);
            if (kind >= 1) p.global_dir = random.vector();
            if (kind == 1) p.global += random.uniform(-1, 1) * p.global_dir;
            if (kind == 2) p.global += 0.5 * p.global_dir.cross(random.vector());
            if (kind >= 3)
            {
                p.direction_weight = random.uniform(0.2, 3);
                p.oriented = mix.oriented == 2 ? i % 2 == 0 : mix.oriented == 1;
                p.local_dir = random.uniform(0.5, 2) *
                              (truth.R.transpose() * p.global_dir.normalized() + random.vector(mix.noise));
                if (!p.oriented && i % 4 == 1) p.local_dir = -p.local_dir;
            }
            pairings.push_back(p);
        }
    return pairings;
}

// ---- The cost, from its definition
// -------------------------------------------------------------------------
struct TestPrior
{
    TestPose mean;
    Matrix6d information = Matrix6d::Zero();
};

double sum_of_residuals(const std::vector<Pairing>& pairings, const TestPose& pose)
{
    double sum = 0;
    for (const auto& p : pairings)
    {
        const Vector3d d = p.global_dir.normalized(), r = pose.R * p.local + pose.t - p.global;
        if (p.kind == PairingKind::pt2pt)
            sum += p.weight * r.squaredNorm();
        else if (p.kind == PairingKind::pt2ln || p.kind == PairingKind::ln2ln)
            sum += p.weight * (r - d * d.dot(r)).squaredNorm();
        else
            sum += p.weight * std::pow(d.dot(r), 2);
        if (p.kind != PairingKind::ln2ln && p.kind != PairingKind::pl2pl) continue;
        const Vector3d Rl = pose.R * p.local_dir.normalized();
        sum += p.direction_weight * (p.oriented ? (d - Rl).squaredNorm() : 1 - std::pow(d.dot(Rl), 2));
    }
    return sum;
}

double cost_of_prior(const TestPrior& prior, const TestPose& pose)
{
    const Eigen::AngleAxisd D(Eigen::Quaterniond(Matrix3d(pose.R * prior.mean.R.transpose())));
    const Vector3d s = D.axis() * std::sin(D.angle()), v = D.axis() * std::sin(D.angle() / 2);
    const Matrix3d Ltt = prior.information.topLeftCorner<3, 3>(),
                   Ltw = prior.information.topRightCorner<3, 3>();
    const Matrix3d A = Ltt.completeOrthogonalDecomposition().pseudoInverse() * Ltw;
    const Matrix3d S = prior.information.bottomRightCorner<3, 3>() - Ltw.transpose() * A;
    const Vector3d e = pose.t - prior.mean.t + A * s;
    return e.dot(Ltt * e) + 4 * v.dot(S * v);
}

// ---- A certificate, made by other means
// ----------------------------------------------------------------------
struct TestCertificate
{
    std::string verdict = "global";
    double tolerance = 1e-9, cost = 0, scale = 0, gap = 0, margin = 0;
    TestPose pose;
    Matrix9d G = Matrix9d::Zero();
    struct Minimum
    {
        TestPose pose;
        double cost = 0;
    };
    std::vector<Minimum> minima;
    std::optional<TestPrior> prior;
    std::vector<Pairing> pairings;
};

const std::array<std::pair<int, int>, 10> MONOMIALS = {
    {{0, 0}, {0, 1}, {0, 2}, {0, 3}, {1, 1}, {2, 2}, {3, 3}, {1, 2}, {1, 3}, {2, 3}}};

double norm_of_monomial(size_t i)
{
    return MONOMIALS[i].first == MONOMIALS[i].second ? 1 : std::sqrt(2.0);
}

/// Which of the 35 monomials of degree 4 the product of two of degree 2 is.
std::array<int, 4> class_of(size_t i, size_t j)
{
    std::array<int, 4> e{};
    for (const int v : {MONOMIALS[i].first, MONOMIALS[i].second, MONOMIALS[j].first, MONOMIALS[j].second})
        e[static_cast<size_t>(v)]++;
    return e;
}

class Maker
{
 public:
    explicit Maker(const std::vector<Pairing>& pairings) : pairings_(pairings)
    {
        double sum = 0;
        for (const auto& p : pairings) sum += p.weight, cg_ += p.weight * p.global, cl_ += p.weight * p.local;
        if (sum > 0) cg_ /= sum, cl_ /= sum;
        for (const auto& p : pairings) add(p);
        const Matrix3d tt = H_.block<3, 3>(9, 9);
        P_ = tt.completeOrthogonalDecomposition().pseudoInverse();
        Eigen::Matrix<double, 10, 3> xt;
        xt << H_.block<9, 3>(0, 9), H_.block<1, 3>(12, 9);
        xx_ << H_.topLeftCorner<9, 9>(), H_.block<9, 1>(0, 12), H_.block<1, 9>(12, 0), H_(12, 12);
        Q_ = xx_ - xt * P_ * xt.transpose();
        xt_ = xt;
    }

    double cost(const Matrix3d& R) const { return x(R, 1).dot(Q_ * x(R, 1)); }
    double mean() const { return Q_.topLeftCorner<9, 9>().trace() / 3 + Q_(9, 9); }
    Vector3d translation(const Matrix3d& R) const
    {
        const Vector3d t = -P_ * xt_.transpose() * x(R, 1);
        using Wide = Eigen::Matrix<long double, 3, 1>;
        const Wide shift = cg_.cast<long double>() - R.cast<long double>() * cl_.cast<long double>();
        return (t.cast<long double>() + shift).cast<double>();
    }

    /// Coefficients of f(R0 R(q)) by monomials of q.
    std::map<std::array<int, 4>, double> coefficients(const Matrix3d& R0) const
    {
        const auto x_of = [&](const Vector4d& q) { return x(R0 * rotation(q), q.squaredNorm()); };
        Eigen::Matrix<double, 10, 10> A;  // columns: what a monomial adds to x
        for (int i = 0; i < 10; i++)
        {
            const auto [a, b] = MONOMIALS[static_cast<size_t>(i)];
            const Vector4d ea = Vector4d::Unit(a), eb = Vector4d::Unit(b);
            A.col(i) = a == b ? x_of(ea) : x_of(ea + eb) - x_of(ea) - x_of(eb);
        }
        const Matrix10d G = A.transpose() * Q_ * A;
        std::map<std::array<int, 4>, double> c;
        for (size_t i = 0; i < 10; i++)
            for (size_t j = 0; j < 10; j++) c[class_of(i, j)] += G(static_cast<int>(i), static_cast<int>(j));
        return c;
    }

    Vector3d gradient(const Matrix3d& R0) const
    {
        const auto c = coefficients(R0);
        return 0.5 * Vector3d(c.at({3, 1, 0, 0}), c.at({3, 0, 1, 0}), c.at({3, 0, 0, 1}));
    }

    /// The local minimum that Newton's way leads to.
    Matrix3d minimum_from(Matrix3d R) const
    {
        for (int i = 0; i < 100; i++)
        {
            const auto c = coefficients(R);
            const double c0 = c.at({4, 0, 0, 0});
            Matrix3d H;
            H << 2 * c.at({2, 2, 0, 0}), c.at({2, 1, 1, 0}), c.at({2, 1, 0, 1}),  //
                c.at({2, 1, 1, 0}), 2 * c.at({2, 0, 2, 0}), c.at({2, 0, 1, 1}),   //
                c.at({2, 1, 0, 1}), c.at({2, 0, 1, 1}), 2 * c.at({2, 0, 0, 2});
            H -= 4 * c0 * Matrix3d::Identity();
            const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(H);
            const Vector3d g = 2 * gradient(R);
            const double most = eigen.eigenvalues().cwiseAbs().maxCoeff();
            Vector3d v = Vector3d::Zero();
            for (int k = 0; k < 3; k++)
                v -= eigen.eigenvectors().col(k) * eigen.eigenvectors().col(k).dot(g) /
                     std::max(std::abs(eigen.eigenvalues()[k]), 1e-9 * most);
            if (v.norm() > 0.3) v *= 0.3 / v.norm();
            const auto moved = [&](const Vector3d& step)
            {
                const Eigen::Quaterniond q(std::sqrt(1 - step.squaredNorm()), step.x(), step.y(), step.z());
                return Eigen::Quaterniond(R * q.toRotationMatrix()).normalized().toRotationMatrix();
            };
            Matrix3d next = moved(v);
            for (int k = 0; k < 30 && cost(next) > cost(R) + 1e-14 * mean(); k++) v /= 2, next = moved(v);
            R = next;
            if (v.norm() < 1e-15) break;
        }
        return R;
    }

    /// With the G of least Frobenius norm, which need not be positive.
    TestCertificate certificate_at(const Matrix3d& R) const
    {
        TestCertificate c;
        c.pairings = pairings_;
        c.pose = {R, translation(R)};
        c.cost = cost(R);
        c.scale = mean() - c.cost;
        auto classes = coefficients(R);
        // - cost |q|^4
        for (size_t i = 0; i < 4; i++)
            for (size_t j = 0; j < 4; j++)
            {
                std::array<int, 4> e{};
                e[i] += 2, e[j] += 2;
                classes[e] -= c.cost;
            }
        std::map<std::array<int, 4>, double> norms;
        const auto D = [](int i) { return norm_of_monomial(static_cast<size_t>(i + 1)); };
        const auto k = [](int i, int j)
        { return class_of(static_cast<size_t>(i + 1), static_cast<size_t>(j + 1)); };
        for (int i = 0; i < 9; i++)
            for (int j = 0; j < 9; j++) norms[k(i, j)] += std::pow(D(i) * D(j), 2);
        for (int i = 0; i < 9; i++)
            for (int j = 0; j < 9; j++) c.G(i, j) = classes[k(i, j)] * D(i) * D(j) / norms[k(i, j)] / c.scale;
        c.margin = least_eigenvalue(c.G);
        c.gap = std::min(std::max(0.0, c.cost),
                         c.scale * std::max(0.0, -c.margin) + 3 * std::sqrt(3.0) / 8 * gradient(R).norm());
        return c;
    }

    static double least_eigenvalue(const Matrix9d& G)
    {
        return Eigen::SelfAdjointEigenSolver<Matrix9d>(G).eigenvalues()[0];
    }

 private:
    static Eigen::Matrix<double, 10, 1> x(const Matrix3d& R, double one)
    {
        Eigen::Matrix<double, 10, 1> v;
        v << R.col(0), R.col(1), R.col(2), one;
        return v;
    }

    void add(const Pairing& p)
    {
        const Vector3d d = p.global_dir.normalized();
        const Matrix3d along = d * d.transpose(), across = Matrix3d::Identity() - along;
        Matrix3d C = Matrix3d::Identity();
        if (p.kind == PairingKind::pt2ln || p.kind == PairingKind::ln2ln) C = across;
        if (p.kind == PairingKind::pt2pl || p.kind == PairingKind::pl2pl) C = along;
        Vector4d z;
        z << p.local - cl_, 1;
        add(p.weight * C, z, p.global - cg_);
        if (p.kind != PairingKind::ln2ln && p.kind != PairingKind::pl2pl) return;
        z << p.local_dir.normalized(), 0;
        if (p.oriented)
            add(p.direction_weight * Matrix3d::Identity(), z, d);
        else
            add(p.direction_weight * across, z, Vector3d::Zero());
    }
    /// (M z - g)' C (M z - g), M = [R t]
    void add(const Matrix3d& C, const Vector4d& z, const Vector3d& g)
    {
        for (int a = 0; a < 4; a++)
        {
            for (int b = 0; b < 4; b++) H_.block<3, 3>(3 * a, 3 * b) += z[a] * z[b] * C;
            H_.block<3, 1>(3 * a, 12) -= z[a] * C * g;
            H_.block<1, 3>(12, 3 * a) -= z[a] * (C * g).transpose();
        }
        H_(12, 12) += g.dot(C * g);
    }

    std::vector<Pairing> pairings_;
    Vector3d cg_{0, 0, 0}, cl_{0, 0, 0};
    Matrix13d H_ = Matrix13d::Zero();
    Matrix10d xx_, Q_;
    Eigen::Matrix<double, 10, 3> xt_;
    Matrix3d P_;
};

TestCertificate random_certificate(uint32_t seed, const Mix& mix)
{
    Random random(seed);
    const TestPose truth = random_pose(random);
    const Maker maker(random_pairings(random, truth, mix));
    return maker.certificate_at(maker.minimum_from(truth.R));
}

// ---- Files ------------------------------------------------------------------------------------------------
std::string text(double value)
{
    std::ostringstream out;
    out << std::setprecision(17) << value;
    return out.str();
}

template <class Matrix>
std::string row_by_row(const Matrix& m)
{
    std::string out;
    for (int r = 0; r < m.rows(); r++)
        for (int c = 0; c < m.cols(); c++) out += (out.empty() ? "" : ", ") + text(m(r, c));
    return "[" + out + "]";
}

std::string line_of(const Pairing& p)
{
    const auto triple = [](const Vector3d& v)
    { return ", " + text(v.x()) + "," + text(v.y()) + "," + text(v.z()); };
    const bool has_local_dir = p.kind == PairingKind::ln2ln || p.kind == PairingKind::pl2pl;
    std::string out = std::string(certify::KIND_NAMES[static_cast<size_t>(p.kind)]) + "," + text(p.weight);
    if (has_local_dir) out += "," + text(p.direction_weight) + (p.oriented ? ",oriented" : " , free");
    out += triple(p.global);
    if (p.kind != PairingKind::pt2pt) out += triple(p.global_dir);
    out += triple(p.local);
    if (has_local_dir) out += triple(p.local_dir);
    return out;
}

std::string lines_of(const std::vector<Pairing>& pairings, const std::string& indent)
{
    std::string out;
    for (const auto& p : pairings) out += indent + line_of(p) + "\n";
    return out;
}

std::string pose_text(const TestPose& pose)
{
    return "rotation: " + row_by_row(pose.R) + ", translation: " + row_by_row(pose.t);
}

std::string yaml_of(const TestCertificate& c)
{
    std::string out = "mp2p_icp_certificate: 1\nverdict: " + c.verdict + "\ntolerance: " + text(c.tolerance) +
                      "\ncost: " + text(c.cost) + "\nscale: " + text(c.scale) + "\ngap: " + text(c.gap) +
                      "\nmargin: " + text(c.margin) + "\nrotation: " + row_by_row(c.pose.R) +
                      "\ntranslation: " + row_by_row(c.pose.t) + "\nG: " + row_by_row(c.G) + "\n";
    if (!c.minima.empty()) out += "minima:\n";
    for (const auto& m : c.minima) out += "  - {" + pose_text(m.pose) + ", cost: " + text(m.cost) + "}\n";
    if (c.prior)
        out += "prior: {" + pose_text(c.prior->mean) + ", information: " + row_by_row(c.prior->information) +
               "}\n";
    return out + "pairings: |\n  # one a line\n\n" + lines_of(c.pairings, "  ");
}

class Folder
{
 public:
    Folder() : path_(mp2p_icp_test::temp_path(""))
    {
        std::filesystem::remove_all(path_);
        std::filesystem::create_directories(path_);
    }
    ~Folder()
    {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    std::string path(const std::string& name) const { return path_ + "/" + name; }
    std::string file(const std::string& name, const std::string& content) const
    {
        std::ofstream(path(name), std::ios::binary) << content;
        return path(name);
    }

 private:
    std::string path_;
};

struct Outcome
{
    int code = -1;
    std::string out, err;
};

Outcome run(const std::vector<std::string>& arguments)
{
    std::ostringstream out, err;
    const int code = certify::icp_certify(arguments, out, err);
    return {code, out.str(), err.str()};
}

Outcome run_on(const Folder& folder, const std::string& content)
{
    return run({folder.file("c.yaml", content)});
}

bool contains(const std::string& whole, const std::string& part)
{
    return whole.find(part) != std::string::npos;
}

void expect_holds(const Outcome& o)
{
    EXPECT_EQ(o.code, 0) << o.out << o.err;
    EXPECT_TRUE(contains(o.out, "The certificate holds: no pose costs less than ")) << o.out;
    EXPECT_EQ(o.err, "");
}

void expect_refused(const Outcome& o, const std::string& reason)
{
    EXPECT_EQ(o.code, 2) << o.out << o.err;
    EXPECT_TRUE(contains(o.out, "The certificate does NOT hold: ")) << o.out;
    EXPECT_TRUE(contains(o.out, reason)) << "'" << reason << "' is not in: " << o.out;
    EXPECT_EQ(o.err, "");
}

void expect_complaint(const Outcome& o, const std::vector<std::string>& words)
{
    EXPECT_EQ(o.code, 1) << o.out;
    EXPECT_EQ(o.err.rfind("icp-certify: ", 0), 0u) << o.err;
    EXPECT_EQ(std::count(o.err.begin(), o.err.end(), '\n'), 1) << o.err;
    for (const auto& word : words)
        EXPECT_TRUE(contains(o.err, word)) << "'" << word << "' is not in: " << o.err;
}

certify::Certificate read(const Folder& folder, const TestCertificate& c)
{
    return certify::read_certificate(folder.file("c.yaml", yaml_of(c)));
}
}  // namespace

// ---- Costs ------------------------------------------------------------------------------------------------
TEST(icp_certify_cost, of_each_kind_is_the_sum_of_its_residuals_at_any_pose)
{
    for (size_t kind = 0; kind < certify::NUMBER_OF_KINDS; kind++)
        for (int oriented = 0; oriented < 2; oriented++)
        {
            SCOPED_TRACE("kind " + std::to_string(kind) + ", oriented " + std::to_string(oriented));
            Random random(100 + static_cast<uint32_t>(kind));
            Mix mix;
            mix.counts[kind] = 3, mix.noise = 0.5, mix.oriented = oriented;
            const auto pairings = random_pairings(random, random_pose(random), mix);
            const auto form = certify::cost_form(pairings, {});
            for (int i = 0; i < 20; i++)
            {
                const TestPose pose = random_pose(random);
                const double expected = sum_of_residuals(pairings, pose);
                EXPECT_GT(expected, 0.1);
                EXPECT_NEAR(static_cast<double>(form.at(pose.wide())), expected, 1e-13 * expected);
            }
        }
}

TEST(icp_certify_cost, at_a_rotation_is_the_least_one_over_all_translations)
{
    for (uint32_t seed = 1; seed <= 20; seed++)
    {
        SCOPED_TRACE(seed);
        Random random(seed);
        Mix mix = ALL_KINDS;
        mix.counts = {1, 1, 1, 1, 1};
        const auto pairings = random_pairings(random, random_pose(random), mix);
        const auto form = certify::cost_form(pairings, {});
        TestPose pose = random_pose(random);
        // A parabola in t: its least value from ten places.
        const auto at = [&](const Vector3d& t) { return sum_of_residuals(pairings, {pose.R, t}); };
        Matrix3d H;
        Vector3d g;
        for (int i = 0; i < 3; i++)
        {
            const Vector3d ei = Vector3d::Unit(i);
            g[i] = (at(ei) - at(-ei)) / 2;
            for (int j = 0; j < 3; j++)
            {
                const Vector3d ej = Vector3d::Unit(j);
                H(i, j) = at(ei + ej) - at(ei) - at(ej) + at(Vector3d::Zero());
            }
        }
        const double least = at(-H.ldlt().solve(g));
        EXPECT_NEAR(static_cast<double>(form.at(Real(1) * pose.R.cast<Real>())), least,
                    1e-12 * at(Vector3d::Zero()));
        pose.t = random.vector(3);
        EXPECT_GT(form.at(pose.wide()), least);
    }
}

TEST(icp_certify_cost, does_not_depend_on_the_length_of_directions)
{
    Random random(5);
    auto pairings = random_pairings(random, random_pose(random), ALL_KINDS);
    const TestPose pose = random_pose(random);
    const Real before = certify::cost_form(pairings, {}).at(pose.wide());
    for (auto& p : pairings) p.global_dir *= 1e-200, p.local_dir *= 1e+150;
    EXPECT_NEAR(static_cast<double>(certify::cost_form(pairings, {}).at(pose.wide()) / before), 1, 1e-14);
}

TEST(icp_certify_cost, of_a_prior_is_what_its_definition_says_at_any_pose)
{
    for (uint32_t seed = 1; seed <= 20; seed++)
    {
        SCOPED_TRACE(seed);
        Random random(seed);
        const Eigen::Matrix<double, 6, 6> factor = Eigen::Matrix<double, 6, 6>::NullaryExpr(
            [&](Eigen::Index, Eigen::Index) { return random.normal(); });
        // Also ones that know nothing about some motions.
        const int rank = 1 + static_cast<int>(seed) % 6;
        const TestPrior prior = {random_pose(random),
                                 factor.leftCols(rank) * factor.leftCols(rank).transpose()};
        Mix mix;
        mix.counts[0] = seed % 2 ? 3 : 0;
        const auto pairings = random_pairings(random, random_pose(random), mix);
        const auto form =
            certify::cost_form(pairings, certify::Prior{prior.mean.wide(), prior.information.cast<Real>()});
        for (int i = 0; i < 20; i++)
        {
            const TestPose pose = random_pose(random);
            const double expected = sum_of_residuals(pairings, pose) + cost_of_prior(prior, pose);
            EXPECT_NEAR(static_cast<double>(form.at(pose.wide())), expected, 1e-10 * (1 + expected));
        }
    }
}

TEST(icp_certify_cost, of_a_prior_near_its_mean_is_the_form_of_its_information)
{
    // Tells a twist along global axes from one along the pose's own, and the signs of the coupling.
    Random random(9);
    const Matrix6d factor =
        Matrix6d::NullaryExpr([&](Eigen::Index, Eigen::Index) { return random.normal(); });
    const TestPrior prior = {random_pose(random), factor * factor.transpose()};
    const auto form =
        certify::cost_form({}, certify::Prior{prior.mean.wide(), prior.information.cast<Real>()});
    for (int i = 0; i < 20; i++)
    {
        constexpr double STEP = 1e-4;
        Eigen::Matrix<double, 6, 1> twist;
        twist << random.vector(STEP), random.vector(STEP);
        const Vector3d omega = twist.tail<3>();
        const TestPose pose = {Eigen::AngleAxisd(omega.norm(), omega.normalized()) * prior.mean.R,
                               prior.mean.t + twist.head<3>()};
        const double expected = twist.dot(prior.information * twist);
        // The next terms are smaller by the square of the step.
        EXPECT_NEAR(static_cast<double>(form.at(pose.wide())) / expected, 1, 1e-6);
    }
}

TEST(icp_certify_cost, has_the_coefficients_of_its_quartic)
{
    Random random(11);
    const auto pairings = random_pairings(random, random_pose(random), ALL_KINDS);
    const auto form = certify::cost_form(pairings, {});
    const Matrix3d R0 = rotation(random.quaternion());
    const auto polynomial = certify::cost_around(form, R0.cast<Real>());
    EXPECT_EQ(polynomial.size(), 35u);
    for (int i = 0; i < 20; i++)
    {
        const Vector4d q = random.quaternion();
        Real sum = 0;
        for (const auto& [e, c] : polynomial)
            sum += c * std::pow(Real(q[0]), e[0]) * std::pow(Real(q[1]), e[1]) * std::pow(Real(q[2]), e[2]) *
                   std::pow(Real(q[3]), e[3]);
        const Matrix3d R = R0 * rotation(q);
        EXPECT_NEAR(static_cast<double>(sum / form.at(R.cast<Real>())), 1, 1e-13);
    }
}

// ---- Right certificates
// -------------------------------------------------------------------------------------
TEST(icp_certify, the_certificates_of_these_tests_are_what_they_should_be)
{
    // f(R0 R(q)) = cost + scale z' G z + 2 w^3 gradient . v, f being the sum of residuals at the best
    // translation
    const TestCertificate c = random_certificate(1, ALL_KINDS);
    const Maker maker(c.pairings);
    EXPECT_GT(c.margin, 0.01);
    Random random(2);
    for (int i = 0; i < 50; i++)
    {
        const Vector4d q = random.quaternion();
        Eigen::Matrix<double, 9, 1> z;
        for (size_t k = 1; k < 10; k++)
            z[static_cast<int>(k) - 1] = norm_of_monomial(k) * q[MONOMIALS[k].first] * q[MONOMIALS[k].second];
        const Matrix3d R = c.pose.R * rotation(q);
        const double f = sum_of_residuals(c.pairings, {R, maker.translation(R)});
        const double g = 2 * std::pow(q[0], 3) * maker.gradient(c.pose.R).dot(q.tail<3>());
        EXPECT_NEAR(c.cost + c.scale * z.dot(c.G * z) + g, f, 1e-12 * f);
    }
}

TEST(icp_certify, a_right_certificate_holds)
{
    const Folder folder;
    double largest = 0;
    for (const auto& mix : {POINTS_AND_ORIENTED_PLANES, ALL_KINDS, Mix{{100, 0, 0, 0, 0}, 0.1, 1},
                            Mix{{0, 100, 0, 0, 0}, 0.02, 1}, Mix{{0, 0, 200, 0, 0}, 0.02, 1},
                            Mix{{0, 0, 0, 100, 0}, 0.02, 0}, Mix{{0, 0, 0, 0, 100}, 0.02, 2}})
        for (uint32_t seed = 1; seed <= mp2p_icp_test::repetitions(4, 200); seed++)
        {
            SCOPED_TRACE(seed);
            const TestCertificate c = random_certificate(seed, mix);
            ASSERT_GT(c.margin, 1e-3);
            expect_holds(run_on(folder, yaml_of(c)));
            const auto f = certify::check_certificate(read(folder, c));
            EXPECT_NEAR(static_cast<double>(f.cost.found), c.cost, 1e-14 * c.scale);
            EXPECT_LE(f.gap.found, 1e-12 * f.scale.found);
            largest = std::max(largest, static_cast<double>(f.largest_mismatch / f.rounding));
            largest =
                std::max(largest, static_cast<double>(std::abs(f.cost.found - f.cost.in_file) / f.rounding));
            largest = std::max(largest,
                               static_cast<double>(std::abs(f.scale.found - f.scale.in_file) / f.rounding));
        }
    RecordProperty("largest_part_of_the_rounding_that_is_allowed", text(largest));
    EXPECT_LT(largest, 0.5);
}

TEST(icp_certify, holds_at_far_places)
{
    const Folder folder;
    for (const double offset : {1e2, 1e5, 1e8})
    {
        SCOPED_TRACE(offset);
        Random random(7);
        const TestPose truth = random_pose(random);
        auto pairings = random_pairings(random, truth, ALL_KINDS);
        for (auto& p : pairings)
            p.global += offset * Vector3d(1, -0.7, 0.1), p.local += offset * Vector3d(0.3, 0.9, -0.8);
        const Maker maker(pairings);
        TestCertificate c = maker.certificate_at(maker.minimum_from(truth.R));
        expect_holds(run_on(folder, yaml_of(c)));
        c.pose.t.x() += 1e-3;
        expect_refused(run_on(folder, yaml_of(c)), "translation");
        c.pose.t.x() -= 1e-3, c.pairings[3].global.y() += 1e-3;
        expect_refused(run_on(folder, yaml_of(c)), "cost");
    }
}

TEST(icp_certify, holds_at_any_scale)
{
    const Folder folder;
    for (const double length : {1e-6, 1e-3, 1e3, 1e6})
        for (const double weight : {1e-9, 1.0, 1e9})
        {
            SCOPED_TRACE(std::to_string(length) + " m, weight " + std::to_string(weight));
            Random random(8);
            const TestPose truth = random_pose(random);
            auto pairings = random_pairings(random, truth, ALL_KINDS);
            for (auto& p : pairings)
            {
                p.global *= length, p.local *= length, p.weight *= weight;
                p.direction_weight *= weight * length * length;
            }
            const Maker maker(pairings);
            TestCertificate c = maker.certificate_at(maker.minimum_from(truth.R));
            expect_holds(run_on(folder, yaml_of(c)));
            c.pairings[3].local.y() += 1e-3 * length;
            expect_refused(run_on(folder, yaml_of(c)), "cost");
        }
}

TEST(icp_certify, holds_with_a_prior_and_not_without_it)
{
    const Folder folder;
    const TestCertificate c = random_certificate(3, POINTS_AND_ORIENTED_PLANES);
    TestCertificate with_prior = c;
    // Its mean is the minimum, so that the pose stays. The closed form of its quartic: 4 v' S v = 4 s v' v,
    // and with w^2 + v' v = 1 that is 4 s sum of w^2 v^2 + v^2 v^2.
    constexpr double S = 0.7;
    with_prior.prior = TestPrior{c.pose, Matrix6d::Zero()};
    with_prior.prior->information.topLeftCorner<3, 3>() = 2.5 * Matrix3d::Identity();
    with_prior.prior->information.bottomRightCorner<3, 3>() = S * Matrix3d::Identity();
    // Translations far from the mean cost more now, so points alone give the new form.
    TestCertificate expected = c;
    {
        // 2.5 |t - t0|^2 is a pairing of the local origin with t0; 4 s |v|^2 = s / 2 |D - 1|^2 / 2 = three
        // pairings of oriented directions, each |e - D e|^2 = 2 (1 - D_ii), summed 2 (3 - tr D) = 8 |v|^2.
        auto pairings = c.pairings;
        Pairing p;
        p.kind = PairingKind::pt2pt, p.weight = 2.5, p.local.setZero(), p.global = c.pose.t;
        pairings.push_back(p);
        for (int i = 0; i < 3; i++)
        {
            Pairing d;
            d.kind = PairingKind::pl2pl, d.weight = 0, d.direction_weight = S / 2, d.oriented = true;
            d.local.setZero(), d.global.setZero();
            d.local_dir = Vector3d::Unit(i), d.global_dir = c.pose.R * d.local_dir;
            pairings.push_back(d);
        }
        const Maker maker(pairings);
        expected = maker.certificate_at(c.pose.R);
    }
    with_prior.cost = expected.cost, with_prior.scale = expected.scale, with_prior.gap = expected.gap;
    with_prior.margin = expected.margin, with_prior.G = expected.G, with_prior.pose = expected.pose;
    expect_holds(run_on(folder, yaml_of(with_prior)));
    EXPECT_TRUE(contains(run_on(folder, yaml_of(with_prior)).out, "and a prior"));

    auto other = with_prior;
    other.prior.reset();
    expect_refused(run_on(folder, yaml_of(other)), "scale");
    other = with_prior, other.prior->mean.t.x() += 1e-3;
    expect_refused(run_on(folder, yaml_of(other)), "NOT hold");
    other = with_prior, other.prior->information(4, 4) *= 1.001;
    expect_refused(run_on(folder, yaml_of(other)), "NOT hold");
    other = with_prior,
    other.prior->mean.R = other.prior->mean.R * Eigen::AngleAxisd(1e-3, Vector3d::UnitX());
    expect_refused(run_on(folder, yaml_of(other)), "NOT hold");
    other = with_prior, other.prior->mean.R(0, 0) += 1e-3;
    expect_refused(run_on(folder, yaml_of(other)), "the prior's rotation");
}

TEST(icp_certify, tells_the_same_in_words_and_as_yaml)
{
    const Folder folder;
    const auto c = random_certificate(4, ALL_KINDS);
    const auto path = folder.file("c.yaml", yaml_of(c));
    const auto words = run({path}), yaml_text = run({path, "--yaml"});
    EXPECT_TRUE(contains(words.out, "150 (30 pt2pt, 30 pt2ln, 30 pt2pl, 30 ln2ln, 30 pl2pl)")) << words.out;
    EXPECT_EQ(yaml_text.code, 0);
    const auto y = mp2p_icp::yaml_from_text(yaml_text.out);
    const auto at = [&](const std::string& key) { return mp2p_icp::scalar_text(y.asMap().at(key), {}); };
    EXPECT_EQ(at("holds"), "true");
    EXPECT_EQ(at("verdict"), "global");
    EXPECT_LT(std::stod(at("gap_relative")), 1e-9);
    const auto& cost = y.asMap().at("cost").asMap();
    EXPECT_NEAR(std::stod(mp2p_icp::scalar_text(cost.at("found"), {})), c.cost, 1e-14 * c.scale);
    EXPECT_EQ(std::stod(mp2p_icp::scalar_text(cost.at("in_file"), {})), c.cost);

    auto wrong = c;
    wrong.cost *= 1.5;
    const auto refused = run({folder.file("w.yaml", yaml_of(wrong)), "--yaml"});
    EXPECT_EQ(refused.code, 2);
    const auto w = mp2p_icp::yaml_from_text(refused.out);
    EXPECT_EQ(mp2p_icp::scalar_text(w.asMap().at("holds"), {}), "false");
    EXPECT_GE(w.asMap().at("failures").asSequence().size(), 1u);
}

// ---- Wrong ones -------------------------------------------------------------------------------------------
TEST(icp_certify, every_changed_number_is_found)
{
    const Folder folder;
    auto base = random_certificate(5, POINTS_AND_ORIENTED_PLANES);
    base.minima = {{base.pose, base.cost}};
    expect_holds(run_on(folder, yaml_of(base)));
    const auto changed = [&](const std::string& name, const std::string& reason,
                             const std::function<void(TestCertificate&, double)>& change)
    {
        for (const double part : {1e-3, -1e-3})
        {
            SCOPED_TRACE(name + " by " + std::to_string(part));
            auto c = base;
            change(c, part);
            expect_refused(run_on(folder, yaml_of(c)), reason);
        }
    };
    for (int i = 0; i < 9; i++)
    {
        changed("rotation", "the rotation is off", [&](auto& c, double by) { c.pose.R(i / 3, i % 3) += by; });
        changed("rotation of a minimum", "rotation of minimum 1",
                [&](auto& c, double by) { c.minima[0].pose.R(i / 3, i % 3) += by; });
    }
    for (int i = 0; i < 3; i++)
    {
        const Vector3d axis = Vector3d::Unit(i);
        changed("turn", "the cost is",
                [&](auto& c, double by) { c.pose.R = c.pose.R * Eigen::AngleAxisd(by, axis); });
        changed("translation", "the translation is", [&](auto& c, double by) { c.pose.t[i] += by; });
        changed("turn of a minimum", "the cost of minimum 1",
                [&](auto& c, double by)
                { c.minima[0].pose.R = c.minima[0].pose.R * Eigen::AngleAxisd(by, axis); });
        changed("translation of a minimum", "translation of minimum 1",
                [&](auto& c, double by) { c.minima[0].pose.t[i] += by; });
    }
    changed("cost", "the cost is", [](auto& c, double by) { c.cost *= 1 + by; });
    changed("scale", "the scale is", [](auto& c, double by) { c.scale *= 1 + by; });
    changed("gap", "the gap is", [](auto& c, double by) { c.gap += by * c.scale; });
    changed("margin", "the margin is", [](auto& c, double by) { c.margin *= 1 + by; });
    changed("cost of a minimum", "the cost of minimum 1",
            [](auto& c, double by) { c.minima[0].cost *= 1 + by; });
    for (int i = 0; i < 9; i++)
        for (int j = 0; j < 9; j++)
        {
            changed("G", i == j ? "G does not belong" : "G is not symmetric",
                    [&](auto& c, double by) { c.G(i, j) += by * c.G.cwiseAbs().maxCoeff(); });
            if (i < j)
                changed("G, twice", "G does not belong",
                        [&](auto& c, double by)
                        {
                            c.G(i, j) += by * c.G.cwiseAbs().maxCoeff();
                            c.G(j, i) = c.G(i, j);
                        });
        }
}

TEST(icp_certify, every_changed_verdict_is_found)
{
    const Folder folder;
    const auto base = random_certificate(6, POINTS_AND_ORIENTED_PLANES);
    auto c = base;
    c.verdict = "global_ambiguous";
    expect_refused(run_on(folder, yaml_of(c)), "'global_ambiguous'");
    c.verdict = "gap";
    expect_refused(run_on(folder, yaml_of(c)), "'gap'");
    c = base, c.tolerance = 0.1;
    expect_refused(run_on(folder, yaml_of(c)), "tolerance");
    c = base, c.tolerance = -1e-9;
    expect_refused(run_on(folder, yaml_of(c)), "tolerance");
    c = base, c.pose.R = -c.pose.R;
    expect_refused(run_on(folder, yaml_of(c)), "determinant");
    c = base, c.pose = {base.pose.R.transpose(), -base.pose.R.transpose() * base.pose.t};
    expect_refused(run_on(folder, yaml_of(c)), "the cost is");
}

TEST(icp_certify, a_certificate_of_other_pairings_is_refused)
{
    const Folder folder;
    const auto base = random_certificate(7, POINTS_AND_ORIENTED_PLANES);
    auto c = base;
    c.pairings = random_certificate(8, POINTS_AND_ORIENTED_PLANES).pairings;
    expect_refused(run_on(folder, yaml_of(c)), "the cost is");
    c = base, c.pairings.pop_back();
    expect_refused(run_on(folder, yaml_of(c)), "the cost is");
    c = base, c.pairings.push_back(c.pairings[0]);
    expect_refused(run_on(folder, yaml_of(c)), "the cost is");
    c = base;
    for (auto& p : c.pairings) std::swap(p.local, p.global), std::swap(p.local_dir, p.global_dir);
    expect_refused(run_on(folder, yaml_of(c)), "NOT hold");
}

TEST(icp_certify, every_changed_number_of_a_pairing_is_found)
{
    const Folder folder;
    for (const auto& mix : {POINTS_AND_ORIENTED_PLANES, ALL_KINDS})
    {
        const auto base = read(folder, random_certificate(9, mix));
        ASSERT_TRUE(certify::check_certificate(base).holds());
        Random random(10);
        for (size_t i = 0; i < base.pairings.size(); i += mp2p_icp_test::repetitions(5, 1))
            for (int number = 0; number < 14; number++)
            {
                SCOPED_TRACE("pairing " + std::to_string(i) + ", number " + std::to_string(number));
                auto c = base;
                Pairing& p = c.pairings[i];
                const bool has_local_dir = p.kind == PairingKind::ln2ln || p.kind == PairingKind::pl2pl;
                const auto change = [&](Vector3d& v) {
                    v[number % 3] +=
                        1e-3 * (v.norm() > 0 ? v.norm() : 1) * (random.uniform(0, 1) < 0.5 ? -1 : 1);
                };
                if (number < 3)
                    change(p.global);
                else if (number < 6)
                    change(p.local);
                else if (number < 9 && p.kind != PairingKind::pt2pt)
                    change(p.global_dir);
                else if (number >= 9 && number < 12 && has_local_dir)
                    change(p.local_dir);
                else if (number == 12)
                    p.weight *= 1.001;
                else if (number == 13 && has_local_dir)
                    p.direction_weight *= 1.001;
                else
                    continue;
                EXPECT_FALSE(certify::check_certificate(c).holds());
            }
    }
}

TEST(icp_certify, a_direction_that_gains_or_loses_its_side_is_found)
{
    const Folder folder;
    const auto base = read(folder, random_certificate(11, ALL_KINDS));
    for (size_t i = 90; i < 150; i++)
    {
        auto c = base;
        c.pairings[i].oriented = !c.pairings[i].oriented;
        EXPECT_FALSE(certify::check_certificate(c).holds()) << i;
        c = base, c.pairings[i].local_dir *= -1;
        EXPECT_EQ(certify::check_certificate(c).holds(), !c.pairings[i].oriented) << i;
    }
}

// ---- Local minima
// -------------------------------------------------------------------------------------------
namespace
{
/// All that many starts lead to, the lowest first.
std::vector<Matrix3d> minima_of(const Maker& maker, Random& random)
{
    std::vector<Matrix3d> minima;
    for (int i = 0; i < 40; i++)
    {
        const Matrix3d R = maker.minimum_from(rotation(random.quaternion()));
        if (maker.gradient(R).norm() > 1e-9 * maker.mean()) continue;
        const auto same = [&](const Matrix3d& other) { return (R - other).norm() < 1e-3; };
        if (std::none_of(minima.begin(), minima.end(), same)) minima.push_back(R);
    }
    std::sort(minima.begin(), minima.end(),
              [&](const auto& a, const auto& b) { return maker.cost(a) < maker.cost(b); });
    return minima;
}
}  // namespace

TEST(icp_certify, no_local_minimum_passes_for_a_global_one)
{
    const Folder folder;
    size_t seen = 0;
    for (uint32_t seed = 1; seed <= mp2p_icp_test::repetitions(6, 200); seed++)
    {
        SCOPED_TRACE(seed);
        Random random(seed);
        const Maker maker(random_pairings(random, random_pose(random), {{0, 0, 0, 2, 3}, 0.1, 0}));
        const auto minima = minima_of(maker, random);
        ASSERT_FALSE(minima.empty());
        const double best = maker.cost(minima[0]);
        for (size_t i = 1; i < minima.size(); i++)
        {
            const TestCertificate honest = maker.certificate_at(minima[i]);
            if (honest.cost - best < 1e-6 * honest.scale) continue;
            seen++;
            auto c = honest;
            c.gap = 0;
            expect_refused(run_on(folder, yaml_of(c)), "the gap is");
            // A positive G, as near to the true ones as can be.
            const Eigen::SelfAdjointEigenSolver<Matrix9d> eigen(honest.G);
            c.G = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).asDiagonal() *
                  eigen.eigenvectors().transpose();
            c.G = (c.G + c.G.transpose()).eval() / 2;
            c.margin = Maker::least_eigenvalue(c.G);
            expect_refused(run_on(folder, yaml_of(c)), "G does not belong");

            c = honest, c.verdict = "gap";
            const auto bound = run_on(folder, yaml_of(c));
            expect_holds(bound);
            EXPECT_TRUE(contains(bound.out, "a bound, and no proof")) << bound.out;
            EXPECT_GE(certify::check_certificate(read(folder, c)).gap.found, honest.cost - best);
            c.gap /= 2;
            expect_refused(run_on(folder, yaml_of(c)), "the gap is");
        }
    }
    EXPECT_GE(seen, 5u);
}

TEST(icp_certify, a_pose_beside_its_minimum_has_the_gap_of_its_gradient)
{
    const Folder folder;
    const auto base = random_certificate(12, ALL_KINDS);
    const Maker maker(base.pairings);
    for (const double angle : {1e-6, 1e-4, 1e-2})
    {
        SCOPED_TRACE(angle);
        auto c =
            maker.certificate_at(base.pose.R * Eigen::AngleAxisd(angle, Vector3d(1, 2, -1).normalized()));
        const double lower = c.cost - base.cost;
        expect_refused(run_on(folder, yaml_of(c)), "but the gap is");
        c.verdict = "gap";
        expect_holds(run_on(folder, yaml_of(c)));
        EXPECT_GE(certify::check_certificate(read(folder, c)).gap.found, lower);
        c.verdict = "global", c.gap = 0;  // G is positive, but that says nothing here
        ASSERT_GT(c.margin, 0);
        expect_refused(run_on(folder, yaml_of(c)), "the gap is");
    }
}

TEST(icp_certify, a_minimum_without_a_proof_has_only_a_bound)
{
    // The cost of these is a constant and a quartic form of Choi and Lam: positive, but no sum of squares.
    const std::string path = mp2p_icp_test::shared_data("solver/choilam_pairs.txt");
    MP2P_ICP_SKIP_WITHOUT(path);
    std::ifstream in(path);
    std::vector<Pairing> pairings;
    for (std::string line; std::getline(in, line);)
    {
        std::istringstream words(line);
        Pairing p;
        p.kind = PairingKind::pt2pl;
        for (Vector3d* v : {&p.local, &p.global, &p.global_dir}) words >> v->x() >> v->y() >> v->z();
        if (words >> p.weight) pairings.push_back(p);
    }
    ASSERT_EQ(pairings.size(), 68u);
    const Folder folder;
    Random random(24);
    const Maker maker(pairings);
    const auto honest = maker.certificate_at(minima_of(maker, random).at(0));
    ASSERT_GT(honest.gap, 0.137 * honest.scale);  // the best bound that a G can give
    auto c = honest;
    c.gap = 0;
    expect_refused(run_on(folder, yaml_of(c)), "the verdict is 'global', but the gap is");
    c = honest, c.verdict = "gap";
    const auto o = run_on(folder, yaml_of(c));
    expect_holds(o);
    EXPECT_TRUE(contains(o.out, "a bound, and no proof")) << o.out;
}

TEST(icp_certify, equal_minima_make_the_verdict_ambiguous)
{
    const Folder folder;
    Random random(13);
    const TestPose truth = random_pose(random);
    // Three walls at right angles without sides: half turns change nothing.
    std::vector<Pairing> pairings;
    for (int i = 0; i < 3; i++)
    {
        Pairing p;
        p.kind = PairingKind::pl2pl, p.weight = 1, p.direction_weight = 1;
        p.local_dir = Vector3d::Unit(i), p.global_dir = truth.R * p.local_dir;
        p.local.setZero(), p.global = truth.t;
        pairings.push_back(p);
    }
    const Maker maker(pairings);
    const auto minima = minima_of(maker, random);
    ASSERT_EQ(minima.size(), 4u);
    auto c = maker.certificate_at(minima[0]);
    for (const auto& R : minima) c.minima.push_back({{R, maker.translation(R)}, maker.cost(R)});
    expect_refused(run_on(folder, yaml_of(c)), "3 other listed minima");
    c.verdict = "global_ambiguous";
    expect_holds(run_on(folder, yaml_of(c)));
    EXPECT_TRUE(contains(run_on(folder, yaml_of(c)).out, "see the listed minima"));
    // A cost of zero cannot be beaten, but a wrong G is refused all the same.
    auto wrong = c;
    wrong.G(2, 2) += 1e-3, wrong.margin = Maker::least_eigenvalue(wrong.G);
    expect_refused(run_on(folder, yaml_of(wrong)), "G does not belong");
    c.minima.resize(1);
    expect_refused(run_on(folder, yaml_of(c)), "'global_ambiguous'");
}

TEST(icp_certify, an_unobservable_verdict_needs_a_free_motion)
{
    const Folder folder;
    // Points of a line turn about it.
    Random random(14);
    const TestPose truth = random_pose(random);
    auto pairings = random_pairings(random, truth, {{5, 0, 0, 0, 0}, 0, 0});
    for (auto& p : pairings)
        p.local = Vector3d(1, 2, 3) * random.normal(), p.global = truth.R * p.local + truth.t;
    const Maker maker(pairings);
    auto c = maker.certificate_at(truth.R);
    c.verdict = "unobservable";
    const auto o = run_on(folder, yaml_of(c));
    expect_holds(o);
    EXPECT_TRUE(contains(o.out, "motions are left free")) << o.out;
    c.verdict = "global_ambiguous";
    expect_refused(run_on(folder, yaml_of(c)), "no other listed minimum");
    auto rigid = Maker(random_pairings(random, truth, {{5, 0, 0, 0, 0}, 0, 0})).certificate_at(truth.R);
    expect_holds(run_on(folder, yaml_of(rigid)));
    rigid.verdict = "unobservable";
    expect_refused(run_on(folder, yaml_of(rigid)), "rises in all directions");
}

TEST(icp_certify, minima_must_be_in_order)
{
    const Folder folder;
    for (uint32_t seed = 1;; seed++)
    {
        ASSERT_LT(seed, 50u);
        Random random(seed);
        const Maker maker(random_pairings(random, random_pose(random), {{0, 0, 0, 2, 3}, 0.1, 0}));
        const auto minima = minima_of(maker, random);
        if (minima.size() < 2) continue;
        auto c = maker.certificate_at(minima[0]);
        c.verdict = c.gap > c.tolerance * c.scale ? "gap" : "global";
        for (const auto& R : minima) c.minima.push_back({{R, maker.translation(R)}, maker.cost(R)});
        expect_holds(run_on(folder, yaml_of(c)));
        std::swap(c.minima.front(), c.minima.back());
        expect_refused(run_on(folder, yaml_of(c)), "order");
        return;
    }
}

// ---- Pairings from elsewhere
// ---------------------------------------------------------------------------------
TEST(icp_certify, takes_the_pairings_from_another_file)
{
    const Folder folder;
    const auto c = random_certificate(15, ALL_KINDS), other = random_certificate(16, ALL_KINDS);
    auto empty = c;
    empty.pairings.clear();
    const auto certificate = folder.file("c.yaml", yaml_of(c)),
               without = folder.file("e.yaml", yaml_of(empty));
    const auto right_csv = folder.file("right.csv", "# mine\n\n" + lines_of(c.pairings, ""));
    const auto wrong_csv = folder.file("wrong.csv", lines_of(other.pairings, " "));
    const auto right_yaml =
        folder.file("right.yaml", "name: x\npairings: |-\n" + lines_of(c.pairings, "    "));
    const auto windows =
        folder.file("windows.csv", std::regex_replace(lines_of(c.pairings, ""), std::regex("\n"), "\r\n"));
    for (const auto& path : {right_csv, right_yaml, windows, certificate})
    {
        expect_holds(run({certificate, "--pairings", path}));
        expect_holds(run({without, "--pairings=" + path}));
    }
    for (const auto& path : {wrong_csv, folder.file("o.yaml", yaml_of(other))})
        expect_refused(run({certificate, "--pairings", path}), "the cost is");
    expect_complaint(run({without}), {"e.yaml", "at least one pairing"});
    expect_complaint(run({certificate, "--pairings", without}), {"e.yaml", "at least one pairing"});
    expect_complaint(run({certificate, "--pairings", folder.path("none.csv")}), {"none.csv"});
    expect_complaint(run({certificate, "--pairings", folder.file("k.yaml", "a: 1\n")}),
                     {"k.yaml", "pairings"});
    expect_complaint(run({certificate, "--pairings", folder.file("l.csv", "# a\n\npt2pt,1, 0,0,0, 0,0\n")}),
                     {"l.csv", "line 3", "pt2pt,w, gx,gy,gz, lx,ly,lz", "end of the line"});
}

TEST(icp_certify, reads_pairings_in_any_form_of_yaml)
{
    const Folder folder;
    const auto c = random_certificate(17, POINTS_AND_ORIENTED_PLANES);
    const std::string whole = yaml_of(c), head = whole.substr(0, whole.find("pairings:"));
    std::string quoted = lines_of(c.pairings, "");
    quoted = "\"" + std::regex_replace(quoted, std::regex("\n"), "\\n") + "\"";
    expect_holds(run_on(folder, head + "pairings: " + quoted + "\n"));
    const std::string block = whole.substr(head.size());
    expect_holds(run_on(folder, block + head));  // in front of the other keys
    expect_holds(run_on(folder, std::regex_replace(block + head, std::regex("\n"), "\r\n")));
    expect_holds(
        run_on(folder, "---\n" + head + "pairings:   |  # all of them\n" + lines_of(c.pairings, "   ")));
}

// ---- Hostile files
// ------------------------------------------------------------------------------------------
TEST(icp_certify, says_what_is_wrong_with_a_file_and_where)
{
    const Folder folder;
    const auto c = random_certificate(18, {{4, 1, 1, 1, 1}, 0.02, 1});
    const std::string good = yaml_of(c);
    const auto line_of_text = [](const std::string& all, const std::string& part)
    {
        const auto at = all.find(part);
        return std::to_string(1 +
                              std::count(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
    };
    const auto replaced = [&](const std::string& pattern, const std::string& by)
    {
        const std::string out =
            std::regex_replace(good, std::regex(pattern), by, std::regex_constants::format_first_only);
        EXPECT_NE(out, good) << pattern;
        return out;
    };
    const auto expect = [&](const std::string& content, const std::vector<std::string>& words)
    {
        SCOPED_TRACE(words[0]);
        auto all = words;
        all.push_back("c.yaml");
        expect_complaint(run_on(folder, content), all);
    };
    expect("", {"nothing", "a certificate"});
    expect("\n# nothing\n", {"nothing"});
    expect("[1, 2", {"c.yaml:2", "closing bracket"});
    expect("- 1\n", {"no YAML map"});
    expect("hello", {"no YAML map"});
    expect(std::string("\0\x01\xff\xfe\n\0", 6), {"c.yaml"});
    expect(good + "cost: 1\n", {"'cost' stands twice"});
    expect(good + "pairings: |\n  pt2pt,1, 0,0,0, 0,0,0\n", {"'pairings' stands twice"});
    expect(replaced("cost: ", "kost: "), {"c.yaml:4", "unknown key 'kost'", "did you mean 'cost'"});
    expect(replaced("certificate: 1", "certificate: 2"), {"c.yaml:1", "version 1", "found 2"});
    expect(replaced("mp2p_icp_certificate: 1\n", ""), {"mp2p_icp_certificate"});
    expect(replaced("verdict: global", "verdict: best"), {"c.yaml:2", "expected global", "'best'"});
    expect(replaced("scale: [^\n]*", "scale: large"), {"c.yaml:5", "finite number", "'large'"});
    expect(replaced("scale: [^\n]*", "scale: .nan"), {"c.yaml:5", "finite number"});
    expect(replaced("cost: [^\n]*", "cost: .inf"), {"c.yaml:4", "finite number"});
    expect(replaced("cost: [^\n]*", "cost: 1e999"), {"c.yaml:4", "finite number"});
    expect(replaced("cost: [^\n]*", "cost: ~"), {"c.yaml:4", "null"});
    expect(replaced("cost: [^\n]*", "cost: [1]"), {"c.yaml:4", "single value"});
    expect(replaced("cost: [^\n]*\n", ""), {"expected the key 'cost'"});
    expect(replaced("rotation: \\[", "rotation: [0, "), {"c.yaml:8", "9 numbers, found 10"});
    expect(replaced("rotation: [^\n]*", "rotation: 1"), {"c.yaml:8", "9 numbers"});
    expect(replaced("translation: [^\n]*", "translation: [1, 2]"), {"c.yaml:9", "3 numbers, found 2"});
    expect(replaced("translation: [^\n]*", "translation: [1, 2, {a: 1}]"), {"c.yaml:9", "translation[2]"});
    expect(replaced("G: \\[[^,]*, ", "G: ["), {"c.yaml:10", "81 numbers, found 80"});
    expect(replaced("G: \\[[^,]*, ", "G: [nan, "), {"c.yaml:10", "G[0]", "finite number"});
    expect(replaced("pairings:", "minima: 3\npairings:"), {"c.yaml:11", "list of minima"});
    expect(replaced("pairings:", "minima: [1]\npairings:"), {"c.yaml:11", "minima[0]"});
    expect(replaced("pairings:", "prior: {rotation: [1]}\npairings:"), {"c.yaml:11", "prior.rotation"});
    expect(replaced("pairings:[^]*", "pairings: [1, 2]\n"), {"c.yaml:11", "pairings"});
    expect(replaced("pairings:[^]*", ""), {"'pairings'"});
    expect(replaced("pairings:[^]*", "pairings: |\n"), {"at least one pairing"});
    expect(replaced("pairings:[^]*", "pairings: ~\n"), {"at least one pairing"});

    const auto expect_at =
        [&](const std::string& pattern, const std::string& by, const std::vector<std::string>& words)
    {
        const std::string content = replaced(pattern, by);
        auto all = words;
        all.push_back("line " + line_of_text(content, by));
        expect(content, all);
    };
    expect_at("pt2ln,", "pt2lm,", {"'pt2lm'", "pt2pt, pt2ln"});
    expect_at("pt2ln,", "pt2ln,-1,", {"not negative"});
    expect_at("pt2ln,", "pt2ln,nan,", {"finite"});
    expect_at("pt2ln,", "pt2ln,inf,", {"finite"});
    expect_at("pt2ln,", "pt2ln,,", {"a number, found ''"});
    expect_at("pt2ln,", "pt2ln,1e999,", {"a number"});
    expect_at("pt2ln,", "pt2ln,1x,", {"a number", "'1x'"});
    expect_at("pt2ln,", "pt2ln,1,2,", {"more: "});
    expect_at("pt2ln,[^\n]*", "pt2ln", {"pt2ln,w, px,py,pz", "end of the line"});
    expect_at("pt2ln,[^\n]*", "pt2ln,1, 1,2,3, 0,0,-0.0, 1,2,3", {"direction", "length zero"});
    expect_at("pl2pl,[^\n]*", "pl2pl,1,1,free, 1,2,3, 0,0,1, 1,2,3, 0,0,0", {"direction", "length zero"});
    expect_at("pl2pl,[^\n]*", "pl2pl,1,1,sided, 1,2,3, 0,0,1, 1,2,3, 0,0,1",
              {"'free' or 'oriented'", "'sided'"});
    expect_at("pt2pt,", "pt2pt;1;", {"a pairing"});
    expect_complaint(run({folder.path("none.yaml")}), {"none.yaml", "opened"});
    expect_complaint(run({folder.path("")}), {"folder"});
}

TEST(icp_certify, refuses_what_is_no_prior)
{
    const Folder folder;
    auto c = random_certificate(19, POINTS_AND_ORIENTED_PLANES);
    c.prior = TestPrior{};
    const auto complaint = [&](int i, int j, double value)
    {
        auto wrong = c;
        wrong.prior->information.diagonal().setOnes();
        wrong.prior->information(i, j) = value;
        return run_on(folder, yaml_of(wrong));
    };
    expect_complaint(complaint(2, 2, -1), {"c.yaml", "negative"});
    expect_complaint(complaint(2, 3, 0.5), {"c.yaml", "symmetric"});
    auto wrong = c;
    wrong.prior->information.diagonal().setOnes();
    wrong.prior->information(0, 4) = wrong.prior->information(4, 0) = 1.001;
    expect_complaint(run_on(folder, yaml_of(wrong)), {"c.yaml", "semidefinite"});
    expect_holds(run_on(folder, yaml_of(c)));  // one that knows nothing
}

TEST(icp_certify, extreme_numbers_are_refused_and_do_no_harm)
{
    const Folder folder;
    const auto base = random_certificate(20, POINTS_AND_ORIENTED_PLANES);
    for (const double value : {1e308, -1e308, 1e200, 5e-324})
    {
        auto c = base;
        c.G.setConstant(value);
        EXPECT_EQ(run_on(folder, yaml_of(c)).code, 2);
        c = base, c.scale = value;
        EXPECT_EQ(run_on(folder, yaml_of(c)).code, 2);
        c = base, c.gap = 1e-3 + value;
        EXPECT_EQ(run_on(folder, yaml_of(c)).code, 2);
        c = base, c.pose.t.setConstant(value);
        EXPECT_EQ(run_on(folder, yaml_of(c)).code, 2);
        c = base, c.pose.R.setConstant(value);
        EXPECT_EQ(run_on(folder, yaml_of(c)).code, 2);
        c = base, c.pairings[0].global.x() = value;
        EXPECT_NE(run_on(folder, yaml_of(c)).code, 0);
        c = base, c.pairings[0].weight = std::abs(value);
        EXPECT_NE(run_on(folder, yaml_of(c)).code, 0);
    }
    // All weights zero: there is no cost and nothing to certify, and no harm is done.
    auto c = base;
    for (auto& p : c.pairings) p.weight = p.direction_weight = 0;
    EXPECT_EQ(run_on(folder, yaml_of(c)).code, 2);
}

TEST(icp_certify, damaged_files_never_crash_it)
{
    const Folder folder;
    const std::string good = yaml_of(random_certificate(21, {{6, 1, 1, 1, 1}, 0.02, 1}));
    // Without the last number's last digits a certificate may still hold.
    for (size_t length = 0; length + 25 < good.size(); length += mp2p_icp_test::repetitions(37, 1))
        EXPECT_NE(run_on(folder, good.substr(0, length)).code, 0) << length;
    Random random(22);
    for (size_t i = 0; i < mp2p_icp_test::repetitions(300, 20000); i++)
    {
        std::string bad = good;
        for (size_t k = 0; k <= i % 4; k++)
            bad[random.index(bad.size())] = static_cast<char>(random.index(256));
        const auto o = run_on(folder, bad);
        EXPECT_TRUE(o.code == 0 || o.code == 1 || o.code == 2) << i;
        EXPECT_EQ(o.code == 1, !o.err.empty()) << i;
        EXPECT_LE(std::count(o.err.begin(), o.err.end(), '\n'), 1) << o.err;
    }
}

// ---- The program
// --------------------------------------------------------------------------------------------
TEST(icp_certify, help_version_and_mistakes)
{
    for (const char* flag : {"--help", "-h"})
    {
        const auto o = run({flag});
        EXPECT_EQ(o.code, 0);
        EXPECT_EQ(o.err, "");
        for (const char* part :
             {"icp-certify certificate.yaml", "--pairings my_pairings.csv", "--yaml", "Exit code"})
            EXPECT_TRUE(contains(o.out, part)) << part;
    }
    EXPECT_TRUE(contains(run({"--version"}).out, "icp-certify "));
    expect_complaint(run({}), {"certificate", "required", "--help"});
    expect_complaint(run({"a.yaml", "--pairing", "b"}), {"--pairing", "did you mean '--pairings'"});
    expect_complaint(run({"a.yaml", "b.yaml"}), {"b.yaml"});
    expect_complaint(run({"a.yaml", "--pairings"}), {"--pairings"});
}

TEST(icp_certify, gives_its_exit_codes_to_the_shell)
{
    const Folder folder;
    const auto c = random_certificate(23, ALL_KINDS);
    auto wrong = c;
    wrong.cost *= 2;
    const auto start = [&](const std::string& argument)
    {
        const int status = std::system((std::string(ICP_CERTIFY_PROGRAM) + " " + argument + " >" +
                                        folder.path("out") + " 2>" + folder.path("err"))
                                           .c_str());
        std::ifstream out(folder.path("out")), err(folder.path("err"));
        return Outcome{WIFEXITED(status) ? WEXITSTATUS(status) : -1,
                       {std::istreambuf_iterator<char>(out), {}},
                       {std::istreambuf_iterator<char>(err), {}}};
    };
    expect_holds(start(folder.file("c.yaml", yaml_of(c))));
    expect_refused(start(folder.file("w.yaml", yaml_of(wrong))), "the cost is");
    expect_complaint(start(folder.path("none.yaml")), {"none.yaml"});
    EXPECT_EQ(start("--help").code, 0);
}

// ---- Independence
// -------------------------------------------------------------------------------------------
namespace
{
/// Where an include of the project's own leads to; empty if it is of the system or made by the build.
std::string resolved(const std::string& include, const std::filesystem::path& from)
{
    namespace fs = std::filesystem;
    const fs::path root = fs::path(MP2P_ICP_SOURCE_DIR);
    std::vector<fs::path> folders = {from.parent_path()};
    for (const char* top : {"mp2p_icp", "apps"})
        for (const auto& room : fs::directory_iterator(root / top))
            if (room.is_directory())
                for (const char* sub : {"include", "src", ""}) folders.push_back(room.path() / sub);
    for (const auto& folder : folders)
        if (fs::is_regular_file(folder / include)) return fs::weakly_canonical(folder / include).string();
    return {};
}

void follow_includes(const std::string& path, std::set<std::string>& reached)
{
    if (!reached.insert(path).second) return;
    std::ifstream in(path);
    const std::regex include("^\\s*#\\s*include\\s*[<\"]([^>\"]+)[>\"].*");
    std::smatch match;
    for (std::string line; std::getline(in, line);)
    {
        if (!std::regex_match(line, match, include)) continue;
        if (const std::string next = resolved(match[1], path); !next.empty()) follow_includes(next, reached);
    }
}
}  // namespace

TEST(icp_certify, shares_no_numerics_with_the_solvers)
{
    namespace fs = std::filesystem;
    const std::string root = fs::weakly_canonical(MP2P_ICP_SOURCE_DIR).string();
    std::set<std::string> reached;
    for (const auto& file : fs::directory_iterator(root + "/apps/icp-certify"))
        if (file.path().extension() == ".cpp" || file.path().extension() == ".h")
            follow_includes(fs::weakly_canonical(file.path()).string(), reached);
    for (const auto& path : reached)
    {
        const bool own = path.rfind(root + "/apps/icp-certify/", 0) == 0;
        const bool core = path.rfind(root + "/mp2p_icp/core/", 0) == 0;
        EXPECT_TRUE(own || core) << path;
    }
    // The walk does find what there is: own headers, those of the core room, and their solvers from
    // elsewhere.
    const std::string core = root + "/mp2p_icp/core/include/mp2p_icp/";
    for (const auto& path :
         {root + "/apps/icp-certify/main.cpp", root + "/apps/icp-certify/cost_form.h",
          root + "/apps/icp-certify/quartic.cpp", core + "errors.h", core + "yaml_tools.h"})
        EXPECT_EQ(reached.count(path), 1u) << path;
    std::set<std::string> from_icp_run;
    follow_includes(root + "/apps/icp-run/icp_run.cpp", from_icp_run);
    EXPECT_TRUE(std::any_of(from_icp_run.begin(), from_icp_run.end(),
                            [](const std::string& path) { return contains(path, "/mp2p_icp/solvers/"); }));
}
