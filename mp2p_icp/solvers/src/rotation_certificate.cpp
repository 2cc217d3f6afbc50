#include "rotation_certificate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

namespace mp2p_icp
{
namespace
{
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Matrix9 = Eigen::Matrix<double, 9, 9>;
using Vector9 = Eigen::Matrix<double, 9, 1>;
using Matrix10 = Eigen::Matrix<double, 10, 10>;
using Vector10 = Eigen::Matrix<double, 10, 1>;

constexpr int CLASSES = 35;  // monomials of degree four in four variables
constexpr int FREE = 14;     // dimensions of the family
const double SQRT2 = std::sqrt(2.0);

/// 2 max of w^3 sqrt(1 - w^2): what a unit of the gradient may take off f.
const double SLOPE_FACTOR = 2 * 3 * std::sqrt(3.0) / 16;

/// h (e_i e_j' + e_j e_i'), indices 0..8.
struct Entry
{
    int i, j;
    double h;
};
/// A symmetric matrix with z' A z = 0 for all q, of Frobenius norm 1.
using Direction = std::array<Entry, 2>;

/// All that depends on the monomials (ww wx wy wz xx yy zz xy xz yz) alone.
struct MonomialTables
{
    Eigen::Matrix<int, 10, 10> class_of;  ///< which quartic monomial a product of two is
    Matrix10 dd;     ///< D D': D_i = 1 for squares, sqrt 2 for mixed products, so that |D m| = |q|^2
    Matrix10 share;  ///< of a class sum, what G of least norm has at (i, j); without ww
    std::array<Direction, FREE> basis;

