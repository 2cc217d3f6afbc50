#include "check_certificate.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <charconv>
#include <cmath>

#include "cost_form.h"
#include "quartic.h"

namespace mp2p_icp_certify
{
namespace
{
// ---- What is allowed --------------------------------------------------------------------------------------

/// Of a rotation matrix, and of the cost at the given translation, relative to `scale`.
constexpr Real POSE_TOLERANCE = 1e-9L;

/// The roundings (1.1e-16 each) of an entry of a form in doubles, up to 12 of which, up to 4 times as large,
/// make a coefficient. Relative to the mean size of the cost.
constexpr Real ROUNDING = 5e-14L;
/// Each pairing more is a step of a random walk, if the sum was a plain one.
constexpr Real ROUNDING_OF_A_PAIRING = 4e-16L;
/// The dozen or two of them in an entry that couples R and t, before that is divided by a small eigenvalue.
constexpr Real ROUNDING_OF_ELIMINATION = 4e-15L;
/// Of what is made from the entries of G, relative to its norm.
constexpr Real ROUNDING_OF_G = 1e-14L;
/// What a solver may add to its gap for the rounding of its sums, which enlarges that of light pairings
/// beside heavy ones. Relative to `scale`; a bound that proves no optimum may be as large as it likes.
constexpr Real ROUNDING_OF_SUMS = 1e-9L;
/// Every coefficient may be off by a rounding.
constexpr Real QUARTIC_MONOMIALS = 35;

/// A file that asks for less does not prove much.
constexpr Real LARGEST_TOLERANCE = 1e-3L;

/// rad: nearer rotations are the same minimum.
constexpr Real SAME_ROTATION = 1e-4L;

/// A motion whose information is below this part of the best known one's may count as free.
constexpr Real MAYBE_FREE = 1e-6L;

/// The cost does not rise along a motion if its second derivative is below this part of the scale.
constexpr Real FLAT = 1e-7L;

/// 2 max w^3 sqrt(1 - w^2), at w^2 = 3/4.
const Real LARGEST_GRADIENT_MONOMIAL = 3 * std::sqrt(Real(3)) / 8;

// ---- The checks -------------------------------------------------------------------------------------------
class Check
{
 public:
    explicit Check(const Certificate& c) : c_(c), form_(cost_form(c.pairings, c.prior))
    {
        for (const auto& p : c.pairings) out_.pairings[static_cast<size_t>(p.kind)]++;
        out_.has_prior = c.prior.has_value();
        out_.verdict = c.verdict, out_.tolerance = c.tolerance;
        out_.minima = c.minima.size();
    }

    Findings all()
    {
        check_rotation("the rotation", c_.pose.R);
        if (c_.prior) check_rotation("the prior's rotation", c_.prior->mean.R);
        if (!out_.holds()) return out_;  // without a rotation there is nothing to compare
        out_.compared = true;
        pose_.R = nearest_rotation(c_.pose.R);
        pose_.t = c_.pose.t;
        check_cost();
        check_scale();
        check_translation();
        check_G();
        check_gap();
        check_minima();
        check_tolerance();
        check_verdict();
        return out_;
    }

 private:
    void fail(const std::string& sentence) { out_.failures.push_back(sentence); }

    /// All comparisons are such that NaN fails.
    void compare(const std::string& name, const TwoNumbers& n, Real allowed, const std::string& unit)
    {
        if (std::abs(n.found - n.in_file) <= allowed) return;
        const auto [found, in_file] = texts_of(n.found, n.in_file);
        fail("the " + name + " is " + found + unit + ", the file says " + in_file + unit);
    }

    bool check_rotation(const std::string& name, const Mat3& R)
    {
        const Real off = distance_to_rotation(R);
        if (off <= POSE_TOLERANCE) return true;
        if (std::isinf(off))
            fail(name + " has the determinant " + text_of(R.determinant()) + ", it must be 1");
        else
            fail(name + " is off an orthonormal matrix by " + text_of(off) + ", at most " +
                 text_of(POSE_TOLERANCE) + " is allowed");
        return false;
    }

    void check_cost()
    {
        out_.cost = {form_.at(pose_.R), c_.cost};
        out_.scale = {form_.mean() - out_.cost.found, c_.scale};
        const Real steps = std::sqrt(static_cast<Real>(c_.pairings.size()));
        // Where a direction of t is known badly, its elimination in doubles enlarges their roundings.
        out_.rounding =
            (ROUNDING + ROUNDING_OF_A_PAIRING * steps + ROUNDING_OF_ELIMINATION / form_.worst_translation) *
            form_.size;
        out_.translation_excess = excess_of_translation(pose_);
        compare("cost", out_.cost, rounding_of_cost(pose_), " m^2");
    }

    void check_scale()
    {
        compare("scale", out_.scale, 3 * out_.rounding, " m^2");
        if (!(c_.scale >= 0)) fail("the scale is " + text_of(c_.scale) + " m^2, it must not be below 0");
    }

