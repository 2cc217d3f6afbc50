#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "../../mp2p_icp/solvers/src/rotation_certificate.h"
#include "../../mp2p_icp/solvers/src/rotation_search.h"
#include "random_pairings.h"
#include "test_repetitions.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;
using Eigen::Quaterniond;
using Matrix9 = Eigen::Matrix<double, 9, 9>;
using Matrix10 = Eigen::Matrix<double, 10, 10>;
using Vector10 = Eigen::Matrix<double, 10, 1>;

namespace
{
const double NaN = std::numeric_limits<double>::quiet_NaN(), INF = std::numeric_limits<double>::infinity();
constexpr double TOLERANCE = 1e-9;

// ---- Problems, built from single rows --------------------------------------------------------------------

/// A sum of squared rows w (a' (R p + t) - c)^2, without t for directions.
class Rows
{
 public:
    enum class Of
    {
        Positions,
        Directions
    };
    void add(double w, const Vector3d& a, const Vector3d& p, double c, Of what = Of::Positions)
    {
        Vector12 j;
        j << p(0) * a, p(1) * a, p(2) * a, (what == Of::Positions ? 1 : 0) * a;
        sum_.K += w * j * j.transpose(), sum_.k += w * c * j, sum_.qq += w * c * c;
    }
    /// w |C (R p + t - q)|^2, C the projection onto u, or onto what is orthogonal to u, or the identity.
    void add_along(double w, const Vector3d& u, const Vector3d& p, const Vector3d& q, Of what = Of::Positions)
    {
        add(w, u, p, u.dot(q), what);
    }
    void add_across(double w, const Vector3d& u, const Vector3d& p, const Vector3d& q,
                    Of what = Of::Positions)
    {
        const Vector3d a = u.unitOrthogonal();
        add_along(w, a, p, q, what), add_along(w, u.cross(a), p, q, what);
    }
    void add_all(double w, const Vector3d& p, const Vector3d& q, Of what = Of::Positions)
    {
        for (int i = 0; i < 3; i++) add_along(w, Vector3d::Unit(i), p, q, what);
    }

    RotationQuadratic rotation_quadratic() const { return RotationQuadratic(sum_); }

    /// By columns of R and 1, with the best t: a Schur complement, without directions that no row determines.
    Matrix10 Q() const
    {
        Matrix10 out;
        out << sum_.K.topLeftCorner<9, 9>(), -sum_.k.head<9>(), -sum_.k.head<9>().transpose(), sum_.qq;
        Eigen::Matrix<double, 10, 3> with_t;
        with_t << sum_.K.topRightCorner<9, 3>(), -sum_.k.tail<3>().transpose();
        const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(sum_.K.bottomRightCorner<3, 3>());
        for (int i = 0; i < 3; i++)
        {
            if (!(eigen.eigenvalues()(i) > 1e-10 * eigen.eigenvalues()(2))) continue;
            const Vector10 row = with_t * eigen.eigenvectors().col(i);
            out -= row * row.transpose() / eigen.eigenvalues()(i);
        }
        return 0.5 * (out + out.transpose());
    }

