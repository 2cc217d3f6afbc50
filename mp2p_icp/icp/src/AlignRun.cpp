#include "AlignRun.h"

#include <mp2p_icp/numbers.h>
#include <mp2p_icp/pose_step.h>
#include <mp2p_icp/se3.h>
#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <limits>
#include <stdexcept>

#include "cost_comparison.h"
#include "pairings_on_surfaces.h"
#include "quality_mean.h"
#include "toward_guess.h"

namespace mp2p_icp
{
using mrpt::poses::CPose3D;

namespace
{
mrpt::math::TPoint3D centre_of(const metric_map_t& map)
{
    const auto box = map.bounding_box();
    return box ? (box->min + box->max) * 0.5 : mrpt::math::TPoint3D(0, 0, 0);
}
}  // namespace

AlignRun::AlignRun(const ICP& icp, const metric_map_t& local, const metric_map_t& global,
                   const CPose3D& guess, const Parameters& parameters,
                   const std::optional<mrpt::poses::CPose3DPDFGaussianInf>& prior, DebugLog& log)
    : icp_(icp),
      local_(local),
      global_(global),
      parameters_(parameters),
      offsets_(local, global),
      original_guess_(guess),
      guess_(offsets_.to_stored(guess)),
      log_(log),
      state_(global, local),
      local_centre_(centre_of(local)),
      pose_(guess_)
{
    if (prior) original_prior_ = prior, solver_context_.prior = offsets_.to_stored(*prior);
}

Results AlignRun::run()
{
    iterate();
    const auto timer = log_.time("quality");
    Results out;
    judge(out);
    describe_returned_pose(out);
    return out;
}

// ---- The loop ---------------------------------------------------------------------------------------------

void AlignRun::iterate()
{
    first_gate_ = gate(0);
    poses_ = {guess_};
    for (uint32_t iteration = 0; iteration < parameters_.maxIterations;)
    {
        last_iteration_ = iteration;
        const size_t handed_over = solver_context_.switched_off.size();
        if (!one_iteration(iteration)) return;
        const auto change = next_change(iteration);
        const bool handed_over_now = solver_context_.switched_off.size() != handed_over;
        const auto ending = handed_over_now ? std::nullopt : is_ending();
        if (ending && (!change || *change >= parameters_.maxIterations)) return end(*ending);
        // Once something changes, the same pose need not lead to the same next one.
        if (ending || handed_over_now || change == iteration + 1) poses_ = {pose_};
        iteration = ending ? *change : iteration + 1;  // nothing would move until then
    }
    reason_ = IterTermReason::MaxIterations;
}

namespace
{
/// With a smaller share of the possible pairings at the guess, what the iterations end at is chance.
constexpr double LEAST_SHARE_AT_GUESS = 0.05;

bool is_chance(const Pairings& at_guess)
{
    return static_cast<double>(at_guess.size()) <
           LEAST_SHARE_AT_GUESS * static_cast<double>(at_guess.potential_pairings);
}
}  // namespace

bool AlignRun::one_iteration(uint32_t iteration)
{
    const auto ends_with = [this](IterTermReason reason)
    {
        reason_ = reason;
        return false;
    };
    const auto tle = mrpt::system::CTimeLoggerEntry(*icp_.profiler_, "align.iteration");
    const Pairings pairings = [&]()
    {
        const auto timer = log_.time("match");
        return match(pose_, iteration);
    }();
    if (pairings.empty())
    {
        nobody_matched_ = std::none_of(icp_.matchers_.begin(), icp_.matchers_.end(),
                                       [&](const auto& m) { return m->is_active(match_context(iteration)); });
        return ends_with(IterTermReason::NoPairings);
    }
    if (iteration == 0 && is_chance(pairings))
    {
        chance_at_guess_ = pairings.contents_summary();
        return ends_with(IterTermReason::NoPairings);
    }
    if (!solve(pairings, iteration)) return ends_with(IterTermReason::SolverError);
    log_.add_iteration(iteration, *before_, solution_, pairings, gate(iteration));
    print_iteration(pairings, iteration);
    if (has_diverged(pose_))
    {
        diverged_ = true;
        return ends_with(IterTermReason::SolverError);
    }
    if (hook_stops(pairings, iteration)) return ends_with(IterTermReason::HookRequest);
    if (!checkpoint_passed(pairings, iteration)) return ends_with(IterTermReason::QualityCheckpointFailed);
    return true;
}

Pairings AlignRun::match(const CPose3D& pose, uint32_t iteration)
{
    return run_matchers(icp_.matchers_, global_, local_, pose, match_context(iteration), state_);
}

std::optional<OptimalTF_Result> AlignRun::solution_of(const Pairings& pairings, uint32_t iteration)
{
    solver_context_.guessRelativePose = pose_;
    solver_context_.icpIteration = iteration;
    solver_context_.variables = match_context(iteration).variables;
    solver_context_.currentCorrectionFromInitialGuess = pose_ - guess_;
    if (before_) solver_context_.lastIcpStepIncrement = pose_ - *before_;
    OptimalTF_Result solution;
    if (!run_solvers(icp_.solvers_, pairings, solution, solver_context_)) return {};
    return solution;
}

bool AlignRun::solve(const Pairings& pairings, uint32_t iteration)
{
    const auto timer = log_.time("solve");
    const auto tle = mrpt::system::CTimeLoggerEntry(*icp_.profiler_, "align.solve");
    const auto solution = solution_of(pairings, iteration);
    if (!solution) return false;
    solution_ = *solution;
    solved_++;
    before_ = pose_;
    pose_ = solution->optimalPose;
    poses_.push_back(pose_);
    return true;
}

bool AlignRun::has_diverged(const CPose3D& pose) const
{
    if (!is_finite(pose)) return true;
    if (!first_gate_) return false;
    const auto moved = pose.composePoint(local_centre_) - guess_.composePoint(local_centre_);
    return moved.norm() > parameters_.maxMotionOverThreshold * *first_gate_;
}

std::optional<AlignRun::Ending> AlignRun::is_ending() const
{
    const auto is_here = [this](const CPose3D& pose)
    {
        const auto [metres, radians] = step_between(pose, pose_);
        return metres < parameters_.minAbsStep_trans && radians < parameters_.minAbsStep_rot;
    };
    for (size_t ago = 1; ago < poses_.size(); ago++)
        if (is_here(poses_[poses_.size() - 1 - ago])) return Ending{ago};
    return std::nullopt;
}

void AlignRun::end(const Ending& ending)
{
    reason_ = ending.period == 1 ? IterTermReason::Stalled : IterTermReason::Cycled;
    if (reason_ == IterTermReason::Stalled) return;
    const double at_gate = gate(last_iteration_).value_or(std::numeric_limits<double>::infinity());
    auto least = costs_at(pose_, at_gate);
    for (size_t i = poses_.size() - ending.period; i + 1 < poses_.size(); i++)
    {
        auto costs = costs_at(poses_[i], at_gate);
        const auto comparison = compare_costs(least, costs);
        if (comparison.to < comparison.from) pose_ = poses_[i], least = std::move(costs);
    }
}

std::optional<uint32_t> AlignRun::next_change(uint32_t iteration) const
{
    const auto now = gate(iteration), then = gate(iteration + 1);
    if (now && then && std::abs(*then - *now) > 0.01 * *now) return iteration + 1;
    std::optional<uint32_t> next;
    const auto consider = [&](uint32_t boundary)
    {
        if (boundary > iteration && (!next || boundary < *next)) next = boundary;
    };
    const auto consider_part = [&](const auto& part)
    {
        if (!part.enabled) return;
        consider(part.runFromIteration);
        if (part.runUpToIteration > 0) consider(part.runUpToIteration + 1);
    };
    for (const auto& m : icp_.matchers_) consider_part(*m);
    for (const auto& s : icp_.solvers_) consider_part(*s);
    return next;
}

bool AlignRun::checkpoint_passed(const Pairings& pairings, uint32_t iteration) const
{
    const auto it = parameters_.quality_checkpoints.find(iteration);
    if (it == parameters_.quality_checkpoints.end()) return true;
    const auto mean = quality_mean(icp_.quality_evaluators_, global_, local_, pose_, pairings,
                                   match_context(iteration), false);
    // What is discarded at the end may still become better.
    return mean.weighted >= it->second * mean.weights;
}

bool AlignRun::hook_stops(const Pairings& pairings, uint32_t iteration) const
{
    if (!icp_.iteration_hook_) return false;
    ICP::IterationHook_Input input;
    input.pcGlobal = &global_, input.pcLocal = &local_;
    input.currentPairings = &pairings, input.currentSolution = &solution_, input.currentIteration = iteration;
    return icp_.iteration_hook_(input).request_stop;
}

void AlignRun::print_iteration(const Pairings& pairings, uint32_t iteration) const
{
    if (!parameters_.debugPrintIterationProgress) return;
    const auto [metres, radians] = step_between(*before_, pose_);
    std::cout << "iteration " << iteration << ": step " << metres << " m, " << mrpt::RAD2DEG(radians)
              << " deg; pose " << pose_.asString() << "; " << pairings.contents_summary() << "\n";
}

// ---- Contexts ---------------------------------------------------------------------------------------------

MatchContext AlignRun::match_context(uint32_t iteration) const
{
    MatchContext context;
    context.icpIteration = iteration;
    context.variables["ICP_ITERATION"] = iteration;
    return context;
}

std::optional<double> AlignRun::gate(uint32_t iteration) const
{
    const MatchContext context = match_context(iteration);
    std::optional<double> largest;
    for (const auto& m : icp_.matchers_)
    {
        if (!m->is_active(context)) continue;
        const auto g = m->gate(context);
        if (g && (!largest || *g > *largest)) largest = g;
    }
    return largest;
}

// ---- The verdict ------------------------------------------------------------------------------------------

std::vector<double> AlignRun::costs_at(const CPose3D& pose, double gate)
{
    std::vector<double> all;
    const MatchContext context = match_context(last_iteration_);
    for (const auto& m : icp_.matchers_)
    {
        if (!m->is_active(context)) continue;
        const auto costs = m->truncated_costs(global_, local_, pose, context, state_, gate);
        all.insert(all.end(), costs.begin(), costs.end());
    }
    return all;
}

void AlignRun::reject(Results& out, Verdict verdict, const std::string& reason) const
{
    out.verdict = verdict;
    out.verdict_reason = reason;
    if (solved_ > 0) out.rejected_pose = offsets_.to_original(pose_);
}

namespace
{
double largest_pair_distance(const Pairings& pairings)
{
    double largest_sq = 0;
    for (const auto& p : pairings.paired_pt2pt)
        largest_sq = std::max(largest_sq, p.errorSquareAfterTransformation);
    return std::sqrt(largest_sq);
}
}  // namespace

void AlignRun::judge(Results& out)
{
    out.terminationReason = reason_;
    out.nIterations = solved_;
    if (diverged_)
        return reject(out, Verdict::diverged,
                      is_finite(pose_) ? "the local cloud moved by more than " +
                                             to_text(parameters_.maxMotionOverThreshold) +
                                             " times the first matching distance"
                                       : "the solver gave a pose that is not finite");
    if (nobody_matched_)
        return reject(out, Verdict::failed,
                      "no matcher of the pipeline is active in iteration " + std::to_string(last_iteration_));
    if (!chance_at_guess_.empty())
        return reject(out, Verdict::no_overlap,
                      "at the guess only " + chance_at_guess_ + " were within the matching distance");
    if (reason_ == IterTermReason::NoPairings)
        return reject(out, Verdict::no_overlap,
                      "no point of the local cloud has a partner within the matching distance");
    if (reason_ == IterTermReason::SolverError)
        return reject(out, Verdict::failed, "no solver of the pipeline could use the pairings");
    if (reason_ == IterTermReason::QualityCheckpointFailed)
        return reject(out, Verdict::failed, "the quality was too low at a checkpoint");

    const MatchContext context = match_context(last_iteration_);
    at_end_ = match(pose_, last_iteration_);
    const auto quality =
        ICP::evaluate_quality(icp_.quality_evaluators_, global_, local_, pose_, at_end_, context);
    if (at_end_.empty() || quality.hard_discard)
    {
        out.terminationReason = IterTermReason::NoPairings;
        return reject(out, Verdict::no_overlap,
                      "only " + std::to_string(at_end_.size()) + " of " +
                          std::to_string(at_end_.potential_pairings) +
                          " possible pairings were found: too little overlap");
    }
    out.verdict = Verdict::aligned;
    out.verdict_reason = "converged, with overlap, and fits no worse than the guess";
}

namespace
{
/// Of the planes that face any direction, so many must agree. At right poses of points against planes 0.7 and
/// more do, of points against points 0.45; of rooms and streets laid on each other 0.35 at most, but for one
/// in 30 (bench-verdicts).
constexpr double LEAST_AGREEMENT = 0.4;

std::string axis_text(const mrpt::math::TVector3D& axis)
{
    const auto two_digits = [](double x) { return to_text(std::round(100 * x) / 100 + 0.0); };
    return "(" + two_digits(axis.x) + " " + two_digits(axis.y) + " " + two_digits(axis.z) + ")";
}

/// Such as `translation along x, rotation about the axis (0.1 0.24 0.97)`.
std::string names_of(const std::vector<FreeTwist>& motions)
{
    std::string all;
    for (const auto& m : motions)
    {
        all += (all.empty() ? "" : ", ") + to_string(m.kind);
        all += m.kind == FreeTwist::Kind::Translation ? " along " : " about ";
        all += !m.name.empty() ? m.name : "the axis " + axis_text(m.axis);
    }
    return all;
}

std::string still_moving(const PoseStep& step, const std::string& when)
{
    char text[120];
    std::snprintf(text, sizeof(text), "still moving by %.3g m and %.3g deg per iteration ", step.metres,
                  mrpt::RAD2DEG(step.radians));
    return text + when;
}
}  // namespace

std::optional<std::string> AlignRun::settle(const std::vector<FreeTwist>& free)
{
    constexpr int ROUNDS = 30;
    pose_ = toward_guess(pose_, guess_, free);
    poses_ = {pose_};
    for (int round = 0; round < ROUNDS && !is_ending(); round++)
    {
        at_end_ = match(pose_, last_iteration_);
        const auto solution = at_end_.empty() ? std::nullopt : solution_of(at_end_, last_iteration_);
        if (!solution)
            return "where " + names_of(free) + " is as in the guess, there is nothing to solve with";
        pose_ = toward_guess(solution->optimalPose, guess_, free);
        poses_.push_back(pose_);
    }
    at_end_ = match(pose_, last_iteration_);
    const PoseStep last = step_between(poses_[poses_.size() - 2], pose_);
    if (is_ending() || !is_large(last)) return {};
    return still_moving(last, "with " + names_of(free) + " as in the guess");
}

bool AlignRun::is_large(const PoseStep& step) const
{
    return step.metres > 10 * parameters_.minAbsStep_trans || step.radians > 10 * parameters_.minAbsStep_rot;
}

std::optional<SurfaceAgreement> AlignRun::disagreement(const SurfacePairings& on) const
{
    const auto is_enough = [](const std::optional<SurfaceAgreement>& least)
    { return !least || least->share >= LEAST_AGREEMENT; };
    // How coarse the local cloud is takes time to find out, and seldom matters.
    if (is_enough(least_agreement(on.distances, 0, on.spacing))) return {};
    const CloudGrain local = grain_of(local_, state_.searched_local_layers);
    const auto least = least_agreement(on.distances, local.thickness, std::max(on.spacing, local.spacing));
    return is_enough(least) ? std::nullopt : least;
}

bool AlignRun::is_worse_than_guess(Results& out)
{
    const double final_gate = gate(last_iteration_).value_or(largest_pair_distance(at_end_));
    // At the pose first: its neighbours are at hand.
    const auto costs_here = costs_at(pose_, final_gate);
    const auto costs = compare_costs(costs_at(guess_, final_gate), costs_here);
    out.cost_at_guess = costs.from, out.cost_at_end = costs.to;
    return costs.has_risen(final_gate);
}

void AlignRun::observe(Results& out)
{
    SurfacePairings on = pairings_on_surfaces(at_end_, global_, state_.searched_global_layers, pose_);
    ObservabilityParameters parameters;
    parameters.feigned = &on.feigned;
    parameters.prior = solver_context_.prior;
    parameters.prior_deviation = gate(last_iteration_).value_or(largest_pair_distance(at_end_));
    Observability seen = observability(on.pairings, pose_, parameters);
    std::optional<std::string> unrest;
    if (!seen.free.empty())
        unrest = settle(seen.free);
    else if (reason_ == IterTermReason::MaxIterations && before_ && is_large(step_between(*before_, pose_)))
        unrest = still_moving(step_between(*before_, pose_), "after maxIterations; allow more");
    // Not before: where the maps leave a motion free, the iterations may have gone far along it.
    if (is_worse_than_guess(out))
        return reject(out, Verdict::worse_than_guess,
                      "the mean truncated squared distance rose from " + to_text(out.cost_at_guess) +
                          " m^2 at the guess to " + to_text(out.cost_at_end) + " m^2");
    if (const auto least = disagreement(on))
        return reject(out, Verdict::failed,
                      "of the surfaces that face " + axis_text(to_mrpt(least->axis)) + ", only " +
                          to_text(std::round(100 * least->share)) +
                          " % agree: a wrong pose, or another place");
    if (unrest) return reject(out, Verdict::failed, *unrest);
    out.unobservable = seen.free;
    for (auto& twist : out.unobservable)
        if (twist.kind != FreeTwist::Kind::Translation) twist.through += offsets_.global();
    if (!seen.free.empty() || !offsets_.none())
    {
        // Of the pose that is returned. (Shifted coordinates are doubles, exact: nothing was rounded there.)
        on.pairings = offsets_.to_original(on.pairings), on.feigned = offsets_.to_original(on.feigned);
        parameters.prior = original_prior_, parameters.sigma = seen.sigma;
        if (!offsets_.none()) parameters.coordinate_rounding = 0.0;
        seen = observability(on.pairings, offsets_.to_original(pose_), parameters);
    }
    out.optimal_tf.cov = seen.covariance;
    out.information = seen.information;
    if (out.unobservable.empty()) return;
    out.verdict = Verdict::under_constrained;
    out.verdict_reason = "what both maps show does not determine " + names_of(out.unobservable);
}

void AlignRun::describe_returned_pose(Results& out)
{
    if (out.verdict == Verdict::aligned) observe(out);
    const bool found = out.verdict == Verdict::aligned || out.verdict == Verdict::under_constrained;
    const CPose3D stored = found ? pose_ : guess_;
    out.optimal_tf.mean = found ? offsets_.to_original(pose_) : original_guess_;
    const MatchContext context = match_context(last_iteration_);
    const Pairings pairings = found ? at_end_ : match(stored, last_iteration_);
    out.local_points_used = pairings.potential_pairings;
    if (pairings.potential_pairings > 0)
        out.overlap = std::min(
            1.0, static_cast<double>(pairings.size()) / static_cast<double>(pairings.potential_pairings));
    if (out.verdict != Verdict::no_overlap)
        out.quality =
            ICP::evaluate_quality(icp_.quality_evaluators_, global_, local_, stored, pairings, context)
                .quality;
    out.residual_rms = residual_rms(pairings, stored);
    out.finalPairings = offsets_.to_original(pairings);
    if (found) return;
    out.optimal_tf.cov.setZero();
    for (int i = 0; i < 6; i++) out.optimal_tf.cov(i, i) = std::numeric_limits<double>::infinity();
}

}  // namespace mp2p_icp
