#include <mp2p_icp/ICP.h>
#include <mp2p_icp/diagnosis.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/map_offsets.h>
#include <mp2p_icp/se3.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "diagnosis_search.h"
#include "diagnosis_text.h"

/** \file diagnosis.cpp
 * How the cause is found. What can be seen at once comes first: no points, points that are not finite, too
 * few points, a free motion. Then search_cause() asks whether the maps lie on
 * each other elsewhere than where the run ended. If nowhere: they show different places, or lie apart.
 *
 * The limits here:
 *  - FEWEST_POINTS: a pose has six unknowns, and a pair of points three residuals. With 20 pairs each
 * unknown has ten residuals, enough to tell a wrong pose by them.
 *  - NONFINITE_SHARE: from a half on, most of what the sensor gave is no measurement.
 *  - LIE_ON_EACH_OTHER: with less, search_cause() takes two maps for different places, too.
 *  - APART: two maps that lie on each other in the wrong way still share a tenth of their points, by chance.
 */
namespace mp2p_icp
{
using mrpt::poses::CPose3D;
using Cause = DiagnosisCause;

namespace
{
constexpr size_t FEWEST_POINTS = 20;
constexpr double NONFINITE_SHARE = 0.5, APART = 0.1, LIE_ON_EACH_OTHER = 0.55;

/// What is seen without trying anything.
std::optional<Cause> plain_cause(const Results& results, const PointCount& local, const PointCount& global)
{
    for (const PointCount* c : {&local, &global})
        if (c->finite == 0) return c->all == 0 ? Cause::EmptyMap : Cause::NonFinitePoints;
    const auto mostly_not_finite = [](const PointCount& c)
    { return static_cast<double>(c.all - c.finite) >= NONFINITE_SHARE * static_cast<double>(c.all); };
    for (const PointCount* c : {&local, &global})
        if (mostly_not_finite(*c) && (c->finite < FEWEST_POINTS || !results.trusted()))
            return Cause::NonFinitePoints;
    for (const PointCount* c : {&local, &global})
        if (c->finite < FEWEST_POINTS) return Cause::TooFewPoints;
    if (results.verdict == Verdict::under_constrained) return Cause::FreeMotion;
    return {};
}

/// The largest matching distance at an iteration; infinite: none.
double gate_at(const LogRecord& log, uint32_t iteration)
{
    MatchContext context;
    context.icpIteration = iteration;
    context.variables["ICP_ITERATION"] = iteration;
    double largest = 0;
    const auto icp = log.pipeline.make();
    for (const auto& m : icp->matchers())
        if (m->is_active(context))
            largest = std::max(largest, m->gate(context).value_or(std::numeric_limits<double>::infinity()));
    return largest;
}

RunEnds ends_of(const LogRecord& log)
{
    const Results& r = log.icpResult;
    const MapOffsets offsets(*log.pcLocal, *log.pcGlobal);
    RunEnds out;
    out.guess = offsets.to_stored(CPose3D(log.initialGuessLocalWrtGlobal));
    const bool rejected = r.rejected_pose && is_finite(*r.rejected_pose);
    out.found = offsets.to_stored(rejected ? *r.rejected_pose : r.optimal_tf.mean);
    out.first_gate = gate_at(log, 0);
    out.last_gate = log.iterations.empty() ? out.first_gate : log.iterations.back().gate;
    out.trusted = r.trusted();
    out.ran_out = r.verdict == Verdict::failed && r.terminationReason == IterTermReason::MaxIterations;
    return out;
}

void look(const LogRecord& log, Diagnosis& out, DiagnosisFacts& facts)
{
    out.free = log.icpResult.unobservable;
    const MatchedLayers layers = matched_layers(log);
    facts.local = count_points(layers.local), facts.global = count_points(layers.global);
    facts.local.layer = layers.local_name, facts.global.layer = layers.global_name;
    auto plain = plain_cause(log.icpResult, facts.local, facts.global);
    facts.run = ends_of(log);
    if (facts.local.finite > 0 && facts.global.finite > 0)
    {
        const MapFit maps(*layers.global, *layers.local);
        facts.nearby = maps.nearby();
        out.overlap = maps.share(facts.run.found);
        facts.overlap_at_guess = maps.share(facts.run.guess);
        // Where the maps do not lie on each other, free motions are those of a wrong pose.
        const bool is_sure = plain && (*plain != Cause::FreeMotion || out.overlap >= LIE_ON_EACH_OTHER);
        if (!is_sure) plain.reset();
        if (!plain) out.cause = search_cause(maps, facts.run, out);
        if (out.free.empty()) out.free = maps.free_motions(facts.run.found);
        if (out.cause == Cause::AllIsWell && !out.free.empty()) out.cause = Cause::FreeMotion;
        if (out.better_pose) facts.missed_by = maps.displacement(facts.run.guess, *out.better_pose);
    }
    if (plain) out.cause = *plain;
    if (out.cause == Cause::Unknown)
        out.cause =
            std::max(out.overlap, facts.overlap_at_guess) < APART ? Cause::NoOverlap : Cause::DifferentPlaces;
}
}  // namespace

Diagnosis diagnose(const LogRecord& log)
{
    if (!log.pcLocal || !log.pcGlobal) throw std::invalid_argument("diagnose: the log lacks a map");
    Diagnosis out;
    DiagnosisFacts facts;
    try
    {
        look(log, out, facts);
    }
    catch (const std::exception& e)  // a pipeline that this program cannot make, for example
    {
        out.cause = Cause::Unknown;
        facts.trouble = short_reason(e);
    }
    out.sentences = sentences_for(log, out, facts);
    return out;
}

}  // namespace mp2p_icp