 private:
    PoseQuadratic sum_;
};

RotationQuadratic rotation_quadratic(const Matrix10& Q)
{
    PoseQuadratic p;
    p.K.topLeftCorner<9, 9>() = Q.topLeftCorner<9, 9>();
    p.k.head<9>() = -Q.topRightCorner<9, 1>();
    p.qq = Q(9, 9);
    return RotationQuadratic(p);
}

enum class Kind
{
    Point,
    Line,
    Plane,
    LineToLine,       // directions without sign
    OrientedPlanes,   // with
    PlanesEitherWay,  // without
    DirectionOnly,    // without sign
};
struct NamedMix
{
    std::string name;
    std::vector<Kind> kinds;
    size_t minimal;
};
const std::vector<NamedMix>& all_mixes()
{
    using K = Kind;
    static const std::vector<NamedMix> all = {
        {"points", {K::Point}, 3},
        {"lines", {K::Line}, 3},
        {"planes", {K::Plane}, 6},
        {"line to line", {K::LineToLine}, 2},
        {"oriented planes", {K::OrientedPlanes}, 3},
        {"planes either way", {K::PlanesEitherWay}, 3},
        {"points and planes", {K::Point, K::Plane}, 4},
        {"lines and planes", {K::Line, K::Plane}, 4},
        {"points and lines to lines", {K::Point, K::LineToLine}, 2},
        {"planes of both sorts", {K::Plane, K::PlanesEitherWay}, 4},
        {"directions", {K::DirectionOnly}, 3},
        {"all", {K::Point, K::Line, K::Plane, K::LineToLine, K::OrientedPlanes, K::PlanesEitherWay}, 6},
    };
    return all;
}

void add_pairing(Kind kind, const Matrix3d& R, const Vector3d& t, double noise, SeededRandom& random,
                 Rows& rows)
{
    const double w = random.uniform(0.1, 3);
    const Vector3d q = R * random_point(random, 1) + t, u = random_direction(random);
    const Vector3d local_q = R.transpose() * (q - t) + noise * gaussian_vector(random);
    const Vector3d local_u = (R.transpose() * u + noise * gaussian_vector(random)).normalized();
    const Vector3d along = random.gaussian() * u, across = u.cross(gaussian_vector(random));
    const auto direction = Rows::Of::Directions;
    if (kind == Kind::Point) rows.add_all(w, local_q, q);
    if (kind == Kind::Line || kind == Kind::LineToLine) rows.add_across(w, u, local_q, q + along);
    if (kind == Kind::Plane || kind == Kind::OrientedPlanes || kind == Kind::PlanesEitherWay)
        rows.add_along(w, u, local_q, q + across);
    if (kind == Kind::OrientedPlanes) rows.add_all(w, local_u, u, direction);
    if (kind == Kind::LineToLine || kind == Kind::PlanesEitherWay || kind == Kind::DirectionOnly)
        rows.add_across(w, u, local_u, Vector3d::Zero(), direction);
}

Rows random_rows(const NamedMix& mix, size_t count, double noise, SeededRandom& random)
{
    const Matrix3d R = any_rotation(random);
    const Vector3d t = gaussian_vector(random);
    Rows rows;
    for (size_t i = 0; i < count; i++)
        add_pairing(mix.kinds[i % mix.kinds.size()], R, t, noise, random, rows);
    return rows;
}

/// Calls check(rows) for all mixes, sizes from minimal sets to 100, and noises up to 30 % of the scene.
template <class Check>
void for_random_rows(size_t count, uint64_t seed, const Check& check)
{
    SeededRandom random(seed);
    for (size_t i = 0; i < count; i++)
        for (const auto& mix : all_mixes())
            for (const size_t size : {mix.minimal, mix.minimal + 1, size_t(10), size_t(100)})
                for (const double noise : {0.0, 0.03, 0.1, 0.3})
                {
                    SCOPED_TRACE(mix.name + ", " + std::to_string(size) + ", noise " + std::to_string(noise) +
                                 ", seed " + std::to_string(seed) + ", round " + std::to_string(i));
                    check(random_rows(mix, size, noise, random));
                }
}

/// The lowest cost that descents from random rotations come to: never below the true minimum.
double lowest_by_descents(const RotationQuadratic& f, size_t starts, SeededRandom& random)
{
    double lowest = INF;
    for (size_t i = 0; i < starts; i++)
        lowest = std::min(lowest, minimise_rotation(f, any_rotation(random)).cost);
    return lowest;
}

double fraction(size_t part, size_t of)
{
    return static_cast<double>(part) / static_cast<double>(of);
}

/// What f loses to rounding when it is evaluated, with a margin: |x|^2 = 4, and sums of ten numbers.
double rounding_of(const Matrix10& Q)
{
    return 4e-15 * Q.norm();
}

// ---- Polynomials in a quaternion, term by term: slow and obvious ------------------------------------------

class Polynomial
{
 public:
    using Exponents = std::array<int, 4>;  // of w x y z
    static Polynomial variable(size_t i)
    {
        Polynomial p;
        Exponents e{};
        e[i] = 1, p.terms_[e] = 1;
        return p;
    }
    friend Polynomial operator*(const Polynomial& a, const Polynomial& b)
    {
        Polynomial out;
        for (const auto& [ea, ca] : a.terms_)
            for (const auto& [eb, cb] : b.terms_)
                out.terms_[{ea[0] + eb[0], ea[1] + eb[1], ea[2] + eb[2], ea[3] + eb[3]}] += ca * cb;
        return out;
    }
    friend Polynomial operator*(double c, Polynomial a)
    {
        for (auto& term : a.terms_) term.second *= c;
        return a;
    }
    friend Polynomial operator+(Polynomial a, const Polynomial& b)
    {
        for (const auto& [e, c] : b.terms_) a.terms_[e] += c;
        return a;
    }
    friend Polynomial operator-(const Polynomial& a, const Polynomial& b) { return a + -1.0 * b; }
    double of(const Exponents& e) const { return terms_.count(e) ? terms_.at(e) : 0; }
    const std::map<Exponents, double>& terms() const { return terms_; }
    double largest() const
    {
        double out = 0;
        for (const auto& term : terms_) out = std::max(out, std::abs(term.second));
        return out;
    }

