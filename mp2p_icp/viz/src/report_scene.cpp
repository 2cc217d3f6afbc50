#include "report_scene.h"

#include <mp2p_icp/numbers.h>
#include <mp2p_icp/ortho_view.h>
#include <mp2p_icp/se3.h>

#include <algorithm>
#include <cmath>

#include "html_text.h"
#include "report_clouds.h"
#include "report_pairings.h"
#include "report_shapes.h"
#include "stored_run.h"

namespace mp2p_icp
{
using Eigen::Vector3d;
using mrpt::poses::CPose3D;

namespace
{
constexpr double WIDTH_OVER_HEIGHT = 1.5;  // of the view, about

/// A map with what is drawn of it.
struct DrawnMap
{
    const metric_map_t& map;
    std::vector<DrawnLayer> layers;
    PointSet places;
    Vector3d centre;

    DrawnMap(const metric_map_t& m, size_t max_points)
        : map(m),
          layers(drawn_layers(m, max_points)),
          places(places_of(m, layers)),
          centre(to_eigen(middle_of(places)))
    {
    }

    DrawnShare share() const
    {
        DrawnShare out;
        for (const auto& layer : layers) out.drawn += layer.points.size(), out.finite += layer.finite;
        return out;
    }
};

/// Where the local cloud stood, and what was paired there.
struct RunState
{
    std::string label;
    CPose3D pose;
    const Pairings* pairings = nullptr;
    long iteration = -1;  ///< -1: of none
};

std::vector<RunState> states_of(const LogRecord& log, const StoredRun& run, const Pairings& final_pairings)
{
    std::vector<RunState> states;
    const auto add = [&states](const RunState& state)
    {
        if (is_finite(state.pose)) states.push_back(state);
    };
    const Verdict verdict = log.icpResult.verdict;
    const bool found = verdict == Verdict::aligned || verdict == Verdict::under_constrained;
    add({"guess", run.guess, found ? nullptr : &final_pairings, -1});
    if (log.iterationsDetails)
        for (const auto& [iteration, details] : *log.iterationsDetails)
            add({"iteration " + std::to_string(iteration), details.optimalPose, &details.pairings,
                 static_cast<long>(iteration)});
    if (found) add({"result", run.end, &final_pairings, -1});
    if (log.icpResult.rejected_pose) add({"rejected pose", run.end, nullptr, -1});
    return states;
}

std::string list_of(const std::vector<std::string>& items)
{
    std::string out = "[";
    for (const auto& item : items) out += (out.size() > 1 ? ",\n" : "") + item;
    return out + "]";
}

/// JSON has no other numbers than finite ones.
std::string number(double value)
{
    return std::isfinite(value) ? to_text(value) : "null";
}
std::string numbers(const Vector3d& v)
{
    return "[" + number(v.x()) + "," + number(v.y()) + "," + number(v.z()) + "]";
}

std::string layers_json(const DrawnMap& drawn, const char* side)
{
    std::vector<std::string> items;
    for (const auto& layer : drawn.layers)
    {
        PackedPoints packed;
        packed.reserve(layer.points.size());
        for (const auto& p : layer.points) packed.add(Vector3d(to_eigen(p) - drawn.centre));
        items.push_back("{\"side\":\"" + std::string(side) + "\",\"layer\":" + json_string(layer.name) +
                        ",\"drawn\":" + std::to_string(packed.size()) +
                        ",\"of\":" + std::to_string(layer.finite) + ",\"points\":" + packed.json() + "}");
    }
    return list_of(items);
}

std::string shapes_json(const DrawnMap& drawn, const char* side, double picture_height)
{
    std::vector<std::string> items;
    const auto add = [&](const char* kind, size_t count, const PackedPoints& segments)
    {
        if (!segments.empty())
            items.push_back("{\"side\":\"" + std::string(side) + "\",\"kind\":\"" + kind + "\",\"count\":" +
                            std::to_string(count) + ",\"segments\":" + segments.json() + "}");
    };
    add("planes", drawn.map.planes.size(),
        border_segments(drawn.map.planes, drawn.centre, 0.05 * picture_height));
    add("lines", drawn.map.lines.size(), line_segments(drawn.map.lines, drawn.centre, 0.15 * picture_height));
    return list_of(items);
}

/// The pose between coordinates relative to the centres: rows of (R t).
std::string pose_json(const CPose3D& pose, const Vector3d& local_centre, const Vector3d& global_centre)
{
    const Eigen::Matrix3d R = rotation_of(pose);
    const Vector3d t = R * local_centre + translation_of(pose) - global_centre;
    std::string out = "[";
    for (int r = 0; r < 3; r++)
    {
        for (int c = 0; c < 3; c++) out += number(R(r, c)) + ",";
        out += number(t(r)) + (r < 2 ? "," : "]");
    }
    return out;
}

std::string pairings_json(const RunState& state, const Vector3d& centre, size_t max_pairings,
                          double picture_height)
{
    if (!state.pairings) return "{}";
    const auto counts = pairing_counts(*state.pairings);
    const auto drawn = drawn_pairings(*state.pairings, state.pose, centre, max_pairings, picture_height);
    std::string out;
    for (size_t kind = 0; kind < PAIRING_KIND_COUNT; kind++)
        if (counts[kind] > 0)
            out += (out.empty() ? "\"" : ",\"") + std::string(PAIRING_KIND_NAMES[kind]) +
                   "\":{\"of\":" + std::to_string(counts[kind]) +
                   ",\"drawn\":" + std::to_string(drawn[kind].residuals.size() / 2) +
                   ",\"residuals\":" + drawn[kind].residuals.json() +
                   ",\"primitives\":" + drawn[kind].primitives.json() + "}";
    return "{" + out + "}";
}

std::string states_json(const std::vector<RunState>& states, const Vector3d& global_centre,
                        const Vector3d& local_centre, size_t max_pairings, double picture_height)
{
    std::vector<std::string> items;
    for (const auto& state : states)
    {
        // The last one, which is seen first, has a quarter; all others share the rest.
        const size_t last = max_pairings / 4, rest = max_pairings - last;
        const size_t share = &state == &states.back() ? last : rest / (states.size() - 1);
        items.push_back("{\"label\":" + json_string(state.label) +
                        ",\"iteration\":" + std::to_string(state.iteration) +
                        ",\"pose\":" + pose_json(state.pose, local_centre, global_centre) +
                        ",\"pairings\":" + pairings_json(state, global_centre, share, picture_height) + "}");
    }
    return list_of(items);
}

/// The free motions, around the middle of the local cloud where the iterations ended.
std::string arrows_json(const std::vector<FreeTwist>& twists, const Vector3d& middle,
                        const Vector3d& global_offset, const Vector3d& centre, double size)
{
    std::vector<std::string> items;
    for (FreeTwist twist : twists)
    {
        twist.through = to_mrpt(to_eigen(twist.through) - global_offset - centre - middle);
        const MotionArrow arrow = motion_arrow(twist, size);
        if (arrow.segments.empty()) continue;
        items.push_back(
            "{\"label\":" +
            json_string("free: " + to_string(twist.kind) + (twist.name.empty() ? "" : " " + twist.name)) +
            ",\"at\":" + numbers(middle) + ",\"label_at\":" + numbers(arrow.label_at) +
            ",\"segments\":" + arrow.segments.json() + "}");
    }
    return list_of(items);
}

PointSet moved(const PointSet& points, const CPose3D& pose)
{
    PointSet out;
    if (!is_finite(pose)) return out;
    out.reserve(points.size());
    for (const auto& p : points)
        if (const auto q = pose.composePoint(p); to_eigen(q).allFinite()) out.push_back(q);
    return out;
}

/// Relative to the centre.
OrthoView view_of(const DrawnMap& global, const DrawnMap& local, const StoredRun& run)
{
    const CPose3D to_centre(to_mrpt(-global.centre));
    const std::vector<PointSet> sets = {moved(global.places, to_centre),
                                        moved(local.places, to_centre + run.guess),
                                        moved(local.places, to_centre + run.end)};
    const bool nothing = std::all_of(sets.begin(), sets.end(), [](const auto& set) { return set.empty(); });
    if (nothing) return {};
    const OrthoView view = fit_view(sets, WIDTH_OVER_HEIGHT);
    return std::isfinite(view.height) && to_eigen(view.focus).allFinite() ? view : OrthoView();
}

std::string view_json(const OrthoView& view)
{
    return "{\"azimuth\":" + to_text(view.azimuth_deg) + ",\"elevation\":" + to_text(view.elevation_deg) +
           ",\"height\":" + to_text(view.height) + ",\"focus\":" + numbers(to_eigen(view.focus)) + "}";
}
}  // namespace

ReportScene report_scene(const LogRecord& log, const HtmlReportOptions& options)
{
    const StoredRun run(log);
    const DrawnMap global(*run.global, options.max_points_per_cloud),
        local(*run.local, options.max_points_per_cloud);
    const OrthoView view = view_of(global, local, run);
    const Pairings final_pairings = run.offsets.to_stored(log.icpResult.finalPairings);

    const Vector3d offset = to_eigen(run.offsets.global());
    const Vector3d local_middle =
        is_finite(run.end)
            ? Vector3d(rotation_of(run.end) * local.centre + translation_of(run.end) - global.centre)
            : Vector3d::Zero();
    ReportScene out;
    out.global = global.share(), out.local = local.share();
    out.json =
        "{\"centre\":" + numbers(global.centre + offset) + ",\n\"view\":" + view_json(view) +
        ",\n\"layers\":[" + layers_json(global, "global") + "," + layers_json(local, "local") +
        "],\n\"shapes\":[" + shapes_json(global, "global", view.height) + "," +
        shapes_json(local, "local", view.height) + "],\n\"arrows\":" +
        arrows_json(log.icpResult.unobservable, local_middle, offset, global.centre, 0.3 * view.height) +
        ",\n\"states\":" +
        states_json(states_of(log, run, final_pairings), global.centre, local.centre, options.max_pairings,
                    view.height) +
        "}";
    return out;
}

}  // namespace mp2p_icp