    MonomialTables();
};

MonomialTables::MonomialTables()
{
    static constexpr int factors[10][2] = {{0, 0}, {0, 1}, {0, 2}, {0, 3}, {1, 1},
                                           {2, 2}, {3, 3}, {1, 2}, {1, 3}, {2, 3}};
    static constexpr int power[4] = {1, 5, 25, 125};  // exponents as digits to the base 5
    const auto code = [](int i) { return power[factors[i][0]] + power[factors[i][1]]; };
    const auto squared_norm = [](int i) { return factors[i][0] == factors[i][1] ? 1.0 : 2.0; };

    std::map<int, int> number;                                // of a class, by its exponents
    std::map<int, double> weight;                             // by class
    std::map<int, std::vector<std::pair<int, int>>> members;  // by class, i <= j
    for (int i = 0; i < 10; i++)
        for (int j = 0; j < 10; j++)
        {
            const int k = number.emplace(code(i) + code(j), static_cast<int>(number.size())).first->second;
            class_of(i, j) = k;
            dd(i, j) = std::sqrt(squared_norm(i) * squared_norm(j));
            if (i == 0 || j == 0) continue;
            weight[k] += squared_norm(i) * squared_norm(j);
            if (i <= j) members[k].emplace_back(i, j);
        }
    share.setZero();
    for (int i = 1; i < 10; i++)
        for (int j = 1; j < 10; j++) share(i, j) = dd(i, j) / weight[class_of(i, j)];

    size_t count = 0;
    const auto entry = [this](const std::pair<int, int>& at, double sign) {
        return Entry{at.first - 1, at.second - 1, sign * 0.5 / dd(at.first, at.second)};
    };
    for (const auto& [k, same] : members)
        for (size_t m = 1; m < same.size(); m++)
        {
            Direction a = {entry(same[0], -1), entry(same[m], 1)};
            double norm_sq = 0;
            for (const auto& e : a) norm_sq += e.h * e.h * (e.i == e.j ? 4 : 2);
            for (auto& e : a) e.h /= std::sqrt(norm_sq);
            basis.at(count++) = a;
        }
}

const MonomialTables& tables()
{
    static const MonomialTables all;
    return all;
}

/// Q in the frame where the pose is the identity, and its cost zero.
Matrix10 seen_from(const Matrix10& Q, const Matrix3d& R, double cost)
{
    Matrix10 out;
    for (int j = 0; j < 3; j++)
    {
        for (int l = 0; l <= j; l++)
        {
            const Matrix3d block = R.transpose() * Q.block<3, 3>(3 * j, 3 * l) * R;
            out.block<3, 3>(3 * j, 3 * l) = block;
            out.block<3, 3>(3 * l, 3 * j) = block.transpose();
        }
        const Vector3d border = R.transpose() * Q.block<3, 1>(3 * j, 9);
        out.block<3, 1>(3 * j, 9) = border, out.block<1, 3>(9, 3 * j) = border.transpose();
    }
    out(9, 9) = Q(9, 9) - cost;
    return out;
}

/// M A, where x = A m: the columns of R(q) and 1 = |q|^2 by the monomials m.
Matrix10 times_A(const Matrix10& M)
{
    Matrix10 out;
    out.col(0) = M.col(0) + M.col(4) + M.col(8) + M.col(9);
    out.col(1) = 2 * (M.col(5) - M.col(7));
    out.col(2) = 2 * (M.col(6) - M.col(2));
    out.col(3) = 2 * (M.col(1) - M.col(3));
    out.col(4) = M.col(0) - M.col(4) - M.col(8) + M.col(9);
    out.col(5) = -M.col(0) + M.col(4) - M.col(8) + M.col(9);
    out.col(6) = -M.col(0) - M.col(4) + M.col(8) + M.col(9);
    out.col(7) = 2 * (M.col(1) + M.col(3));
    out.col(8) = 2 * (M.col(2) + M.col(6));
    out.col(9) = 2 * (M.col(5) + M.col(7));
    return out;
}

/// Two members of the family.
struct ClosedForms
{
    Matrix9 nearest;  ///< to the Gram matrix of Q: for minimal sets and exact data
    Matrix9 least;    ///< of least Frobenius norm
};

/// `gram` is that of f in m; classes get their sums without its first row and column.
ClosedForms closed_forms(const Matrix10& gram, double scale)
{
    const MonomialTables& t = tables();
    using ClassSums = Eigen::Matrix<double, CLASSES, 1>;
    ClassSums all = ClassSums::Zero(), inner = ClassSums::Zero();  // over i, j >= 0 and i, j >= 1
    for (int j = 0; j < 10; j++)
        for (int i = 0; i <= j; i++)
        {
            const double value = (i == j ? 1 : 2) * gram(i, j);
            all(t.class_of(i, j)) += value;
            if (i > 0) inner(t.class_of(i, j)) += value;
        }
    ClosedForms out;
    const double factor = 1 / scale;
    for (int j = 1; j < 10; j++)
        for (int i = 1; i <= j; i++)
        {
            const int k = t.class_of(i, j);
            const double share = factor * t.share(i, j);
            out.least(i - 1, j - 1) = out.least(j - 1, i - 1) = all(k) * share;
            out.nearest(i - 1, j - 1) = out.nearest(j - 1, i - 1) =
                factor * gram(i, j) / t.dd(i, j) + (all(k) - inner(k)) * share;
        }
    return out;
}

template <class Real>
bool positive(const Eigen::Matrix<Real, 9, 9>& M, Real shift)
{
    using Matrix = Eigen::Matrix<Real, 9, 9>;
    return Eigen::LLT<Matrix>(M + shift * Matrix::Identity()).info() == Eigen::Success;
}

double least_eigenvalue(const Matrix9& M)
{
    return Eigen::SelfAdjointEigenSolver<Matrix9>(M, Eigen::EigenvaluesOnly).eigenvalues()(0);
}

/// <A, M>, M symmetric.
template <class Real>
Real product(const Direction& A, const Eigen::Matrix<Real, 9, 9>& M)
{
    return 2 * (A[0].h * M(A[0].i, A[0].j) + A[1].h * M(A[1].i, A[1].j));
}

/// tr(W A W B).
template <class Real>
Real product(const Direction& A, const Direction& B, const Eigen::Matrix<Real, 9, 9>& W)
{
    Real sum = 0;
    for (const auto& a : A)
        for (const auto& b : B)
            sum += 2 * a.h * b.h * (W(b.i, a.i) * W(a.j, b.j) + W(b.i, a.j) * W(a.i, b.j));
    return sum;
}

/** Maximises s subject to G - s I >= 0 over the family, by Newton steps on -t s - log det(G - s I) with a
 * growing t, until G - wanted I is positive or the dual shows that no member's is.
 */
template <class Real>
class BarrierSearch
{
    using Matrix = Eigen::Matrix<Real, 9, 9>;