 private:
    std::map<Exponents, double> terms_;
};
struct SymbolicQuaternion
{
    Polynomial w = Polynomial::variable(0), x = Polynomial::variable(1), y = Polynomial::variable(2),
               z = Polynomial::variable(3), norm_sq = w * w + x * x + y * y + z * z;
};
const SymbolicQuaternion& symbolic_quaternion()
{
    static const SymbolicQuaternion q;
    return q;
}

/// Columns of R(q), and |q|^2.
std::array<Polynomial, 10> rotation_polynomials()
{
    const auto& [w, x, y, z, norm_sq] = symbolic_quaternion();
    return {w * w + x * x - y * y - z * z, 2.0 * (x * y + w * z),
            2.0 * (x * z - w * y),         2.0 * (x * y - w * z),
            w * w - x * x + y * y - z * z, 2.0 * (y * z + w * x),
            2.0 * (x * z + w * y),         2.0 * (y * z - w * x),
            w * w - x * x - y * y + z * z, norm_sq};
}

/// x' Q x for R0 R(q).
Polynomial cost_polynomial(const Matrix10& Q, const Matrix3d& R0)
{
    const auto turn = rotation_polynomials();
    std::array<Polynomial, 10> X;
    for (int column = 0; column < 3; column++)
        for (int row = 0; row < 3; row++)
            for (int i = 0; i < 3; i++)
            {
                auto& entry = X[static_cast<size_t>(3 * column + row)];
                entry = entry + R0(row, i) * turn[static_cast<size_t>(3 * column + i)];
            }
    X[9] = turn[9];
    Polynomial out;
    for (size_t i = 0; i < 10; i++)
        for (size_t j = 0; j < 10; j++)
            out = out + Q(static_cast<int>(i), static_cast<int>(j)) * (X[i] * X[j]);
    return out;
}

/// The entries of z: r wx, r wy, r wz, xx, yy, zz, r xy, r xz, r yz.
std::array<Polynomial, 9> certificate_monomials()
{
    const auto& [w, x, y, z, norm_sq] = symbolic_quaternion();
    const double r = std::sqrt(2.0);
    return {r * (w * x), r * (w * y), r * (w * z), x * x,      y * y,
            z * z,       r * (x * y), r * (x * z), r * (y * z)};
}
Polynomial gram_polynomial(const Matrix9& G)
{
    static const auto m = certificate_monomials();
    Polynomial out;
    for (size_t i = 0; i < 9; i++)
        for (size_t j = 0; j < 9; j++)
            out = out + G(static_cast<int>(i), static_cast<int>(j)) * (m[i] * m[j]);
    return out;
}

/// An orthonormal basis of the symmetric 9x9 matrices that are zero as forms in q.
std::vector<Matrix9> zero_forms()
{
    std::vector<Matrix9> units;
    std::map<Polynomial::Exponents, int> row_of;
    Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(35, 45);  // quartic monomials by entries
    for (int i = 0; i < 9; i++)
        for (int j = 0; j <= i; j++)
        {
            Matrix9 unit = Matrix9::Zero();
            unit(i, j) = unit(j, i) = i == j ? 1 : std::sqrt(0.5);
            const Polynomial form = gram_polynomial(unit);
            for (const auto& [e, c] : form.terms())
                if (c != 0)
                    sums(row_of.emplace(e, static_cast<int>(row_of.size())).first->second,
                         static_cast<int>(units.size())) = c;
            units.push_back(unit);
        }
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(sums, Eigen::ComputeFullV);
    std::vector<Matrix9> out;
    for (auto k = svd.rank(); k < 45; k++)
    {
        Matrix9 form = Matrix9::Zero();
        for (int i = 0; i < 45; i++) form += svd.matrixV()(i, k) * units[static_cast<size_t>(i)];
        out.push_back(form);
    }
    return out;
}

double least_eigenvalue(const Matrix9& G)
{
    return Eigen::SelfAdjointEigenSolver<Matrix9>(G).eigenvalues()(0);
}

// ---- A form that is nonnegative without being a sum of squares --------------------------------------------

/// The x >= 0 that minimises |A x - b|: Lawson and Hanson, 1974.
Eigen::VectorXd nonnegative_least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b)
{
    Eigen::VectorXd solution = Eigen::VectorXd::Zero(A.cols());
    std::vector<Eigen::Index> active;
    for (int round = 0; round < 1000; round++)
    {
        Eigen::Index next;
        const Eigen::VectorXd slope = A.transpose() * (b - A * solution);
        if (slope.maxCoeff(&next) < 1e-12) break;
        active.push_back(next);
        while (!active.empty())
        {
            Eigen::MatrixXd part(A.rows(), static_cast<Eigen::Index>(active.size()));
            for (size_t i = 0; i < active.size(); i++) part.col(static_cast<int>(i)) = A.col(active[i]);
            const Eigen::VectorXd wanted = part.colPivHouseholderQr().solve(b);
            double step = 1;
            for (size_t i = 0; i < active.size(); i++)
                if (const double now = solution(active[i]), then = wanted(static_cast<int>(i)); then <= 0)
                    step = std::min(step, now / (now - then));
            for (size_t i = 0; i < active.size(); i++)
                solution(active[i]) += step * (wanted(static_cast<int>(i)) - solution(active[i]));
            if (step == 1) break;
            const auto at_zero = [&](Eigen::Index i)
            {
                if (solution(i) > 1e-14) return false;
                solution(i) = 0;
                return true;
            };
            active.erase(std::remove_if(active.begin(), active.end(), at_zero), active.end());
        }
    }
    return solution;
}

/** Points on planes whose cost is constant |q|^4 + w^4 + xxyy + yyzz + zzxx - 4 wxyz. Each is there twice,
 * the second time with point and plane mirrored, so that the translation is zero for every rotation.
 */
Rows choi_lam_rows(SeededRandom& random)
{
    const auto& [w, x, y, z, norm_sq] = symbolic_quaternion();
    const Polynomial form = w * w * w * w + x * x * y * y + y * y * z * z + z * z * x * x -
                            4.0 * (w * x * y * z) + 2.0 * (norm_sq * norm_sq);
    constexpr int CANDIDATES = 600;
    std::vector<std::array<Vector3d, 2>> normal_and_point;
    std::vector<double> offset;
    std::map<Polynomial::Exponents, int> row_of;
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(35, CANDIDATES);
    Eigen::VectorXd b = Eigen::VectorXd::Zero(35);
    const auto row = [&](const Polynomial::Exponents& e)
    { return row_of.emplace(e, static_cast<int>(row_of.size())).first->second; };
    const auto turn = rotation_polynomials();
    for (int k = 0; k < CANDIDATES; k++)
    {
        const Vector3d n = random_direction(random), p = gaussian_vector(random);
        const double c = random.gaussian();
        Polynomial residual = -c * norm_sq;
        for (int column = 0; column < 3; column++)
            for (int i = 0; i < 3; i++)
                residual = residual + n(i) * p(column) * turn[static_cast<size_t>(3 * column + i)];
        residual = residual * residual;
        for (const auto& [e, value] : residual.terms()) A(row(e), k) = value;
        normal_and_point.push_back({n, p}), offset.push_back(c);
    }
    for (const auto& [e, value] : form.terms()) b(row(e)) = value;
    const Eigen::VectorXd weights = nonnegative_least_squares(A, b);
    EXPECT_LT((A * weights - b).norm(), 1e-12) << "the form is not a sum of such rows";
    Rows rows;
    for (int k = 0; k < CANDIDATES; k++)
        if (weights(k) > 0)
            for (const double side : {1., -1.})
                rows.add(weights(k) / 2, normal_and_point[static_cast<size_t>(k)][0],
                         side * normal_and_point[static_cast<size_t>(k)][1],
                         side * offset[static_cast<size_t>(k)]);
    return rows;
}

