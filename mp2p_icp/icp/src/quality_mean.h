#pragma once

#include <mp2p_icp/QualityEvaluator.h>

namespace mp2p_icp
{
/// What the enabled evaluators say together.
struct QualityMean
{
    double weighted = 0, weights = 0;
    bool discarded = false;  ///< by any of them

    /// 0 without evaluators.
    double value() const { return weights > 0 ? weighted / weights : 0.0; }
};

/// \param ends_with_discard are those after one that discards left out? Nothing is asked of them then.
template <class Evaluators>
QualityMean quality_mean(const Evaluators& evaluators, const metric_map_t& global, const metric_map_t& local,
                         const mrpt::poses::CPose3D& pose, const Pairings& pairings,
                         const MatchContext& context, bool ends_with_discard)
{
    QualityMean mean;
    for (const auto& [evaluator, weight] : evaluators)
    {
        if (!evaluator->enabled) continue;
        const auto one = evaluator->evaluate(global, local, pose, pairings, context);
        mean.weighted += weight * one.quality, mean.weights += weight;
        mean.discarded |= one.hard_discard;
        if (mean.discarded && ends_with_discard) break;
    }
    return mean;
}

}  // namespace mp2p_icp
