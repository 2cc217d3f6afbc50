#include <mp2p_icp/parallel.h>
#include <mp2p_icp/random.h>
#include <mp2p_icp/scale_test.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "finite_point_pairs.h"

namespace mp2p_icp
{
namespace
{
using Eigen::Vector3d;

constexpr size_t CANDIDATE_CENTRES = 64;
constexpr uint64_t CANDIDATE_SEED = 1;
constexpr int CENTRES = 4;  // so many fix where a point is, unless they are coplanar
constexpr int MAX_ROUNDS = 30;

/// How the other pairings look from a pairing as the centre.
struct Support
{
    size_t agreeing = 0;  ///< far enough to tell, and at the same distance on both sides
    size_t contradicting = 0;
    Support& operator+=(const Support& o)
    {
        agreeing += o.agreeing;
        contradicting += o.contradicting;
        return *this;
    }
};

bool agrees(const PointPair& p, const PointPair& centre, double tolerance)
{
    return std::abs((p.a - centre.a).norm() - (p.b - centre.b).norm()) <= tolerance;
}

Support support_of(const PointPairs& pairs, const PointPair& centre, double tolerance)
{
    return block_sum<Support>(pairs.size(),
                              [&](size_t first, size_t last)
                              {
                                  Support s;
                                  for (size_t i = first; i < last; i++)
                                  {
                                      const double a = (pairs[i].a - centre.a).norm(),
                                                   b = (pairs[i].b - centre.b).norm();
                                      // written so that overflow to inf - inf contradicts
                                      if (!(std::abs(a - b) <= tolerance))
                                          s.contradicting++;
                                      else if (std::max(a, b) > tolerance)
                                          s.agreeing++;
                                  }
                                  return s;
                              });
}

PointPairs agreeing_with(const PointPairs& pairs, const PointPair& centre, double tolerance)
{
    PointPairs kept;
    for (const auto& p : pairs)
        if (agrees(p, centre, tolerance)) kept.push_back(p);
    return kept;
}

/// The pairings that agree with the best supported one of a fixed random choice, `used` ones excepted; it is
/// added to them.
PointPairs agree_with_best_centre(const PointPairs& pairs, double tolerance, std::set<size_t>& used)
{
    Support total;
    size_t best = 0, best_agreeing = 0;
    for (const size_t c : random_subset(pairs.size(), CANDIDATE_CENTRES, CANDIDATE_SEED))
    {
        if (used.count(pairs[c].index)) continue;
        const Support s = support_of(pairs, pairs[c], tolerance);
        total += s;
        if (s.agreeing > best_agreeing) best_agreeing = s.agreeing, best = c;
        if (2 * best_agreeing > pairs.size()) break;  // any other set is smaller
    }
    if (pairs.empty() || (best_agreeing == 0 && total.contradicting > 0)) return {};
    used.insert(pairs[best].index);
    return agreeing_with(pairs, pairs[best], tolerance);
}

PointPair mean_of(const PointPairs& pairs)
{
    PointPair mean{Vector3d::Zero(), Vector3d::Zero(), 0};
    for (const auto& p : pairs) mean.a += p.a, mean.b += p.b;
    mean.a /= static_cast<double>(pairs.size());
    mean.b /= static_cast<double>(pairs.size());
    return mean;
}

bool same_indices(const PointPairs& a, const PointPairs& b)
{
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](const PointPair& p, const PointPair& q) { return p.index == q.index; });
}

/// The test about the means, until the set whose means they are is the set that passes.
PointPairs agree_with_their_mean(const PointPairs& pairs, double tolerance)
{
    PointPairs kept = pairs, largest;
    for (int round = 0; round < MAX_ROUNDS && !kept.empty(); round++)
    {
        PointPairs next = agreeing_with(pairs, mean_of(kept), tolerance);
        if (same_indices(next, kept)) return kept;
        kept = std::move(next);
        if (kept.size() > largest.size()) largest = kept;
    }
    return largest;  // it cycles
}
}  // namespace

std::vector<size_t> noise_scale_inliers(const MatchedPointList& pairs, double tolerance)
{
    if (!(tolerance > 0) || !std::isfinite(tolerance))
        throw std::invalid_argument("noise_scale_inliers: tolerance must be positive and finite, in metres");
    PointPairs candidates = finite_pairs(pairs);
    std::set<size_t> used;
    for (int round = 0; round < CENTRES; round++)
        candidates = agree_with_best_centre(candidates, 2 * tolerance, used);
    return indices_of(agree_with_their_mean(candidates, tolerance));
}

}  // namespace mp2p_icp
