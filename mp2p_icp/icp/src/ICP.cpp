#include <mp2p_icp/ICP.h>
#include <mp2p_icp/Matcher_Points_DistanceThreshold.h>
#include <mp2p_icp/QualityEvaluator_PairedRatio.h>
#include <mp2p_icp/QualityEvaluator_RangeImageSimilarity.h>
#include <mp2p_icp/QualityEvaluator_Voxels.h>
#include <mp2p_icp/Solver_Horn.h>
#include <mp2p_icp/se3.h>
#include <mrpt/core/initializer.h>

#include <stdexcept>

#include "AlignRun.h"
#include "debug_log.h"
#include "quality_mean.h"

IMPLEMENTS_MRPT_OBJECT(ICP, mrpt::rtti::CObject, mp2p_icp)

MRPT_INITIALIZER(register_mp2p_icp)
{
    mrpt::rtti::registerClass(CLASS_ID_NAMESPACE(ICP, mp2p_icp));
    mrpt::rtti::registerClass(CLASS_ID_NAMESPACE(QualityEvaluator, mp2p_icp));
    mrpt::rtti::registerClass(CLASS_ID_NAMESPACE(QualityEvaluator_PairedRatio, mp2p_icp));
    mrpt::rtti::registerClass(CLASS_ID_NAMESPACE(QualityEvaluator_RangeImageSimilarity, mp2p_icp));
    mrpt::rtti::registerClass(CLASS_ID_NAMESPACE(QualityEvaluator_Voxels, mp2p_icp));
    mrpt::rtti::registerClass(CLASS_ID_NAMESPACE(LogRecord, mp2p_icp));
}

namespace mp2p_icp
{
ICP::ICP()
    : mrpt::system::COutputLogger("ICP"),
      profiler_(std::make_shared<mrpt::system::CTimeLogger>(false, "mp2p_icp::ICP"))
{
    quality_evaluators_.push_back({std::make_shared<QualityEvaluator_PairedRatio>(), 1.0});
}

void ICP::align(const metric_map_t& pcLocal, const metric_map_t& pcGlobal,
                const mrpt::math::TPose3D& initialGuessLocalWrtGlobal, const Parameters& p, Results& result,
                const std::optional<mrpt::poses::CPose3DPDFGaussianInf>& prior,
                const mrpt::optional_ref<LogRecord>& outputDebugInfo) const
{
    const mrpt::poses::CPose3D guess(initialGuessLocalWrtGlobal);
    if (matchers_.empty()) throw std::invalid_argument("ICP::align: there are no matchers");
    if (solvers_.empty()) throw std::invalid_argument("ICP::align: there are no solvers");
    if (p.maxIterations == 0) throw std::invalid_argument("ICP::align: maxIterations must be at least 1");
    if (!is_finite(guess))
        throw std::invalid_argument("ICP::align: the initial guess must be finite, got " + guess.asString());
    if (prior && !is_finite(prior->mean))
        throw std::invalid_argument("ICP::align: the prior's mean must be finite");

    const auto tle = mrpt::system::CTimeLoggerEntry(*profiler_, "align");
    DebugLog log(*this, pcLocal, pcGlobal, initialGuessLocalWrtGlobal, p, prior, outputDebugInfo);
    {
        const auto timer = log.time("total");
        result = AlignRun(*this, pcLocal, pcGlobal, guess, p, prior, log).run();
    }
    log.finish(result);
}

void ICP::attachToParameterSource(const ParameterSource& source)
{
    for (auto& m : matchers_) m->attachToParameterSource(source);
    for (auto& s : solvers_) s->attachToParameterSource(source);
    for (auto& q : quality_evaluators_) q.obj->attachToParameterSource(source);
}

QualityEvaluator::Result ICP::evaluate_quality(const quality_eval_list_t& evaluators,
                                               const metric_map_t& pcGlobal, const metric_map_t& pcLocal,
                                               const mrpt::poses::CPose3D& localPose,
                                               const Pairings& pairings, const MatchContext& context)
{
    const auto mean = quality_mean(evaluators, pcGlobal, pcLocal, localPose, pairings, context, true);
    return {mean.discarded ? 0.0 : mean.value(), mean.discarded};
}

}  // namespace mp2p_icp
