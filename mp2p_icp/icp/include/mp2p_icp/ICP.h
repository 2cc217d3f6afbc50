#pragma once

#include <mp2p_icp/LogRecord.h>
#include <mp2p_icp/Matcher.h>
#include <mp2p_icp/Parameters.h>
#include <mp2p_icp/QualityEvaluator.h>
#include <mp2p_icp/Results.h>
#include <mp2p_icp/Solver.h>
#include <mrpt/core/optional_ref.h>
#include <mrpt/maps/CSimplePointsMap.h>
#include <mrpt/math/TPose3D.h>
#include <mrpt/system/CTimeLogger.h>

#include <functional>
#include <memory>
#include <vector>

namespace mp2p_icp
{
/** The Iterative Closest Point / Primitive loop: match, solve, test for the end, repeat; assembled from
 * matchers, solvers and quality evaluators. Configured once; align() is const and may be called from several
 * threads at once (an iteration hook must then be thread-safe itself).
 */
class ICP : public mrpt::rtti::CObject, public mrpt::system::COutputLogger
{
    DEFINE_MRPT_OBJECT(ICP, mp2p_icp)

 public:
    ICP();

    struct QualityEvaluatorEntry
    {
        QualityEvaluator::Ptr obj;
        double relativeWeight = 1.0;
    };
    using quality_eval_list_t = std::vector<QualityEvaluatorEntry>;

    /** Finds the pose of `pcLocal` with respect to `pcGlobal`, near the guess.
     *
     * Both poses are in the maps' original coordinates: a coordinate_offset() of a map is taken into account
     * here. What the data do not allow is a normal return, told by Results::verdict: it is never `aligned`
     * with fewer constraints than degrees of freedom, without overlap, or with a fit worse than the guess's.
     * ICP_ITERATION is set for formulas. \param prior On the sought pose; reaches every solver. \param
     * outputDebugInfo Filled with the whole story if given. \exception std::invalid_argument without matchers
     * or solvers, for a guess that is not finite, or maxIterations of 0. The same inputs give the same bits
     * on any number of threads.
     */
    virtual void align(const metric_map_t& pcLocal, const metric_map_t& pcGlobal,
                       const mrpt::math::TPose3D& initialGuessLocalWrtGlobal, const Parameters& p,
                       Results& result,
                       const std::optional<mrpt::poses::CPose3DPDFGaussianInf>& prior = std::nullopt,
                       const mrpt::optional_ref<LogRecord>& outputDebugInfo = std::nullopt) const;

    const solver_list_t& solvers() const { return solvers_; }
    solver_list_t& solvers() { return solvers_; }
    const matcher_list_t& matchers() const { return matchers_; }
    matcher_list_t& matchers() { return matchers_; }
    const quality_eval_list_t& quality_evaluators() const { return quality_evaluators_; }
    quality_eval_list_t& quality_evaluators() { return quality_evaluators_; }

    /// From lists of `{class, params, enabled}` (and `weight` for evaluators). \exception ConfigError
    void initialize_solvers(const yaml& list, const YamlPlace& place = {});
    void initialize_matchers(const yaml& list, const YamlPlace& place = {});
    void initialize_quality_evaluators(const yaml& list, const YamlPlace& place = {});

    /// Formulas of all parts see the variables of the source from now on.
    void attachToParameterSource(const ParameterSource& source);

    /// Weighted mean of the evaluators (0..1); 0, with `hard_discard`, if any of them discards.
    static QualityEvaluator::Result evaluate_quality(
        const quality_eval_list_t& evaluators, const metric_map_t& pcGlobal, const metric_map_t& pcLocal,
        const mrpt::poses::CPose3D& localPose, const Pairings& pairings, const MatchContext& context = {});

    struct IterationHook_Input
    {
        const metric_map_t* pcGlobal = nullptr;
        const metric_map_t* pcLocal = nullptr;
        const Pairings* currentPairings = nullptr;
        const OptimalTF_Result* currentSolution =
            nullptr;  ///< in stored coordinates (without the maps' offsets)
        uint32_t currentIteration = 0;
    };
    struct IterationHook_Output
    {
        bool request_stop = false;
    };
    using iteration_hook_t = std::function<IterationHook_Output(const IterationHook_Input&)>;
    /// Called after each solve.
    void setIterationHook(const iteration_hook_t& hook) { iteration_hook_ = hook; }

    /// Times of the stages; off by default. Thread-safe.
    mrpt::system::CTimeLogger& profiler() { return *profiler_; }

 private:
    solver_list_t solvers_;
    matcher_list_t matchers_;
    quality_eval_list_t quality_evaluators_;
    iteration_hook_t iteration_hook_;
    std::shared_ptr<mrpt::system::CTimeLogger> profiler_;

    friend class AlignRun;
};

/** Aligns two clouds in one call, with a pipeline chosen from their size (see default_pipeline_for()).
 * \return as ICP::align(). \exception std::invalid_argument for a guess that is not finite.
 */
Results align(const mrpt::maps::CSimplePointsMap& local, const mrpt::maps::CSimplePointsMap& global,
              const mrpt::poses::CPose3D& localWrtGlobal = mrpt::poses::CPose3D());

}  // namespace mp2p_icp