void expect_not_provable(const Rows& rows, SeededRandom& random)
{
    const Matrix10 Q = rows.Q();
    const auto f = rows.rotation_quadratic();
    const auto minima = all_minima(f, Matrix3d::Identity());
    ASSERT_LT(minima.front().cost, lowest_by_descents(f, 500, random) + rounding_of(Q));
    for (const auto& minimum : minima)
    {
        const auto proof = certify_rotation(Q, minimum.R);
        EXPECT_FALSE(proof.holds);
        EXPECT_GT(proof.gap, 0.1 * proof.scale);  // the relaxation's own gap here; the true one is zero
        EXPECT_LT(proof.gap, proof.scale);
        EXPECT_TRUE(proof.better_start);
    }
}
}  // namespace

// ---- The identity that the proof rests on -----------------------------------------------------------------

TEST(RotationCertificate, GIsTheCostAsAFormInTheTurn)
{
    // Coefficient by coefficient, at minima and at any other rotation, for closed forms and after barrier
    // steps: these add multiples of the fourteen matrices that must leave the form as it is.
    SeededRandom random(1);
    size_t checked = 0, by_barrier = 0;
    for (size_t round = 0; round < repetitions(1, 10); round++)
        for (const auto& mix : all_mixes())
            for (const bool at_minimum : {true, false})
            {
                SCOPED_TRACE(mix.name + (at_minimum ? ", minimum" : ", anywhere"));
                const Rows rows = random_rows(mix, mix.minimal + 1, 0.1, random);
                const Matrix10 Q = rows.Q();
                const auto f = rows.rotation_quadratic();
                const Matrix3d start = any_rotation(random);
                const Matrix3d R = at_minimum ? minimise_rotation(f, start).R : start;
                const auto proof = certify_rotation(Q, R);
                const auto& [w, x, y, z, norm_sq] = symbolic_quaternion();
                const Vector3d g = R.transpose() * f.derivatives(R).gradient;
                const Polynomial error = cost_polynomial(Q, R) - proof.cost * (norm_sq * norm_sq) -
                                         proof.scale * gram_polynomial(proof.G) -
                                         2.0 * (w * w * w * (g(0) * x + g(1) * y + g(2) * z));
                EXPECT_LT(error.largest(), 10 * rounding_of(Q));
                EXPECT_NEAR(proof.slope * proof.scale, g.norm(), 10 * rounding_of(Q));
                EXPECT_GT(gram_polynomial(proof.G).largest(), 0.01);
                checked++, by_barrier += proof.barrier_steps > 1;
            }
    EXPECT_GT(by_barrier, checked / 4);
}

TEST(RotationCertificate, TheHessianIsPartOfGAndTheMarginBoundsTheGrowthOfTheCost)
{
    size_t unique = 0;
    SeededRandom random(3);
    for_random_rows(1, 2,
                    [&](const Rows& rows)
                    {
                        const auto f = rows.rotation_quadratic();
                        const Matrix3d R = all_minima(f, Matrix3d::Identity()).front().R;
                        const auto proof = certify_rotation(rows.Q(), R);
                        const Matrix3d H = R.transpose() * f.derivatives(R).hessian * R;
                        const double eps = rounding_of(rows.Q());
                        EXPECT_LT((proof.scale * proof.G.topLeftCorner<3, 3>() - H).norm(), 10 * eps);
                        if (!(proof.margin() > 0)) return;
                        unique++;
                        for (int k = 0; k < 20; k++)
                        {
                            const Matrix3d other = any_rotation(random);
                            const double half =
                                0.5 * Eigen::AngleAxisd(Matrix3d(R.transpose() * other)).angle();
                            const double growth = 1 - std::pow(std::cos(half), 4);
                            EXPECT_GT(f.cost(other) - proof.cost,
                                      proof.scale * (proof.margin() * growth - proof.slope) - eps);
                        }
                    });
    EXPECT_GT(unique, 100u);
}

// ---- What must be certified -------------------------------------------------------------------------------

TEST(RotationCertificate, ProvesTheLowestMinimumOfRandomPairingsAndNoOther)
{
    size_t lowest = 0, certified = 0, others = 0, led_down = 0, attained = 0;
    SeededRandom random(11);
    for_random_rows(
        repetitions(2, 50), 10,
        [&](const Rows& rows)
        {
            const Matrix10 Q = rows.Q();
            const auto f = rows.rotation_quadratic();
            auto minima = all_minima(f, Matrix3d::Identity());
            auto proof = certify_rotation(Q, minima.front().R);
            if (!proof.holds && proof.better_start)
                if (const auto better = minimise_rotation(f, *proof.better_start);
                    better.cost < proof.cost - TOLERANCE * proof.scale)
                {
                    // The search had missed it.
                    minima.insert(minima.begin(), better);
                    proof = certify_rotation(Q, better.R);
                }
            lowest++, certified += proof.holds;
            EXPECT_LT(proof.cost - lowest_by_descents(f, 3, random), proof.gap + rounding_of(Q));
            EXPECT_EQ(proof.holds, proof.gap <= TOLERANCE * proof.scale);
            for (const auto& other : minima)
            {
                const double excess = other.cost - minima.front().cost;
                if (!(excess > 10 * TOLERANCE * proof.scale)) continue;
                const auto refusal = certify_rotation(Q, other.R);
                others++;
                EXPECT_FALSE(refusal.holds);
                EXPECT_GT(refusal.gap, excess - rounding_of(Q));
                ASSERT_TRUE(refusal.better_start);
                EXPECT_LT(
                    (*refusal.better_start * refusal.better_start->transpose() - Matrix3d::Identity()).norm(),
                    1e-14);
                // The bound is the least of (f - f(R0)) / (1 - cos(theta/2)^4), and it is attained there.
                const double angle =
                    Eigen::AngleAxisd(Matrix3d(other.R.transpose() * *refusal.better_start)).angle();
                attained +=
                    (other.cost - f.cost(*refusal.better_start)) / (1 - std::pow(std::cos(angle / 2), 4)) >
                    0.95 * refusal.gap;
                const auto better = minimise_rotation(f, *refusal.better_start);
                led_down += better.cost < minima.front().cost + TOLERANCE * proof.scale;
            }
        });
    EXPECT_GE(fraction(certified, lowest), 0.999) << certified << " of " << lowest;
    EXPECT_GT(others, lowest / 2);
    EXPECT_GE(fraction(led_down, others), 0.97) << led_down << " of " << others;
    EXPECT_GE(fraction(attained, others), 0.9) << attained << " of " << others;
}

