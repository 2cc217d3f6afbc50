#include "result_yaml.h"

#include <mp2p_icp/se3.h>
#include <mp2p_icp/version.h>
#include <mrpt/core/bits_math.h>
#include <mrpt/system/os.h>

#include <charconv>
#include <cmath>
#include <initializer_list>

#include "pose_text.h"

namespace mp2p_icp_apps
{
using mp2p_icp::Results;
using mrpt::poses::CPose3D;

PoseError pose_error(const CPose3D& pose, const CPose3D& truth, const mrpt::math::TPoint3D& local_offset)
{
    const Eigen::Matrix3d R = mp2p_icp::rotation_of(pose), R_true = mp2p_icp::rotation_of(truth);
    // The lever arm acts on the small difference, not on the large poses: nothing cancels.
    const Eigen::Vector3d shift = mp2p_icp::translation_of(pose) - mp2p_icp::translation_of(truth) +
                                  (R - R_true) * mp2p_icp::to_eigen(local_offset);
    return {shift.norm(), mrpt::RAD2DEG(mp2p_icp::rotation_angle(R_true.transpose() * R))};
}

// ---- Values -----------------------------------------------------------------------------------------------
namespace
{
std::string number(double value)
{
    if (std::isnan(value)) return ".nan";
    if (std::isinf(value)) return value > 0 ? ".inf" : "-.inf";
    char buffer[40];
    const auto end =
        std::to_chars(buffer, buffer + sizeof(buffer), value, std::chars_format::general, 17).ptr;
    std::string text(buffer, end);
    // YAML 1.1 takes 1e-05 for text: it wants a point.
    const auto exponent = text.find('e');
    if (exponent != std::string::npos && text.find('.') == std::string::npos) text.insert(exponent, ".0");
    return text;
}

/// A double-quoted YAML string.
std::string quoted(const std::string& text)
{
    std::string out = "\"";
    for (const char c : text)
    {
        if (c == '"' || c == '\\') out += '\\';
        const bool is_control = static_cast<unsigned char>(c) < 0x20;
        out += is_control ? ' ' : c;
    }
    return out + "\"";
}

std::string list(std::initializer_list<double> values)
{
    std::string out;
    for (const double v : values) out += (out.empty() ? "" : ", ") + number(v);
    return "[" + out + "]";
}

// ---- Parts ------------------------------------------------------------------------------------------------

template <class Matrix>
std::string matrix(const std::string& key, const Matrix& m)
{
    std::string out = key + ":\n";
    for (int r = 0; r < m.rows(); r++)
    {
        out += "  - [";
        for (int c = 0; c < m.cols(); c++) out += (c ? ", " : "") + number(m(r, c));
        out += "]\n";
    }
    return out;
}

std::string pose(const std::string& key, const CPose3D& p)
{
    return key + ": {x: " + number(p.x()) + ", y: " + number(p.y()) + ", z: " + number(p.z()) +
           ", yaw_deg: " + number(degrees_of(p.yaw())) + ", pitch_deg: " + number(degrees_of(p.pitch())) +
           ", roll_deg: " + number(degrees_of(p.roll())) + "}\n";
}

std::string unobservable(const std::vector<mp2p_icp::FreeTwist>& twists)
{
    if (twists.empty()) return "unobservable: []\n";
    std::string out = "unobservable:\n";
    for (const auto& t : twists)
    {
        out += "  - {kind: " + to_string(t.kind) + ", axis: " + list({t.axis.x, t.axis.y, t.axis.z}) +
               ", through: " + list({t.through.x, t.through.y, t.through.z}) + ", sigma: " + number(t.sigma);
        out += (t.name.empty() ? "" : ", name: " + quoted(t.name)) +
               "}\n";  // a bare y is a truth value to YAML 1.1
    }
    return out;
}

std::string pairings(const mp2p_icp::Pairings& p)
{
    const auto count = [](const auto& pairs) { return std::to_string(pairs.size()); };
    return "pairings: {pt2pt: " + count(p.paired_pt2pt) + ", pt2ln: " + count(p.paired_pt2ln) +
           ", pt2pl: " + count(p.paired_pt2pl) + ", ln2ln: " + count(p.paired_ln2ln) +
           ", pl2pl: " + count(p.paired_pl2pl) + "}\n";
}

std::string points(const std::string& side, const InputSummary& in)
{
    return "  " + side + ": {read: " + std::to_string(in.report.points_read) +
           ", dropped_nonfinite: " + std::to_string(in.report.points_dropped_nonfinite) +
           ", used: " + std::to_string(in.points_used) + "}\n";
}

std::string times(const StageTimes& t)
{
    return "time_s: {load: " + number(t.load) + ", filters: " + number(t.filters) +
           ", align: " + number(t.align) + ", total: " + number(t.total) + "}\n";
}

std::string what_was_found(const Results& r)
{
    std::string out = "verdict: " + to_string(r.verdict) + "\n";
    out += "verdict_reason: " + quoted(r.verdict_reason) + "\n";
    out += pose("pose", r.optimal_tf.mean);
    out += matrix("T_global_local", r.optimal_tf.mean.getHomogeneousMatrixVal<mrpt::math::CMatrixDouble44>());
    if (r.rejected_pose) out += pose("rejected_pose", *r.rejected_pose);
    out += matrix("covariance", r.optimal_tf.cov);
    out += unobservable(r.unobservable);
    out += "quality: " + number(r.quality) + "\n";
    out += "iterations: " + std::to_string(r.nIterations) + "\n";
    out += "termination: " + to_string(r.terminationReason) + "\n";
    out += pairings(r.finalPairings);
    out += "residual_rms: " + number(r.residual_rms) + "\n";
    return out;
}
}  // namespace

std::string result_yaml(const AlignmentRecord& record)
{
    std::string out = what_was_found(record.results);
    out += "points:\n" + points("local", record.local) + points("global", record.global);
    out += times(record.time_s);
    if (record.error)
        out += "error: {translation_m: " + number(record.error->translation_m) +
               ", rotation_deg: " + number(record.error->rotation_deg) + "}\n";
    out += "versions: {mp2p_icp: " + quoted(MP2P_ICP_VERSION) +
           ", mrpt: " + quoted(mrpt::system::MRPT_getVersion()) + "}\n";
    return out;
}

}  // namespace mp2p_icp_apps