 public:
    BarrierSearch(const Matrix9& start, double least_eigenvalue, double wanted)
        : start_(start.cast<Real>()), least_(least_eigenvalue), wanted_(wanted), G_(start_)
    {
    }

    /// `exactness`: how near to the best to come, relative, before giving up; 0: not at all.
    bool run(double exactness);
    Matrix9 best() const { return best_.template cast<double>(); }
    int steps() const { return steps_; }
    /// Has it ended without a member and without the dual's word that there is none?
    bool stalled() const { return !(bound_ < wanted_); }
    /// The multiplier Z of the bound: positive semidefinite, of unit trace, <Z, A> = 0 for the free A. For a
    /// pose above the minimum nearly z z', z of the turn to the minimum.
    std::optional<Matrix9> dual() const
    {
        if (!dual_) return std::nullopt;
        return dual_->template cast<double>();
    }

 private:
    struct Step
    {
        Matrix dG = Matrix::Zero();
        Real ds = 0, decrement = 0;
    };
    Matrix slack(const Matrix& G, Real s) const { return G - s * Matrix::Identity(); }
    std::optional<Step> newton_step(const Matrix& W) const;
    void note_dual(const Matrix& W, const Step& step);
    bool move(const Step& step);

    const Matrix start_;
    const Real least_, wanted_;
    Matrix G_, best_ = G_;
    Real s_ = 0, t_ = 0, bound_ = std::numeric_limits<Real>::infinity();
    Eigen::LLT<Matrix> factor_;
    std::optional<Matrix> dual_;
    int steps_ = 0;
};

template <class Real>
std::optional<typename BarrierSearch<Real>::Step> BarrierSearch<Real>::newton_step(const Matrix& W) const
{
    const auto& basis = tables().basis;
    const Matrix W2 = W * W;
    Eigen::Matrix<Real, FREE + 1, FREE + 1> H;
    Eigen::Matrix<Real, FREE + 1, 1> g;
    for (int k = 0; k < FREE; k++)
    {
        const Direction& A = basis[static_cast<size_t>(k)];
        for (int l = 0; l <= k; l++) H(k, l) = product(A, basis[static_cast<size_t>(l)], W);
        H(FREE, k) = -product(A, W2);
        g(k) = -product(A, W);
    }
    H(FREE, FREE) = W2.trace();
    g(FREE) = W.trace() - t_;
    const Eigen::LLT<decltype(H)> factor(H);  // reads the lower triangle
    if (factor.info() != Eigen::Success) return std::nullopt;
    const Eigen::Matrix<Real, FREE + 1, 1> d = -factor.solve(g);
    Step out;
    out.ds = d(FREE), out.decrement = std::sqrt(-g.dot(d));
    if (!std::isfinite(out.decrement) || !d.allFinite()) return std::nullopt;
    for (int k = 0; k < FREE; k++)
        for (const auto& e : basis[static_cast<size_t>(k)])
            out.dG(e.i, e.j) += d(k) * e.h, out.dG(e.j, e.i) += d(k) * e.h;
    return out;
}

/// Within the decrement 1 the step says which Z is dual feasible; <Z, G> is the same for all members then,
/// and no least eigenvalue is above it.
template <class Real>
void BarrierSearch<Real>::note_dual(const Matrix& W, const Step& step)
{
    if (!(step.decrement < 1)) return;
    Matrix Z = W - W * slack(step.dG, step.ds) * W;
    Z = (0.5 / Z.trace() * (Z + Z.transpose())).eval();
    bound_ = std::min(bound_, Z.cwiseProduct(start_).sum());
    dual_ = Z;
}

/// As far along the step as G - s I stays positive; 1 / (1 + decrement) of it always does, but for rounding.
template <class Real>
bool BarrierSearch<Real>::move(const Step& step)
{
    const Real sure = step.decrement < 0.25 ? 1 : 1 / (1 + step.decrement);
    for (Real a = 1;; a = std::max(a * 3 / 5, sure))
    {
        const Matrix G = G_ + a * step.dG;
        const Real s = s_ + a * step.ds;
        factor_.compute(slack(G, s));
        if (factor_.info() == Eigen::Success)
        {
            G_ = G, s_ = s;
            return true;
        }
        if (a <= sure) return false;
    }
}

template <class Real>
bool BarrierSearch<Real>::run(double exactness)
{
    constexpr int MOST_STEPS = 60;
    const Real size = std::max(std::abs(least_), Real(1e-3));
    s_ = least_ - std::max(std::abs(least_) / 10, Real(1e-3)), t_ = 9 / size;
    Real best = least_;
    factor_.compute(slack(G_, s_));
    if (factor_.info() != Eigen::Success) return false;
    while (steps_ < MOST_STEPS && t_ < 1e14)
    {
        steps_++;
        const Matrix W = factor_.solve(Matrix::Identity());
        const auto step = newton_step(W);
        if (!step) break;
        note_dual(W, *step);
        if (!move(*step)) break;
        if (positive(G_, -wanted_))
        {
            best_ = G_;
            return true;
        }
        if (s_ > best) best = s_, best_ = G_;
        if (bound_ < wanted_ && (exactness == 0 || bound_ - s_ < exactness * std::abs(bound_))) break;
        if (step->decrement < 0.7) t_ *= 30;
    }
    return false;
}

struct BarrierResult
{
    bool found = false, stalled = false;
    Matrix9 best = Matrix9::Zero();
    std::optional<Matrix9> dual;
};

/// The turn q whose z z' is nearest to Z, if Z is nearly of rank one.
std::optional<Matrix3d> rounded(const Matrix9& Z)
{
    const Eigen::SelfAdjointEigenSolver<Matrix9> eigen(Z);
    Vector9 z = eigen.eigenvectors().col(8);
    if (z.segment<3>(3).sum() < 0) z = -z;
    Matrix3d vv;
    vv << z(3), z(6) / SQRT2, z(7) / SQRT2, z(6) / SQRT2, z(4), z(8) / SQRT2, z(7) / SQRT2, z(8) / SQRT2,
        z(5);
    const Eigen::SelfAdjointEigenSolver<Matrix3d> axis(vv);
    const Vector3d v = std::sqrt(std::max(axis.eigenvalues()(2), 0.0)) * axis.eigenvectors().col(2);
    if (!(v.squaredNorm() > 0)) return std::nullopt;
    const double w = z.head<3>().dot(v) / (SQRT2 * v.squaredNorm());
    return Quaterniond(w, v.x(), v.y(), v.z()).normalized().toRotationMatrix();
}

/// f >= -4 shift for all rotations, |x|^2 being 4.
bool nonnegative(const Matrix10& Q, double shift)
{
    return Eigen::LLT<Matrix10>(Q + shift * Matrix10::Identity()).info() == Eigen::Success;
}

}  // namespace

double RotationCertificate::margin() const
{
    return least_eigenvalue(G);
}

RotationCertificate certify_rotation(const Matrix10& Q, const Matrix3d& R, const CertificateOptions& options)
{
    const double tolerance = options.tolerance;
    RotationCertificate out;
    // An LLT takes NaN for a success.
    if (!Q.allFinite() || !R.allFinite() || !std::isfinite(tolerance) || tolerance < 0) return out;
    const Matrix3d R0 = Quaterniond(R).normalized().toRotationMatrix();
    if (!((R0 - R).norm() < 1e-6)) return out;
    Vector10 x;
    x << R0.col(0), R0.col(1), R0.col(2), 1;
    out.cost = x.dot(Q * x);
    out.scale = Q.topLeftCorner<9, 9>().trace() / 3 + Q(9, 9) - out.cost;
    const double rounding = 2e-14 * Q.norm();
    const bool may_hold = out.scale > rounding;
    if (!may_hold) out.scale = Q.norm();
    if (!(out.scale > 0) || !std::isfinite(rounding)) return out;

    const Matrix10 gram = times_A(times_A(seen_from(Q, R0, out.cost)).transpose());
    const ClosedForms forms = closed_forms(gram, out.scale);
    if (!forms.nearest.allFinite() || !forms.least.allFinite()) return out;
    const double slope = gram.row(0).segment<3>(1).norm();
    const double sure = SLOPE_FACTOR * slope + rounding;
    out.slope = slope / out.scale;

    // Half of the tolerance is for G, half for the slope.
    const double allowed = 0.5 * tolerance;
    const auto conclude = [&](const Matrix9& G, double gap)
    {
        out.G = G, out.gap = gap;
        out.holds = may_hold && gap <= tolerance * out.scale;
    };
    const auto accept = [&](const Matrix9& G, double shift)
    {
        if (!positive(G, shift)) return false;
        const double below_zero = shift > 0 ? std::clamp(-least_eigenvalue(G), 0.0, shift) : 0;
        conclude(G, below_zero * out.scale + sure);
        return true;
    };
    const Matrix9 between = 0.5 * (forms.nearest + forms.least);
    const auto accept_any = [&](double shift)
    { return accept(forms.nearest, shift) || accept(forms.least, shift) || accept(between, shift); };
    const bool unique = options.wanted_margin > 0 && accept_any(-options.wanted_margin);
    bool accepted = unique || accept_any(0);
    // A sum of squares is not below zero: for exact data that is all there is to prove, wherever R has
    // stopped.
    if (!out.holds && may_hold && out.cost <= allowed * out.scale && nonnegative(Q, allowed * out.scale / 16))
        conclude(forms.nearest, std::max(out.cost, 0.0) + 0.25 * allowed * out.scale + rounding);
    accepted = accepted || out.holds || accept_any(allowed);
    const bool enough = accepted && (unique || !(options.wanted_margin > 0));
    if (enough || !options.search) return out;

    const double least_between = least_eigenvalue(between), least_nearest = least_eigenvalue(forms.nearest);
    const double wanted = accepted ? options.wanted_margin : -allowed;
    const bool from_between = least_between > least_nearest;
    const auto search_in = [&](auto real)
    {
        BarrierSearch<decltype(real)> search(from_between ? between : forms.nearest,
                                             from_between ? least_between : least_nearest, wanted);
        const bool found = search.run(accepted ? 0 : 0.02);
        out.barrier_steps += search.steps();
        return BarrierResult{found, search.stalled(), search.best(), search.dual()};
    };
    BarrierResult found = search_in(double());
    // Where no member is definite (a line of equal minima), the way ends at the border, and its last steps
    // are steep.
    if (!found.found && found.stalled && !accepted) found = search_in(static_cast<long double>(0));
    if (found.found && (accept(found.best, 0) || accept(found.best, allowed))) return out;
    if (accepted) return out;
    conclude(found.best, std::max(0.0, -least_eigenvalue(found.best)) * out.scale + sure);
    if (!out.holds && found.dual)
        if (const auto turn = rounded(*found.dual)) out.better_start = R0 * *turn;
    return out;
}

}  // namespace mp2p_icp