TEST(RotationCertificate, LeadsToAGlobalMinimumThatOneDescentMisses)
{
    // From any start: a descent, a refusal, a descent from where it points, and so on.
    SeededRandom random(13);
    size_t total = 0, first = 0, last = 0;
    for_random_rows(repetitions(1, 20), 12,
                    [&](const Rows& rows)
                    {
                        const Matrix10 Q = rows.Q();
                        const auto f = rows.rotation_quadratic();
                        Matrix3d R = minimise_rotation(f, any_rotation(random)).R;
                        auto proof = certify_rotation(Q, R);
                        total++, first += proof.holds;
                        for (int k = 0; k < 3 && proof.better_start; k++)
                            proof = certify_rotation(Q, minimise_rotation(f, *proof.better_start).R);
                        last += proof.holds;
                    });
    EXPECT_LT(fraction(first, total), 0.9);
    EXPECT_GE(fraction(last, total), 0.99) << last << " of " << total << ", " << first << " at once";
}

// ---- What must not ----------------------------------------------------------------------------------------

TEST(RotationCertificate, NoMemberOfTheFamilyProvesNoticeablyMoreThanARefusalSays)
{
    // A random walk uphill among all matrices that are the same form. A direction that the search had left
    // out would be a way up.
    const auto basis = zero_forms();
    ASSERT_EQ(basis.size(), 14u);
    SeededRandom random(20);
    size_t refusals = 0;
    for (int round = 0; round < 12; round++)
    {
        SCOPED_TRACE(round);
        const Rows rows = random_rows(all_mixes()[static_cast<size_t>(round)], 5, 0.3, random);
        const auto proof = certify_rotation(rows.Q(), any_rotation(random));
        if (!proof.better_start) continue;
        Matrix9 G = proof.G;
        double least = proof.margin(), step = 0.1 * std::abs(least);
        for (int k = 0; k < 2000; k++)
        {
            Matrix9 next = G;
            for (const auto& form : basis) next += step * random.gaussian() * form;
            if (const double there = least_eigenvalue(next); there > least)
                G = next, least = there, step *= 1.5;
            else
                step *= 0.97;
        }
        EXPECT_LT(least, 0.97 * proof.margin());
        EXPECT_LT(proof.margin(), 0);
        refusals++;
    }
    EXPECT_GT(refusals, 8u);
}

TEST(RotationCertificate, RefusesAMinimumThatIsGlobalButNotProvable)
{
    for (const uint64_t seed : {30, 31})
    {
        SCOPED_TRACE(seed);
        SeededRandom random(seed);
        expect_not_provable(choi_lam_rows(random), random);
    }
}

TEST(RotationCertificate, RefusesTheUnprovableSetOfTheSharedData)
{
    std::ifstream file(std::string(MP2P_ICP_SHARED_DATA) + "/solver/choilam_pairs.txt");
    if (!file) GTEST_SKIP() << "no shared data";
    Rows rows;
    size_t count = 0;
    for (std::string text; std::getline(file, text);)
    {
        if (text.empty() || text[0] == '#') continue;
        std::istringstream in(text);
        Vector3d p, q, n;
        double weight = NaN;
        in >> p(0) >> p(1) >> p(2) >> q(0) >> q(1) >> q(2) >> n(0) >> n(1) >> n(2) >> weight;
        ASSERT_TRUE(in) << text;
        rows.add_along(weight, n, p, q);
        count++;
    }
    ASSERT_EQ(count, 68u);
    SeededRandom random(32);
    expect_not_provable(rows, random);
}

TEST(RotationCertificate, TellsNearlyEqualMinimaApart)
{
    // Three orthogonal directions without sign have four equal minima; a hint of a fourth one with a sign
    // makes one of them the lowest.
    SeededRandom random(35);
    size_t above_tolerance = 0, held = 0;
    for (double hint = 1e-3; hint > 1e-12; hint *= 0.2)
        for (const double noise : {0.0, 1e-3, 0.1})
        {
            SCOPED_TRACE(std::to_string(std::log10(hint)) + ", noise " + std::to_string(noise));
            Rows rows;
            for (int i = 0; i < 3; i++)
                rows.add_across(1, Vector3d::Unit(i),
                                (Vector3d::Unit(i) + noise * gaussian_vector(random)).normalized(),
                                Vector3d::Zero(), Rows::Of::Directions);
            const Vector3d u = random_direction(random);
            rows.add_all(hint, u, u, Rows::Of::Directions);
            const auto f = rows.rotation_quadratic();
            const auto minima = all_minima(f, Matrix3d::Identity());
            ASSERT_GE(minima.size(), 4u);
            EXPECT_TRUE(certify_rotation(rows.Q(), minima[0].R).holds);
            for (const auto& other : minima)
            {
                const auto proof = certify_rotation(rows.Q(), other.R);
                const double excess = other.cost - minima[0].cost;
                EXPECT_GT(proof.gap, excess - rounding_of(rows.Q()));
                EXPECT_FALSE(proof.holds && excess > TOLERANCE * proof.scale);
                above_tolerance += excess > TOLERANCE * proof.scale;
                held += proof.holds;
            }
        }
    EXPECT_GT(above_tolerance, 50u);
    EXPECT_GT(held, 50u);
}

