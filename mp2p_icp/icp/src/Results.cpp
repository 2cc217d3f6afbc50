#include <mp2p_icp/Results.h>
#include <mp2p_icp/errors.h>
#include <mrpt/core/bits_math.h>
#include <mrpt/math/matrix_serialization.h>
#include <mrpt/serialization/CArchive.h>

#include <ostream>

namespace mp2p_icp
{
void Results::print(std::ostream& out) const
{
    const auto& p = optimal_tf.mean;
    out << "verdict: " << to_string(verdict) << " (" << verdict_reason << ")\n"
        << "pose of local wrt global: x=" << p.x() << " y=" << p.y() << " z=" << p.z()
        << " m, yaw=" << mrpt::RAD2DEG(p.yaw()) << " pitch=" << mrpt::RAD2DEG(p.pitch())
        << " roll=" << mrpt::RAD2DEG(p.roll()) << " deg\n"
        << "quality: " << 100 * quality << " %, overlap: " << 100 * overlap
        << " %, iterations: " << nIterations << ", ended by: " << to_string(terminationReason) << "\n"
        << "final pairings: " << finalPairings.contents_summary() << ", residual rms " << residual_rms
        << " m\n";
}

namespace
{
constexpr uint8_t RESULTS_VERSION = 2;  // 1: information_ratio of twists; 2: their pitch, overlap

void put(mrpt::serialization::CArchive& out, const FreeTwist& t)
{
    out.WriteAs<uint8_t>(static_cast<uint8_t>(t.kind));
    out << t.axis.x << t.axis.y << t.axis.z << t.through.x << t.through.y << t.through.z << t.sigma << t.name
        << t.information_ratio << t.pitch;
}
FreeTwist get_twist(mrpt::serialization::CArchive& in, uint8_t version)
{
    FreeTwist t;
    t.kind = static_cast<FreeTwist::Kind>(in.ReadAs<uint8_t>());
    in >> t.axis.x >> t.axis.y >> t.axis.z >> t.through.x >> t.through.y >> t.through.z >> t.sigma >> t.name;
    if (version >= 1) in >> t.information_ratio;
    if (version >= 2) in >> t.pitch;
    return t;
}
}  // namespace

void Results::serializeTo(mrpt::serialization::CArchive& out) const
{
    out.WriteAs<uint8_t>(RESULTS_VERSION);
    out << optimal_tf << information << optimalScale;
    out.WriteAs<uint8_t>(static_cast<uint8_t>(verdict));
    out << verdict_reason << rejected_pose.has_value();
    if (rejected_pose) out << *rejected_pose;
    out.WriteAs<uint32_t>(unobservable.size());
    for (const auto& t : unobservable) put(out, t);
    out.WriteAs<uint64_t>(nIterations);
    out.WriteAs<uint8_t>(static_cast<uint8_t>(terminationReason));
    out << quality << residual_rms << cost_at_guess << cost_at_end << local_points_used << finalPairings
        << overlap;
}

void Results::serializeFrom(mrpt::serialization::CArchive& in)
{
    const auto version = in.ReadAs<uint8_t>();
    if (version > RESULTS_VERSION)
        throw DataError("ICP results", "", "version 0 to " + std::to_string(RESULTS_VERSION),
                        "version " + std::to_string(version));
    in >> optimal_tf >> information >> optimalScale;
    verdict = static_cast<Verdict>(in.ReadAs<uint8_t>());
    bool rejected = false;
    in >> verdict_reason >> rejected;
    rejected_pose.reset();
    if (rejected) in >> rejected_pose.emplace();
    unobservable.clear();
    for (auto left = in.ReadAs<uint32_t>(); left > 0; left--) unobservable.push_back(get_twist(in, version));
    nIterations = in.ReadAs<uint64_t>();
    terminationReason = static_cast<IterTermReason>(in.ReadAs<uint8_t>());
    in >> quality >> residual_rms >> cost_at_guess >> cost_at_end >> local_points_used >> finalPairings;
    if (version >= 2) in >> overlap;
}

}  // namespace mp2p_icp
