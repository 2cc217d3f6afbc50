#include "diagnosis_text.h"

#include <mp2p_icp/se3.h>
#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <cmath>
#include <locale>
#include <sstream>

namespace mp2p_icp
{
using Cause = DiagnosisCause;
using mrpt::poses::CPose3D;

namespace
{
/// For people: 3 significant digits.
std::string number(double value)
{
    std::ostringstream s;
    s.imbue(std::locale::classic());
    s.precision(3);
    s << value;
    return s.str();
}
std::string percent(double share)
{
    return number(std::round(100 * share)) + " %";
}

/// To a tenth of a millimetre, and as fine in degrees.
std::string pose_text(const CPose3D& p)
{
    using mrpt::RAD2DEG;
    const auto fine = [](double value) { return number(std::round(1e4 * value) / 1e4 + 0.0); };
    return "x=" + fine(p.x()) + " y=" + fine(p.y()) + " z=" + fine(p.z()) +
           " m, yaw=" + fine(RAD2DEG(p.yaw())) + " pitch=" + fine(RAD2DEG(p.pitch())) +
           " roll=" + fine(RAD2DEG(p.roll())) + " deg";
}

/// The two sentences of a cause: what it is, and what to try.
struct CauseText
{
    std::string what, remedy;
};

std::string emptier_side(const DiagnosisFacts& f)
{
    return f.local.finite <= f.global.finite ? "local" : "global";
}

CauseText text_of_points(Cause cause, const DiagnosisFacts& f)
{
    const std::string side = emptier_side(f);
    const PointCount& c = side == "local" ? f.local : f.global;
    const std::string layer = "layer '" + c.layer + "' of the " + side + " map";
    if (cause == Cause::EmptyMap)
        return {"the " + layer + " is empty.",
                "look at the file and at the filters before it; --describe lists what matchers expect."};
    if (cause == Cause::TooFewPoints)
        return {"the " + layer + " has only " + std::to_string(c.finite) + " points.",
                "use a finer filter, or several scans at once: 20 points are the least."};
    return {"most points of a map are not finite (NaN or infinite).",
            "look at the sensor's driver and its ranges; drop such points where they are made."};
}

CauseText text_of_better_fit(Cause cause, const Diagnosis& d, const DiagnosisFacts& f)
{
    const std::string fits = "the maps fit (" + percent(d.better_overlap) + " of the local surfaces)";
    const std::string where = d.better_pose ? " at " + pose_text(*d.better_pose) : "";
    const std::string off = number(f.missed_by) + " m from the guess";
    switch (cause)
    {
        case Cause::WrongScale:
            return {"wrong scale: the local map fits when its coordinates are multiplied by about " +
                        number(d.better_scale) + ".",
                    "convert the units of one map (mm to m, for example), or calibrate the sensor."};
        case Cause::WrongFrame:
            return {"a map is turned (upside down, or axes exchanged): " + fits + where + ".",
                    "look at how the sensor is mounted, and at the order and signs of the axes."};
        case Cause::InvertedGuess:
            return {"the inverse of the guess fits: " + fits + where + ".",
                    "swap local and global, or invert the guess: it is the pose of local in global."};
        case Cause::ThresholdTooSmall:
            return {"the matching distance (" + number(f.run.first_gate) +
                        " m at first) is too small: " + fits + ", " + off + ".",
                    "begin with a matching distance of " + number(2 * f.missed_by) +
                        " m or more, and let it shrink with the iterations."};
        case Cause::ThresholdTooLarge:
            return {
                "the matching distance (" + number(f.run.last_gate) +
                    " m at the end) is too large: far pairs pull the pose away from where " + fits + ".",
                "let the matching distance shrink with the iterations to about " + number(f.nearby) + " m."};
        default:
            return {"bad guess: " + fits + ", " + off + ", where matching from there does not lead.",
                    "give a guess near" + where.substr(where.empty() ? 0 : 3) + "."};
    }
}

CauseText text_of(Cause cause, const LogRecord& log, const Diagnosis& d, const DiagnosisFacts& f)
{
    switch (cause)
    {
        case Cause::AllIsWell:
            return {"all is well: no other pose near or far that was tried fits clearly better.", "nothing."};
        case Cause::EmptyMap:
        case Cause::TooFewPoints:
        case Cause::NonFinitePoints:
            return text_of_points(cause, f);
        case Cause::TooFewIterations:
            return {"too few iterations: it was still moving when its " +
                        std::to_string(log.icpParameters.maxIterations) + " iterations were over.",
                    "allow more (maxIterations), or give a better guess."};
        case Cause::FreeMotion:
            return {"the scene leaves motions free: along them nothing changes, as along a corridor.",
                    "hold them by a prior (odometry), use only the other axes, or a map that shows more."};
        case Cause::NoOverlap:
            return {"no overlap: at no pose that was tried do the maps show the same things.",
                    "look whether both are of the same place, and at the guess."};
        case Cause::DifferentPlaces:
            return {"different places, it seems: the maps lie on each other, and fit nowhere.",
                    "look whether both are of the same place; if so, whether they overlap by a half."};
        case Cause::Unknown:
            return {"not known: " + f.trouble + ".", "look at the pictures of the iterations."};
        default:
            return text_of_better_fit(cause, d, f);
    }
}

std::string overlap_sentence(const LogRecord& log, const Diagnosis& d, const DiagnosisFacts& f)
{
    const auto& pairs = log.icpResult.finalPairings;
    std::string out = "Overlap: " + pairs.contents_summary();
    if (f.nearby > 0)
        out += "; " + percent(d.overlap) + " of the local surfaces lie on global ones where it ended, " +
               percent(f.overlap_at_guess) + " at the guess";
    return out + ".";
}

std::string stop_sentence(const LogRecord& log)
{
    std::string out = "It ended after " + std::to_string(log.icpResult.nIterations) +
                      " iterations: " + to_string(log.icpResult.terminationReason);
    if (!log.iterations.empty())
    {
        const auto& last = log.iterations.back();
        out += "; its last step was " + number(last.step_trans) + " m and " +
               number(mrpt::RAD2DEG(last.step_rot)) + " deg";
    }
    return out + ".";
}

std::string axes_sentence(const std::vector<FreeTwist>& free)
{
    if (free.empty()) return "Free axes: none.";
    if (free.size() == 6) return "Free axes: all, for want of pairings.";
    std::string out = "Free axes:";
    for (const auto& t : free)
        out += (&t == &free.front() ? " " : ", ") + to_string(t.kind) +
               (t.name.empty()
                    ? " along [" + number(t.axis.x) + " " + number(t.axis.y) + " " + number(t.axis.z) + "]"
                    : " " + t.name);
    return out + ".";
}

/** Distances of pairs that mean nothing are spread over all that the gate allows: uniform in a disc of that
 * radius, their rms is 0.71 of it, in a ball 0.77. Those of one surface follow the spacing of its points.
 */
std::string residual_sentence(const LogRecord& log, const DiagnosisFacts& f)
{
    const double rms =
        log.iterations.empty() ? log.icpResult.residual_rms : log.iterations.back().residual_rms;
    if (rms == 0 || f.nearby == 0) return {};
    std::string out = "Residuals: rms " + number(rms) + " m, matching distance " + number(f.run.last_gate) +
                      " m, spacing of the points " + number(f.nearby / 3) + " m: ";
    if (rms <= 2 * f.nearby / 3) return out + "like noise and spacing.";
    return out + (rms > 0.6 * f.run.last_gate ? "spread over all that is allowed, like chance."
                                              : "larger than noise and spacing explain.");
}

std::string points_sentence(const DiagnosisFacts& f)
{
    const auto side = [](const char* name, const PointCount& c)
    {
        return std::to_string(c.finite) + " points of layer '" + c.layer + "' of the " + name + " map" +
               (c.finite < c.all ? " (" + std::to_string(c.all - c.finite) + " more are not finite)" : "");
    };
    return "Matched: " + side("local", f.local) + " to " + side("global", f.global) + ".";
}
}  // namespace

PointCount count_points(const mrpt::maps::CPointsMap::ConstPtr& cloud)
{
    PointCount out;
    if (!cloud) return out;
    const auto &x = cloud->getPointsBufferRef_x(), &y = cloud->getPointsBufferRef_y(),
               &z = cloud->getPointsBufferRef_z();
    out.all = x.size();
    for (size_t i = 0; i < x.size(); i++)
        out.finite += std::isfinite(x[i]) && std::isfinite(y[i]) && std::isfinite(z[i]) ? 1 : 0;
    return out;
}

std::string to_string(DiagnosisCause cause)
{
    constexpr const char* names[] = {"all is well",    "empty map",           "points that are not finite",
                                     "too few points", "too few iterations",  "free motion",
                                     "wrong scale",    "wrong frame",         "inverted guess",
                                     "bad guess",      "threshold too small", "threshold too large",
                                     "no overlap",     "different places",    "unknown"};
    return names[static_cast<size_t>(std::min(cause, DiagnosisCause::Unknown))];
}

std::vector<std::string> sentences_for(const LogRecord& log, const Diagnosis& d, const DiagnosisFacts& f)
{
    const CauseText cause = text_of(d.cause, log, d, f);
    std::vector<std::string> out = {
        "Verdict: " + to_string(log.icpResult.verdict) + ", " + log.icpResult.verdict_reason + ".",
        "Cause: " + cause.what,
        overlap_sentence(log, d, f),
        stop_sentence(log),
        axes_sentence(d.free),
        residual_sentence(log, f),
        points_sentence(f),
        "To try: " + cause.remedy};
    out.erase(std::remove(out.begin(), out.end(), std::string()), out.end());
    return out;
}

}  // namespace mp2p_icp
