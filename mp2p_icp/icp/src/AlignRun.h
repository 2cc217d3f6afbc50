#pragma once

#include <mp2p_icp/ICP.h>
#include <mp2p_icp/map_offsets.h>
#include <mp2p_icp/pose_step.h>

#include <optional>

#include "debug_log.h"
#include "pairings_on_surfaces.h"

namespace mp2p_icp
{
/** One call of ICP::align(): everything that a run remembers. Poses are in stored coordinates inside. */
class AlignRun
{
 public:
    AlignRun(const ICP& icp, const metric_map_t& local, const metric_map_t& global,
             const mrpt::poses::CPose3D& guess, const Parameters& parameters,
             const std::optional<mrpt::poses::CPose3DPDFGaussianInf>& prior, DebugLog& log);

    Results run();

 private:
    void iterate();
    /// One round of match and solve. \return false when the run has ended.
    bool one_iteration(uint32_t iteration);
    Pairings match(const mrpt::poses::CPose3D& pose, uint32_t iteration);
    /// What the solvers make of them at the present pose; empty if none can use them.
    std::optional<OptimalTF_Result> solution_of(const Pairings& pairings, uint32_t iteration);
    bool solve(const Pairings& pairings, uint32_t iteration);
    bool has_diverged(const mrpt::poses::CPose3D& pose) const;
    /// The pose has come back to where it was so many iterations ago; a period of 1 is a stall.
    struct Ending
    {
        size_t period;
    };
    std::optional<Ending> is_ending() const;
    /// Ends the iterations: at the pose that fits best, of those that the run would visit for ever.
    void end(const Ending& ending);
    bool checkpoint_passed(const Pairings& pairings, uint32_t iteration) const;
    bool hook_stops(const Pairings& pairings, uint32_t iteration) const;
    void print_iteration(const Pairings& pairings, uint32_t iteration) const;

    /// Are matching distances, matchers or solvers going to change after this iteration, and when?
    std::optional<uint32_t> next_change(uint32_t iteration) const;

    MatchContext match_context(uint32_t iteration) const;
    std::optional<double> gate(uint32_t iteration) const;
    std::vector<double> costs_at(const mrpt::poses::CPose3D& pose, double gate);
    void judge(Results& out);
    /// Returns the guess instead of what was found.
    void reject(Results& out, Verdict verdict, const std::string& reason) const;
    /// Whether surfaces and prior determine the pose that was found; what they do not is put back to the
    /// guess.
    void observe(Results& out);
    /// Compares the costs at pose_ with those at the guess, and notes them.
    bool is_worse_than_guess(Results& out);
    /** Goes on from the guess along free motions, keeping to it, until the rest no longer moves, or only
     * comes back to where it was: what was put back need not be free to the last digit. \return why it does
     * not come to rest, if it does not
     */
    std::optional<std::string> settle(const std::vector<FreeTwist>& free);
    /// The direction whose surfaces do not agree, if there is one.
    std::optional<SurfaceAgreement> disagreement(const SurfacePairings& on) const;
    bool is_large(const PoseStep& step) const;
    void describe_returned_pose(Results& out);

    const ICP& icp_;
    const metric_map_t& local_;
    const metric_map_t& global_;
    const Parameters& parameters_;
    const MapOffsets offsets_;
    const mrpt::poses::CPose3D original_guess_, guess_;
    std::optional<mrpt::poses::CPose3DPDFGaussianInf> original_prior_;
    DebugLog& log_;
    MatchState state_;
    SolverContext solver_context_;
    std::optional<double> first_gate_;
    mrpt::math::TPoint3D local_centre_{0, 0, 0};

    mrpt::poses::CPose3D pose_;
    std::optional<mrpt::poses::CPose3D> before_;  ///< the pose of the last iteration
    std::vector<mrpt::poses::CPose3D> poses_;     ///< all since matchers or solvers changed, with the first
    OptimalTF_Result solution_;
    size_t solved_ = 0;
    Pairings at_end_;  ///< matched once more where the iterations ended
    uint32_t last_iteration_ = 0;
    bool diverged_ = false;
    bool nobody_matched_ = false;  ///< no matcher was active in the last iteration
    std::string chance_at_guess_;  ///< the pairings at the guess, if they were too few to go on with
    IterTermReason reason_ = IterTermReason::Undefined;
};

}  // namespace mp2p_icp
