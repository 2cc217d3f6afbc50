#include <mp2p_icp/LogRecord.h>
#include <mp2p_icp/errors.h>
#include <mrpt/math/matrix_serialization.h>
#include <mrpt/serialization/CArchive.h>
#include <mrpt/serialization/stl_serialization.h>

#include <stdexcept>

#include "compact_pairings.h"
#include "log_version.h"

/** \file log_serialization.cpp
 * The layout is that of docs/formats.md. Doubles are written as they are, so that a run can be repeated to
 * the bit.
 */
IMPLEMENTS_SERIALIZABLE(LogRecord, mrpt::serialization::CSerializable, mp2p_icp)

namespace mp2p_icp
{
using mrpt::serialization::CArchive;

namespace
{
void put(CArchive& out, const mrpt::math::CMatrixDouble66& m)
{
    for (int r = 0; r < 6; r++)
        for (int c = 0; c < 6; c++) out << m(r, c);
}
void get(CArchive& in, mrpt::math::CMatrixDouble66& m)
{
    for (int r = 0; r < 6; r++)
        for (int c = 0; c < 6; c++) in >> m(r, c);
}

void put(CArchive& out, const IterationRecord& i)
{
    out.WriteAs<uint32_t>(i.iteration);
    out << i.pose << i.step_trans << i.step_rot << i.gate;
    for (const uint64_t count : i.pairings) out << count;
    out << i.potential_pairings << i.cost << i.residual_rms;
    out.WriteAs<int32_t>(i.rank);
}
void get(CArchive& in, IterationRecord& i)
{
    i.iteration = in.ReadAs<uint32_t>();
    in >> i.pose >> i.step_trans >> i.step_rot >> i.gate;
    for (uint64_t& count : i.pairings) in >> count;
    in >> i.potential_pairings >> i.cost >> i.residual_rms;
    i.rank = in.ReadAs<int32_t>();
}

void put(CArchive& out, const RunEnvironment& e)
{
    out << e.library_version << e.mrpt_version << e.compiler << e.processor << e.threads;
}
void get(CArchive& in, RunEnvironment& e)
{
    in >> e.library_version >> e.mrpt_version >> e.compiler >> e.processor >> e.threads;
}

/// Not as YAML: what a program sets may be outside of what a file may say.
void put(CArchive& out, const Parameters& p)
{
    out << p.maxIterations << p.minAbsStep_trans << p.minAbsStep_rot << p.maxMotionOverThreshold
        << p.quality_checkpoints << p.debugPrintIterationProgress << p.generateDebugFiles
        << p.debugFileNameFormat << p.decimationDebugFiles << p.saveIterationDetails
        << p.decimationIterationDetails;
}
void get(CArchive& in, Parameters& p)
{
    p = Parameters();
    in >> p.maxIterations >> p.minAbsStep_trans >> p.minAbsStep_rot >> p.maxMotionOverThreshold >>
        p.quality_checkpoints >> p.debugPrintIterationProgress >> p.generateDebugFiles >>
        p.debugFileNameFormat >> p.decimationDebugFiles >> p.saveIterationDetails >>
        p.decimationIterationDetails;
}

void put_details(CArchive& out, const LogRecord& log)
{
    out << log.iterationsDetails.has_value();
    if (!log.iterationsDetails) return;
    out.WriteAs<uint64_t>(log.iterationsDetails->size());
    CompactPairingsWriter pairings(*log.pcGlobal, *log.pcLocal);
    for (const auto& [iteration, details] : *log.iterationsDetails)
    {
        out.WriteAs<uint64_t>(iteration);
        out << details.optimalPose;
        pairings.write(out, details.pairings);
    }
}

/// Lists grow as their items arrive: counts are not to be believed before.
void get_details(CArchive& in, LogRecord& log)
{
    log.iterationsDetails.reset();
    if (!in.ReadAs<bool>()) return;
    log.iterationsDetails.emplace();
    CompactPairingsReader pairings(*log.pcGlobal, *log.pcLocal);
    for (auto left = in.ReadAs<uint64_t>(); left > 0; left--)
    {
        auto& details = (*log.iterationsDetails)[in.ReadAs<uint64_t>()];
        in >> details.optimalPose;
        details.pairings = pairings.read(in);
    }
}
}  // namespace

uint8_t LogRecord::serializeGetVersion() const
{
    return LOG_VERSION;
}

void LogRecord::serializeTo(CArchive& out) const
{
    if (!pcGlobal || !pcLocal) throw std::invalid_argument("LogRecord: both maps must be there");
    icpResult.serializeTo(out);
    out << *pcGlobal << *pcLocal << globalWasEdited << localWasEdited;
    out << initialGuessLocalWrtGlobal << prior.has_value();
    if (prior) out << prior->mean, put(out, prior->cov_inv);
    put(out, icpParameters);
    pipeline.serializeTo(out);
    out << dynamicVariables;
    out.WriteAs<uint64_t>(iterations.size());
    for (const auto& i : iterations) put(out, i);
    put_details(out, *this);
    out << timings_s;
    put(out, environment);
}

void LogRecord::serializeFrom(CArchive& in, uint8_t version)
{
    if (version != LOG_VERSION)
        throw DataError("ICP log", "", "version " + std::to_string(LOG_VERSION),
                        "version " + std::to_string(version));
    icpResult.serializeFrom(in);
    auto global = std::make_shared<metric_map_t>(), local = std::make_shared<metric_map_t>();
    in >> *global >> *local >> globalWasEdited >> localWasEdited;
    pcGlobal = global, pcLocal = local;
    in >> initialGuessLocalWrtGlobal;
    prior.reset();
    if (in.ReadAs<bool>()) in >> prior.emplace().mean, get(in, prior->cov_inv);
    get(in, icpParameters);
    pipeline.serializeFrom(in);
    in >> dynamicVariables;
    iterations.clear();
    for (auto left = in.ReadAs<uint64_t>(); left > 0; left--) get(in, iterations.emplace_back());
    get_details(in, *this);
    in >> timings_s;
    get(in, environment);
}

}  // namespace mp2p_icp
