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
constexpr uint8_t RESULTS_VERSION = 3;

void put(mrpt::serialization::CArchive& out, const FreeTwist& t)
{
    out.WriteAs<uint8_t>(static_cast<uint8_t>(t.kind));
    out << t.axis.x << t.axis.y << t.axis.z << t.through.x << t.through.y << t.through.z << t.sigma << t.name
        << t.information_ratio << t.pitch;
}
FreeTwist get_twist(mrpt::serialization::CArchive& in)
{
    FreeTwist t;
    t.kind = static_cast<FreeTwist::Kind>(in.ReadAs<uint8_t>());
    in >> t.axis.x >> t.axis.y >> t.axis.z >> t.through.x >> t.through.y >> t.through.z >> t.sigma >>
        t.name >> t.information_ratio >> t.pitch;
    return t;
}
}  // namespace

void Results::serializeTo(mrpt::serialization::CArchive& out) const
{
    out.WriteAs<uint8_t>(RESULTS_VERSION);
    out.WriteAs<uint8_t>(static_cast<uint8_t>(verdict));
    out << quality;
    out << optimal_tf << information << optimalScale << verdict_reason << rejected_pose.has_value();
    if (rejected_pose) out << *rejected_pose;
    out.WriteAs<uint32_t>(unobservable.size());
    for (const auto& t : unobservable) put(out, t);
    out.WriteAs<uint64_t>(nIterations);
    out.WriteAs<uint8_t>(static_cast<uint8_t>(terminationReason));
    out << residual_rms << cost_at_guess << cost_at_end << local_points_used << overlap << finalPairings;
}

void Results::serializeFrom(mrpt::serialization::CArchive& in)
{
    if (const auto version = in.ReadAs<uint8_t>(); version != RESULTS_VERSION)
        throw DataError("ICP results", "", "version " + std::to_string(RESULTS_VERSION),
                        "version " + std::to_string(version));
    verdict = static_cast<Verdict>(in.ReadAs<uint8_t>());
    in >> quality >> optimal_tf >> information >> optimalScale;
    bool rejected = false;
    in >> verdict_reason >> rejected;
    rejected_pose.reset();
    if (rejected) in >> rejected_pose.emplace();
    unobservable.clear();
    for (auto left = in.ReadAs<uint32_t>(); left > 0; left--) unobservable.push_back(get_twist(in));
    nIterations = in.ReadAs<uint64_t>();
    terminationReason = static_cast<IterTermReason>(in.ReadAs<uint8_t>());
    in >> residual_rms >> cost_at_guess >> cost_at_end >> local_points_used >> overlap >> finalPairings;
}

}  // namespace mp2p_icp