    Real excess_of_translation(const Pose& pose) const { return form_.at(pose) - form_.at(pose.R); }

    /// With the part that t is off its minimum, if it is allowed to.
    Real rounding_of_cost(const Pose& pose) const
    {
        return out_.rounding + std::min(std::max(excess_of_translation(pose), Real(0)), allowed_excess(pose));
    }

    Real allowed_excess(const Pose& pose) const
    {
        return POSE_TOLERANCE * std::abs(out_.scale.found) + out_.rounding +
               form_.rounding_of_translation(pose);
    }

    void check_translation()
    {
        if (out_.translation_excess <= allowed_excess(pose_)) return;
        const auto [with_t, best] = texts_of(form_.at(pose_), out_.cost.found);
        fail("the translation is not the best one for this rotation: the cost with it is " + with_t +
             " m^2, with the best one " + best + " m^2");
    }

    Real rounding_of_coefficient() const
    {
        return out_.rounding + ROUNDING_OF_G * c_.G.norm() * std::abs(c_.scale);
    }

    void check_G()
    {
        if (const Real off = (c_.G - c_.G.transpose()).cwiseAbs().maxCoeff();
            !(off <= ROUNDING_OF_G * c_.G.norm()))
            fail("G is not symmetric: two entries that must be equal differ by " + text_of(off) +
                 ", at most " + text_of(ROUNDING_OF_G * c_.G.norm()) + " is allowed");
        const Mat9 symmetric = (c_.G + c_.G.transpose()) / 2;
        const Eigen::SelfAdjointEigenSolver<Mat9> eigen(symmetric, Eigen::EigenvaluesOnly);
        out_.margin = {eigen.eigenvalues()[0], c_.margin};
        compare("margin", out_.margin, 4 * ROUNDING_OF_G * c_.G.norm(), "");
        compare_polynomials(symmetric);
    }

    /// f(R0 R(q)) against cost |q|^4 + scale z' G z + 2 w^3 gradient . (x, y, z)
    void compare_polynomials(const Mat9& G)
    {
        Polynomial difference = cost_around(form_, pose_.R);
        add_product(difference, -c_.scale, certificate_polynomial(G), {{Exponents{}, 1}});
        const Polynomial norm_sq = {
            {{2, 0, 0, 0}, 1}, {{0, 2, 0, 0}, 1}, {{0, 0, 2, 0}, 1}, {{0, 0, 0, 2}, 1}};
        add_product(difference, -out_.cost.found, norm_sq, norm_sq);
        Vec3 gradient;
        int i = 0;
        for (const Exponents& e : {Exponents{3, 1, 0, 0}, Exponents{3, 0, 1, 0}, Exponents{3, 0, 0, 1}})
            gradient[i++] = difference[e] / 2, difference.erase(e);
        out_.gradient = gradient.norm();

        Exponents worst{};
        for (const auto& [e, coefficient] : difference)
        {
            sum_of_mismatches_ += std::abs(coefficient);
            if (std::abs(coefficient) <= out_.largest_mismatch) continue;
            out_.largest_mismatch = std::abs(coefficient), worst = e;
        }
        if (!(sum_of_mismatches_ <= QUARTIC_MONOMIALS * rounding_of_coefficient()) ||
            !(out_.largest_mismatch <= rounding_of_coefficient()))
            fail("G does not belong to this cost: its polynomial is off by " +
                 text_of(out_.largest_mismatch) + " m^2 in the coefficient of " + name_of(worst) +
                 ", at most " + text_of(rounding_of_coefficient()) + " m^2 is rounding");
    }

    static std::string name_of(const Exponents& e)
    {
        std::string name;
        for (size_t i = 0; i < 4; i++) name += std::string(static_cast<size_t>(e[i]), "wxyz"[i]);
        return name;
    }

    /// What G proves, up to its mismatch with the cost.
    Real gap_of_G() const
    {
        return std::abs(c_.scale) * std::max(Real(0), -out_.margin.found) +
               LARGEST_GRADIENT_MONOMIAL * out_.gradient;
    }

    /// No cost is below zero.
    Real at_most_cost(Real gap) const { return std::max(Real(0), std::min(gap, out_.cost.found)); }

    void check_gap()
    {
        if (!std::isfinite(gap_of_G() + sum_of_mismatches_ + out_.scale.found))
            return fail("the gap cannot be found: a number is infinite, where all must be finite");
        out_.gap = {at_most_cost(gap_of_G() + sum_of_mismatches_), c_.gap};
        // The file may or may not count its own rounding.
        const Real allowed = 2 * out_.rounding + 4 * ROUNDING_OF_G * c_.G.norm() * std::abs(c_.scale);
        const Real least = at_most_cost(gap_of_G()) - allowed;
        const Real most = at_most_cost(gap_of_G() + QUARTIC_MONOMIALS * rounding_of_coefficient()) + allowed +
                          ROUNDING_OF_SUMS * std::abs(out_.scale.found);
        if (c_.gap >= least && (c_.gap <= most || c_.verdict == "gap")) return;
        compare("gap", out_.gap, 0, " m^2");
    }