TEST(RotationCertificate, RefusesAPoseThatHasNotComeToRest)
{
    SeededRandom random(40);
    const Rows rows = random_rows(all_mixes().back(), 30, 0.05, random);
    const auto f = rows.rotation_quadratic();
    const Matrix3d R = all_minima(f, Matrix3d::Identity()).front().R;
    ASSERT_TRUE(certify_rotation(rows.Q(), R).holds);
    for (const double angle : {1e-3, 1e-5, 1e-7, 1e-8})
    {
        SCOPED_TRACE(angle);
        const auto proof = certify_rotation(rows.Q(), rotation_about(random_direction(random), angle) * R);
        EXPECT_FALSE(proof.holds);
        EXPECT_GT(proof.gap, proof.cost - f.cost(R) - rounding_of(rows.Q()));
        EXPECT_LT(proof.gap, 20 * angle * proof.scale);
    }
    // Where the slope is some 1e-11 of the scale the bound is below the tolerance.
    EXPECT_TRUE(certify_rotation(rows.Q(), rotation_about({1, 2, 3}, 1e-11) * R).holds);
}

TEST(RotationCertificate, RefusesAPoseThatWasLeftInAValley)
{
    // Points in a tube around a line: a turn about the line costs next to nothing, but more than is
    // certified. G alone is positive here (the cost is that of Wahba's problem, of which every such pose is
    // nearly the minimum); only the slope tells.
    SeededRandom random(41);
    Rows rows;
    for (int i = 0; i < 20; i++)
    {
        const Vector3d p(random.uniform(-1, 1), 1e-3 * random.gaussian(), 1e-3 * random.gaussian());
        rows.add_all(1, p, p + 1e-4 * gaussian_vector(random));
    }
    const auto f = rows.rotation_quadratic();
    const Matrix3d R = all_minima(f, Matrix3d::Identity()).front().R;
    ASSERT_TRUE(certify_rotation(rows.Q(), R).holds);
    size_t passed_without_slope = 0;
    for (const double angle : {0.3, 0.1, 0.03})
    {
        SCOPED_TRACE(angle);
        const auto proof = certify_rotation(rows.Q(), rotation_about(Vector3d::UnitX(), angle) * R);
        const double excess = proof.cost - f.cost(R);
        ASSERT_GT(excess, 0.1 * TOLERANCE * proof.scale);
        EXPECT_FALSE(proof.holds);
        EXPECT_GT(proof.gap, excess);
        passed_without_slope += proof.margin() > -0.1 * TOLERANCE;
    }
    EXPECT_GT(passed_without_slope, 0u) << "the valley is no test of the slope";
}

// ---- Sets with less than one clear minimum ----------------------------------------------------------------

