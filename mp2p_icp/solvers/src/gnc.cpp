#include "gnc.h"

#include <algorithm>
#include <cmath>

#include "gauss_newton_problem.h"

namespace mp2p_icp
{
namespace
{
/// By how much the control parameter changes per round.
constexpr double STEP = 1.4;
constexpr int MOST_ROUNDS = 200;

/** The weights of one loss at one value of the control parameter mu; Yang et al. 2020, eq. (12) and (14). The
 * loss is convex for the largest mu (Geman-McClure), for the smallest one (truncated squares).
 */
class Loss
{
 public:
    Loss(bool truncated, double threshold_sq, double largest_sq)
        : truncated_(truncated),
          c_(threshold_sq),
          mu_(truncated ? c_ / std::max(2 * largest_sq - c_, c_) : std::max(1.0, 2 * largest_sq / c_))
    {
    }

    double weight(double square) const
    {
        if (!truncated_) return std::pow(mu_ * c_ / (square + mu_ * c_), 2);
        if (square <= mu_ / (mu_ + 1) * c_) return 1;
        if (square >= (mu_ + 1) / mu_ * c_) return 0;
        return std::sqrt(c_ * mu_ * (mu_ + 1) / square) - mu_;
    }
    /// Has it become the loss itself, within what weights can tell?
    bool is_final() const { return truncated_ ? mu_ > 1e6 : mu_ <= 1; }
    void sharpen() { mu_ = truncated_ ? mu_ * STEP : std::max(1.0, mu_ / STEP); }

 private:
    bool truncated_;
    double c_, mu_;
};

bool are_zero_or_one(const std::vector<double>& weights)
{
    return std::all_of(weights.begin(), weights.end(), [](double w) { return w == 0 || w == 1; });
}
}  // namespace

bool solve_gnc(const PreparedPairings& in, OutlierRejection loss_kind, double threshold,
               const WeightedSolver& solve, OptimalTF_Result& result)
{
    PreparedPairings weighted = in;
    OptimalTF_Result now = result;
    if (!solve(weighted, now))
    {
        result.skipped = now.skipped, result.status = now.status, result.rank = now.rank, result.free.clear();
        return false;
    }
    const bool truncated = loss_kind == OutlierRejection::GncTruncated;
    const double threshold_sq = threshold * threshold;
    std::vector<double> squares = squared_residuals(in, now.optimalPose);
    if (squares.empty())  // a prior alone
    {
        result = now;
        return true;
    }
    Loss loss(truncated, threshold_sq, *std::max_element(squares.begin(), squares.end()));
    bool solved = true;
    for (int round = 0; round < MOST_ROUNDS && solved; round++)
    {
        std::vector<double> weights(squares.size());
        std::transform(squares.begin(), squares.end(), weights.begin(),
                       [&](double s) { return loss.weight(s); });
        weighted = in.with_factors(weights);
        solved = solve(weighted, now);
        if (!solved) break;
        const std::vector<double> before = squares;
        squares = squared_residuals(in, now.optimalPose);
        const bool settled =
            loss.is_final() &&
            std::equal(squares.begin(), squares.end(), before.begin(),
                       [&](double a, double b) { return std::abs(a - b) < 1e-12 * (threshold_sq + b); });
        if (settled || (truncated && round > 0 && are_zero_or_one(weights))) break;
        loss.sharpen();
    }
    if (!solved) now.optimalPose = result.optimalPose;
    for (size_t i = 0; i < squares.size(); i++)
        if (const PairingId id = pairing_id(in.pairings(), i); squares[i] > threshold_sq && in.in_use(id))
            in.note_outlier(id, now.outliers);
    // Another test may have found some of the points before.
    std::sort(now.outliers.point2point.begin(), now.outliers.point2point.end());
    result = now;
    return solved;
}

}  // namespace mp2p_icp