    void check_minima()
    {
        for (size_t i = 0; i < c_.minima.size(); i++) check_minimum(i);
        for (size_t i = 1; i < c_.minima.size(); i++)
            if (!(c_.minima[i].cost >= c_.minima[i - 1].cost - out_.rounding))
                fail("the minima are not in the order of their costs: " + text_of(c_.minima[i].cost) +
                     " m^2 stands after " + text_of(c_.minima[i - 1].cost) + " m^2");
    }

    void check_minimum(size_t i)
    {
        const ListedMinimum& m = c_.minima[i];
        const std::string name = "minimum " + std::to_string(i + 1);
        if (!check_rotation("the rotation of " + name, m.pose.R)) return;
        const Pose pose{nearest_rotation(m.pose.R), m.pose.t};
        const Real cost = form_.at(pose.R);
        compare("cost of " + name, {cost, m.cost}, rounding_of_cost(pose), " m^2");
        if (!(excess_of_translation(pose) <= allowed_excess(pose)))
        {
            const auto [with_t, best] = texts_of(form_.at(pose), cost);
            fail("the translation of " + name + " is not the best one: the cost with it is " + with_t +
                 " m^2, with the best one " + best + " m^2");
        }
        if (angle_between(pose.R, pose_.R) <= SAME_ROTATION) return;
        const Real more = cost - out_.cost.found;
        // On the border both verdicts are right.
        const Real border = std::min(out_.rounding, allowed_gap() / 2);
        if (more <= allowed_gap() - border) out_.equal_minima++;
        if (more <= allowed_gap() + border) maybe_equal_minima_++;
    }

    void check_tolerance()
    {
        if (!(c_.tolerance > 0 && c_.tolerance <= LARGEST_TOLERANCE))
            fail("the tolerance is " + text_of(c_.tolerance) + ", it must be above 0 and at most " +
                 text_of(LARGEST_TOLERANCE));
    }

    /// The largest gap that counts as none.
    Real allowed_gap() const { return c_.tolerance * out_.scale.found; }

    void check_verdict()
    {
        out_.weakest_motion = form_.weakest_motion(pose_.R);
        if (c_.verdict == "gap")
        {
            if (out_.gap.found <= allowed_gap() / 2)
                fail("the verdict is 'gap', but the gap is only " + gap_and_tolerance());
            return;
        }
        if (!(at_most_cost(gap_of_G()) <= allowed_gap() + 2 * out_.rounding))
            fail("the verdict is '" + c_.verdict + "', but the gap is " + gap_and_tolerance());
        if (c_.verdict == "global" && out_.equal_minima > 0)
            fail("the verdict is 'global', but " + std::to_string(out_.equal_minima) +
                 " other listed minima cost no more, within the tolerance: 'global_ambiguous' was expected");
        if (c_.verdict == "global_ambiguous" && maybe_equal_minima_ == 0)
            fail("the verdict is 'global_ambiguous', but no other listed minimum costs as little");
        if (c_.verdict == "unobservable" && !is_flat())
            fail(
                "the verdict is 'unobservable', but the cost rises in all directions: the worst known motion "
                "has " +
                text_of(out_.weakest_motion) + " of the information of the best known one");
    }

    /// Is there a motion along which the cost hardly rises? Of G, the first three rows are the Hessian of f.
    bool is_flat() const
    {
        const Mat3 hessian = c_.G.topLeftCorner<3, 3>();
        const Real least =
            Eigen::SelfAdjointEigenSolver<Mat3>(hessian, Eigen::EigenvaluesOnly).eigenvalues()[0];
        return out_.weakest_motion < MAYBE_FREE || least < FLAT;
    }

    std::string gap_and_tolerance() const
    {
        return text_of(out_.gap.found) + " m^2, with " + text_of(allowed_gap()) + " m^2 (" +
               text_of(c_.tolerance) + " of the scale) allowed";
    }

    const Certificate& c_;
    CostForm form_;
    Pose pose_;
    Findings out_;
    Real sum_of_mismatches_ = 0;
    size_t maybe_equal_minima_ = 0;
};

std::string text_with_digits(Real value, int digits)
{
    char buffer[48];
    const auto end = std::to_chars(buffer, buffer + sizeof(buffer), static_cast<double>(value),
                                   std::chars_format::general, digits)
                         .ptr;
    return {buffer, end};
}
}  // namespace

Findings check_certificate(const Certificate& certificate)
{
    return Check(certificate).all();
}

std::array<std::string, 2> texts_of(Real a, Real b)
{
    std::array<std::string, 2> texts;
    for (int digits = 6; digits <= 17; digits++)
    {
        texts = {text_with_digits(a, digits), text_with_digits(b, digits)};
        if (texts[0] != texts[1]) break;
    }
    return texts;
}

std::string text_of(Real value)
{
    return text_with_digits(value, 6);
}

}  // namespace mp2p_icp_certify