namespace
{
struct DegenerateSet
{
    std::string name;
    /// Adds the pairings, local points moved by `noise`.
    void (*make)(double noise, SeededRandom& random, Rows& rows);
};
/// In the frame of the set; `around` adds noise.
Vector3d around(const Vector3d& p, double noise, SeededRandom& random)
{
    return p + noise * gaussian_vector(random);
}
void add_plane(const Vector3d& n, const Vector3d& q, size_t count, double noise, SeededRandom& random,
               Rows& rows)
{
    for (size_t i = 0; i < count; i++)
        rows.add_along(1, n, around(q + n.cross(gaussian_vector(random)), noise, random), q);
}
void add_direction(const Vector3d& u, double noise, SeededRandom& random, Rows& rows)
{
    rows.add_across(1, u, around(u, noise, random).normalized(), Vector3d::Zero(), Rows::Of::Directions);
}
void add_line(const Vector3d& u, const Vector3d& q, double noise, SeededRandom& random, Rows& rows)
{
    rows.add_across(1, u, around(q + random.gaussian() * u, noise, random), q);
    add_direction(u, noise, random, rows);
}

const std::vector<DegenerateSet>& degenerate_sets()
{
    static const Vector3d e0 = Vector3d::UnitX(), e1 = Vector3d::UnitY(), e2 = Vector3d::UnitZ();
    static const std::vector<DegenerateSet> all = {
        {"two points", [](double noise, SeededRandom& r, Rows& rows)
         { rows.add_all(1, around(e0, noise, r), e0), rows.add_all(2, around(-e1, noise, r), -e1); }},
        {"points on a line",
         [](double noise, SeededRandom& r, Rows& rows)
         {
             for (int i = 0; i < 10; i++) rows.add_all(1, around(0.2 * i * e0, noise, r), 0.2 * i * e0 + e1);
         }},
        {"points near a line",
         [](double noise, SeededRandom& r, Rows& rows)
         {
             for (int i = 0; i < 10; i++)
             {
                 const Vector3d p = 0.2 * i * e0 + 1e-3 * gaussian_vector(r);
                 rows.add_all(1, around(p, 1e-3 * noise, r), p);
             }
         }},
        {"points in a plane",
         [](double noise, SeededRandom& r, Rows& rows)
         {
             for (int i = 0; i < 10; i++)
             {
                 const Vector3d p(r.gaussian(), r.gaussian(), 0);
                 rows.add_all(1, around(p, noise, r), p);
             }
         }},
        {"one plane",
         [](double noise, SeededRandom& r, Rows& rows) { add_plane(e2, 2 * e2, 20, noise, r, rows); }},
        {"two planes", [](double noise, SeededRandom& r, Rows& rows)
         { add_plane(e2, 2 * e2, 10, noise, r, rows), add_plane(e0, e0, 10, noise, r, rows); }},
        {"three orthogonal planes",
         [](double noise, SeededRandom& r, Rows& rows)
         {
             for (const auto& n : {e0, e1, e2}) add_plane(n, n, 10, noise, r, rows);
         }},
        {"parallel planes",
         [](double noise, SeededRandom& r, Rows& rows)
         {
             for (int i = 0; i < 5; i++) add_plane(e2, i * e2, 3, noise, r, rows);
         }},
        {"a corridor",
         [](double noise, SeededRandom& r, Rows& rows)
         {
             for (const auto& n : {e1, Vector3d(-e1), e2, Vector3d(-e2)}) add_plane(n, n, 10, noise, r, rows);
         }},
        {"three orthogonal directions without sign",
         [](double noise, SeededRandom& r, Rows& rows)
         {
             for (const auto& u : {e0, e1, e2}) add_direction(u, noise, r, rows);
         }},
        {"one direction",
         [](double noise, SeededRandom& r, Rows& rows) { add_direction(e0, noise, r, rows); }},
        {"two skew lines", [](double noise, SeededRandom& r, Rows& rows)
         { add_line(e0, e2, noise, r, rows), add_line((e0 + 2 * e1).normalized(), -e2, noise, r, rows); }},
        {"two orthogonal lines", [](double noise, SeededRandom& r, Rows& rows)
         { add_line(e0, e2, noise, r, rows), add_line(e1, -e2, noise, r, rows); }},
        {"parallel lines",
         [](double noise, SeededRandom& r, Rows& rows)
         {
             for (int i = 0; i < 5; i++)
                 add_line(e0, Vector3d(0, r.gaussian(), r.gaussian()), noise, r, rows);
         }},
        {"a sphere",
         [](double noise, SeededRandom& r, Rows& rows)
         {
             for (int i = 0; i < 30; i++)
             {
                 const Vector3d n = random_direction(r);
                 rows.add_along(1, n, around(n, noise, r), n);
             }
         }},
        {"a cylinder",
         [](double noise, SeededRandom& r, Rows& rows)
         {
             for (int i = 0; i < 30; i++)
             {
                 const double angle = r.uniform(0, 2 * M_PI);
                 const Vector3d n(std::cos(angle), std::sin(angle), 0), q = n + r.gaussian() * e2;
                 rows.add_along(1, n, around(q, noise, r), q);
             }
         }},
        {"the middles of a cube's faces",
         [](double noise, SeededRandom& r, Rows& rows)
         {
             for (const auto& n : {e0, e1, e2})
                 for (const double side : {1., -1.})
                     rows.add_along(1, n, around(side * n, noise, r), side * n);
         }},
        {"wrong points on planes",
         [](double, SeededRandom& r, Rows& rows)
         {
             for (int i = 0; i < 12; i++)
                 rows.add_along(1, random_direction(r), gaussian_vector(r), gaussian_vector(r));
         }},
        {"wrong directions without sign",
         [](double, SeededRandom& r, Rows& rows)
         {
             for (int i = 0; i < 10; i++)
                 rows.add_across(1, random_direction(r), random_direction(r), Vector3d::Zero(),
                                 Rows::Of::Directions);
         }},
    };
    return all;
}
}  // namespace

TEST(RotationCertificate, ProvesTheCostOfDegenerateSetsAndNeverTooMuch)
{
    SeededRandom random(50);
    size_t total = 0, certified = 0;
    for (size_t round = 0; round < repetitions(2, 30); round++)
        for (const auto& set : degenerate_sets())
            for (const double noise : {0.0, 1e-6, 1e-2, 1e-1})
            {
                SCOPED_TRACE(set.name + ", noise " + std::to_string(noise) + ", round " +
                             std::to_string(round));
                Rows rows;
                set.make(noise, random, rows);
                const Matrix10 Q = rows.Q();
                const auto f = rows.rotation_quadratic();
                const auto minima = all_minima(f, Matrix3d::Identity());
                const double lowest = std::min(minima.front().cost, lowest_by_descents(f, 5, random));
                for (const auto& minimum : minima)
                {
                    const auto proof = certify_rotation(Q, minimum.R);
                    EXPECT_LT(minimum.cost - lowest, proof.gap + rounding_of(Q));
                    if (&minimum == &minima.front()) total++, certified += proof.holds;
                }
                const auto anywhere = certify_rotation(Q, any_rotation(random));
                EXPECT_LT(anywhere.cost - lowest, anywhere.gap + rounding_of(Q));
            }
    EXPECT_GE(fraction(certified, total), 0.99) << certified << " of " << total;
}

TEST(RotationCertificate, SaysNothingWhereTheCostDoesNotDependOnTheRotation)
{
    for (const Matrix10& Q : {Matrix10(Matrix10::Zero()), Matrix10(Vector10::Unit(9).asDiagonal()),
                              Matrix10(Matrix10::Identity())})
    {
        const auto proof = certify_rotation(Q, rotation_about({1, 2, 3}, 1));
        EXPECT_FALSE(proof.holds);
        EXPECT_GE(proof.gap, 0);
    }
}

