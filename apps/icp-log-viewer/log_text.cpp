#include "log_text.h"

#include <mp2p_icp/se3.h>
#include <mrpt/core/bits_math.h>

#include <cmath>
#include <cstdio>

namespace mp2p_icp_apps
{
using mp2p_icp::LogMoment;
using mp2p_icp::LogRecord;
using mrpt::RAD2DEG;

namespace
{
std::string number(double value, const char* format = "%.4g")
{
    char text[48];
    std::snprintf(text, sizeof(text), format, value);
    const std::string shown = text;
    const bool is_zero = shown.find_first_not_of("-0.") == std::string::npos;
    return is_zero && shown[0] == '-' ? shown.substr(1) : shown;
}

/// Largest over smallest eigenvalue; what is infinite or not positive has none.
std::string condition_text(const Eigen::MatrixXd& covariance)
{
    if (!covariance.allFinite()) return "-";
    const Eigen::VectorXd eigenvalues =
        Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(covariance).eigenvalues();
    const double least = eigenvalues(0), most = eigenvalues(eigenvalues.size() - 1);
    return least > 0 ? number(most / least, "%.3g") : "-";
}

Eigen::MatrixXd block(const Eigen::Matrix<double, 6, 6>& covariance, const std::vector<int>& of)
{
    const auto size = static_cast<Eigen::Index>(of.size());
    Eigen::MatrixXd part(size, size);
    for (Eigen::Index r = 0; r < size; r++)
        for (Eigen::Index c = 0; c < size; c++)
            part(r, c) = covariance(of[static_cast<size_t>(r)], of[static_cast<size_t>(c)]);
    return part;
}

void append_uncertainty(TextLines& lines, const Eigen::Matrix<double, 6, 6>& covariance)
{
    const auto sigma = [&](int i) { return std::sqrt(covariance(i, i)); };
    lines.push_back("sigma x y z: " + number(sigma(0), "%.3g") + " " + number(sigma(1), "%.3g") + " " +
                    number(sigma(2), "%.3g") + " m");
    lines.push_back("sigma yaw pitch roll: " + number(RAD2DEG(sigma(3)), "%.3g") + " " +
                    number(RAD2DEG(sigma(4)), "%.3g") + " " + number(RAD2DEG(sigma(5)), "%.3g") + " deg");
    lines.push_back("det of covariance: " + number(covariance.determinant(), "%.3g"));
    lines.push_back("condition XYZ " + condition_text(block(covariance, {0, 1, 2})) + ", SO3 " +
                    condition_text(block(covariance, {3, 4, 5})));
    lines.push_back("condition SE2 " + condition_text(block(covariance, {0, 1, 3})) + ", SE3 " +
                    condition_text(covariance));
}

void append_free_motions(TextLines& lines, const std::vector<mp2p_icp::FreeTwist>& twists)
{
    for (const auto& t : twists)
        lines.push_back("free: " + to_string(t.kind) + (t.name.empty() ? "" : " " + t.name) + " along [" +
                        number(t.axis.x, "%.2g") + " " + number(t.axis.y, "%.2g") + " " +
                        number(t.axis.z, "%.2g") + "]");
}

void append(TextLines& lines, const TextLines& more)
{
    for (const auto& line : more) lines.push_back("  " + line);
}
}  // namespace

TextLines pose_lines(const mrpt::poses::CPose3D& p)
{
    return {
        "x " + number(p.x(), "%.4f") + "  y " + number(p.y(), "%.4f") + "  z " + number(p.z(), "%.4f") + " m",
        "yaw " + number(RAD2DEG(p.yaw()), "%.3f") + "  pitch " + number(RAD2DEG(p.pitch()), "%.3f") +
            "  roll " + number(RAD2DEG(p.roll()), "%.3f") + " deg"};
}

TextLines summary_lines(const LogRecord& log)
{
    const auto& r = log.icpResult;
    TextLines lines{
        "verdict: " + to_string(r.verdict), "  " + r.verdict_reason,
        "quality " + number(100 * r.quality, "%.1f") + " %, residual rms " + number(r.residual_rms, "%.3g") +
            " m",
        std::to_string(r.nIterations) + " iterations, ended by " + to_string(r.terminationReason)};
    lines.emplace_back("result:");
    append(lines, pose_lines(r.optimal_tf.mean));
    if (r.rejected_pose) lines.emplace_back("rejected:"), append(lines, pose_lines(*r.rejected_pose));
    const mrpt::poses::CPose3D guess(log.initialGuessLocalWrtGlobal);
    lines.emplace_back("guess:");
    append(lines, pose_lines(guess));
    const auto change = r.optimal_tf.mean - guess;
    lines.push_back("change: " + number(mp2p_icp::translation_of(change).norm(), "%.4g") + " m, " +
                    number(RAD2DEG(mp2p_icp::rotation_angle(mp2p_icp::rotation_of(change))), "%.4g") +
                    " deg");
    append_uncertainty(lines, r.optimal_tf.cov.asEigen());
    append_free_motions(lines, r.unobservable);
    return lines;
}

TextLines variable_lines(const LogRecord& log, size_t at_most)
{
    TextLines lines;
    for (const auto& [name, value] : log.dynamicVariables)
    {
        if (lines.size() == at_most) break;
        lines.push_back(name + " = " + number(value, "%.6g"));
    }
    if (lines.empty()) lines.emplace_back("the run had no variables");
    return lines;
}

TextLines pairing_lines(const LogRecord& log, const LogMoment& moment)
{
    bool stored = false;
    const auto* p = pairings_at(log, moment, stored);
    if (!p) return {"no pairings were logged", "at this pose"};
    TextLines lines;
    for (const auto& [name, count] : {std::pair("point-point", p->paired_pt2pt.size()),
                                      {"point-line", p->paired_pt2ln.size()},
                                      {"point-plane", p->paired_pt2pl.size()},
                                      {"line-line", p->paired_ln2ln.size()},
                                      {"plane-plane", p->paired_pl2pl.size()}})
        lines.push_back(std::string(name) + ": " + std::to_string(count));
    lines.push_back("all: " + std::to_string(p->size()) + " of " + std::to_string(p->potential_pairings));
    return lines;
}

}  // namespace mp2p_icp_apps
