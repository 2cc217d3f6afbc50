#include "report_text.h"

#include <mrpt/core/bits_math.h>

#include <iomanip>
#include <locale>
#include <ostream>
#include <sstream>

namespace mp2p_icp_apps
{
using mp2p_icp::Results;

namespace
{
/// A number for people: so many digits after the point.
std::string fixed(double value, int digits)
{
    std::ostringstream s;
    s.imbue(std::locale::classic());
    s << std::fixed << std::setprecision(digits) << value;
    const bool is_zero = s.str().find_first_not_of("-0.") == std::string::npos;
    return is_zero && s.str()[0] == '-' ? s.str().substr(1) : s.str();
}

/// A length or angle of unknown size for people: 4 significant digits.
std::string short_number(double value)
{
    std::ostringstream s;
    s.imbue(std::locale::classic());
    s << std::setprecision(4) << value;
    return s.str();
}

template <class Vector>
std::string vector_text(const Vector& v)
{
    return "[" + short_number(v.x) + " " + short_number(v.y) + " " + short_number(v.z) + "]";
}
}  // namespace

void print_free_motion(std::ostream& out, const mp2p_icp::FreeTwist& t)
{
    const bool shift = t.kind == mp2p_icp::FreeTwist::Kind::Translation;
    out << "  free motion:  " << to_string(t.kind) << (t.name.empty() ? "" : " " + t.name) << " along "
        << vector_text(t.axis);
    if (!shift) out << " through " << vector_text(t.through);
    out << ", sigma " << short_number(t.sigma) << (shift ? " m" : " rad") << "\n";
}

std::string verdict_line(const Results& results)
{
    return to_string(results.verdict) + ": " + results.verdict_reason;
}

std::string pose_line(const mrpt::poses::CPose3D& p)
{
    using mrpt::RAD2DEG;
    return "x=" + fixed(p.x(), 4) + " y=" + fixed(p.y(), 4) + " z=" + fixed(p.z(), 4) +
           " m, yaw=" + fixed(RAD2DEG(p.yaw()), 4) + " pitch=" + fixed(RAD2DEG(p.pitch()), 4) +
           " roll=" + fixed(RAD2DEG(p.roll()), 4) + " deg";
}

void print_input(std::ostream& out, const std::string& side, const mp2p_icp::LoadReport& report,
                 const mp2p_icp::metric_map_t& map)
{
    out << side << ": " << report.source << "\n  read as " << report.kind << ": " << report.points_read
        << " points";
    if (report.points_dropped_nonfinite > 0)
        out << ", " << report.points_dropped_nonfinite << " of them dropped for not being finite";
    out << "\n";
    for (const auto& note : report.notes) out << "  note: " << note << "\n";
    out << "  contents: " << map.contents_summary() << "\n";
}

void print_result(std::ostream& out, const AlignmentRecord& record)
{
    const Results& r = record.results;
    out << "ICP result: " << verdict_line(r) << "\n";
    const bool found =
        r.verdict == mp2p_icp::Verdict::aligned || r.verdict == mp2p_icp::Verdict::under_constrained;
    out << "  pose of local wrt global: " << pose_line(r.optimal_tf.mean) << (found ? "" : " (the guess)")
        << "\n";
    if (r.rejected_pose) out << "  rejected pose: " << pose_line(*r.rejected_pose) << "\n";
    out << "  quality:      " << fixed(100 * r.quality, 1) << " %\n"
        << "  iterations:   " << r.nIterations << ", ended by " << to_string(r.terminationReason) << "\n"
        << "  pairings:     " << r.finalPairings.contents_summary() << "\n"
        << "  residual rms: " << short_number(r.residual_rms) << " m\n";
    for (const auto& twist : r.unobservable) print_free_motion(out, twist);
    if (record.error)
        out << "  error:        " << short_number(record.error->translation_m) << " m, "
            << short_number(record.error->rotation_deg) << " deg (against the ground truth)\n";
    const StageTimes& t = record.time_s;
    out << "  time:         " << fixed(t.align, 3) << " s to align (reading " << fixed(t.load, 3)
        << " s, filters " << fixed(t.filters, 3) << " s)\n";
}

}  // namespace mp2p_icp_apps