TEST(RotationCertificate, SpreadWeightsDoNotMislead)
{
    SeededRandom random(60);
    size_t total = 0, certified = 0;
    for (const double weight : {1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e9})
        for (size_t round = 0; round < repetitions(5, 100); round++)
        {
            SCOPED_TRACE(std::to_string(weight) + ", round " + std::to_string(round));
            Rows rows;
            const Matrix3d R = any_rotation(random);
            for (int i = 0; i < 6; i++) add_pairing(Kind::Plane, R, Vector3d::Zero(), 0.05, random, rows);
            for (int i = 0; i < 3; i++)
            {
                const Vector3d u = random_direction(random);
                const Vector3d local = (R.transpose() * u + 0.05 * gaussian_vector(random)).normalized();
                rows.add_across(weight, u, local, Vector3d::Zero(), Rows::Of::Directions);
            }
            const auto f = rows.rotation_quadratic();
            const auto proof = certify_rotation(rows.Q(), all_minima(f, Matrix3d::Identity()).front().R);
            total++, certified += proof.holds;
            EXPECT_LT(proof.cost - lowest_by_descents(f, 10, random), proof.gap + rounding_of(rows.Q()));
        }
    EXPECT_GE(fraction(certified, total), 0.98) << certified << " of " << total;
}

TEST(RotationCertificate, IsRightForQuadraticsThatAreNoSumsOfSquares)
{
    // Not those of pairings: nothing may rest on f >= 0 then.
    SeededRandom random(70);
    size_t total = 0, certified = 0;
    for (size_t round = 0; round < repetitions(100, 2000); round++)
    {
        SCOPED_TRACE(round);
        Matrix10 Q = Matrix10::Zero();
        const size_t rank = 1 + random.index(10);
        for (size_t i = 0; i < rank; i++)
        {
            Vector10 row;
            for (int k = 0; k < 10; k++) row(k) = random.gaussian();
            Q += (round % 2 ? 1 : random.gaussian()) * row * row.transpose();
        }
        if (round % 4 == 0)  // a lowest cost of about zero, by accident
            Q(9, 9) -= all_minima(rotation_quadratic(Q), Matrix3d::Identity()).front().cost;
        const auto f = rotation_quadratic(Q);
        const auto minima = all_minima(f, Matrix3d::Identity());
        const double lowest = lowest_by_descents(f, 10, random);
        for (const auto& minimum : minima)
        {
            const auto proof = certify_rotation(Q, minimum.R);
            EXPECT_LT(minimum.cost - lowest, proof.gap + rounding_of(Q));
            EXPECT_EQ(proof.holds, proof.gap <= TOLERANCE * proof.scale);
            if (&minimum == &minima.front()) total++, certified += proof.holds;
        }
    }
    EXPECT_GE(fraction(certified, total), 0.97) << certified << " of " << total;
}

// ---- Scale and bad input ----------------------------------------------------------------------------------

TEST(RotationCertificate, DoesNotDependOnTheUnitOfTheCost)
{
    SeededRandom random(80);
    for (const auto& mix : all_mixes())
        for (const size_t more : {0, 1, 5})
        {
            SCOPED_TRACE(mix.name + ", " + std::to_string(mix.minimal + more));
            const Rows rows = random_rows(mix, mix.minimal + more, 0.1, random);
            const Matrix10 Q = rows.Q();
            for (const auto& minimum : all_minima(rows.rotation_quadratic(), Matrix3d::Identity()))
            {
                const auto proof = certify_rotation(Q, minimum.R);
                for (const int power : {-40, 1, 40})  // of two: the same bits, about 1e-12 and 1e12
                {
                    const double unit = std::ldexp(1.0, power);
                    const auto scaled = certify_rotation(unit * Q, minimum.R);
                    EXPECT_EQ(scaled.holds, proof.holds);
                    EXPECT_EQ(scaled.gap, unit * proof.gap);
                    EXPECT_EQ(scaled.G, proof.G);
                }
                for (const double unit : {1e-12, 1e-6, 1e6, 1e12})
                    EXPECT_EQ(certify_rotation(unit * Q, minimum.R).holds, proof.holds) << unit;
            }
        }
}

TEST(RotationCertificate, HoldsForNothingThatIsNotFiniteOrNoRotation)
{
    SeededRandom random(90);
    const Rows rows = random_rows(all_mixes()[0], 10, 0.01, random);
    const Matrix10 Q = rows.Q();
    const Matrix3d R = all_minima(rows.rotation_quadratic(), Matrix3d::Identity()).front().R;
    ASSERT_TRUE(certify_rotation(Q, R).holds);
    const auto expect_nothing = [](const RotationCertificate& proof)
    {
        EXPECT_FALSE(proof.holds);
        EXPECT_TRUE(std::isinf(proof.gap));
        EXPECT_FALSE(proof.better_start);
    };
    for (const double bad : {NaN, INF, -INF})
    {
        for (int i = 0; i < 10; i++)
        {
            Matrix10 broken = Q;
            broken(i, 9) = broken(9, i) = bad;
            expect_nothing(certify_rotation(broken, R));
        }
        Matrix3d broken = R;
        broken(1, 2) = bad;
        expect_nothing(certify_rotation(Q, broken));
        expect_nothing(certify_rotation(Q, R, {bad}));
    }
    expect_nothing(certify_rotation(Q, R, {-1e-9}));
    expect_nothing(certify_rotation(Q, Matrix3d(-R)));
    expect_nothing(certify_rotation(Q, Matrix3d(1.01 * R)));
    expect_nothing(certify_rotation(Q, Matrix3d::Zero()));
    expect_nothing(certify_rotation(1e300 * Q, R));  // its squares overflow
    // No tolerance at all is more than arithmetic can keep, but the bound stands.
    const auto strict = certify_rotation(Q, R, {0});
    EXPECT_FALSE(strict.holds);
    EXPECT_LT(strict.gap, 1e-11 * strict.scale);
    EXPECT_GT(strict.gap, rounding_of(Q));
}
