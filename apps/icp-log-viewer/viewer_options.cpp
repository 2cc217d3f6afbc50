#include "viewer_options.h"

#include <mp2p_icp/numbers.h>

#include <ostream>
#include <stdexcept>

#include "command_line.h"

namespace mp2p_icp_apps
{
namespace
{
const char* const DESCRIPTION =
    "Shows what happened in ICP runs (.icplog files), or what is in a map (.mm): in a window, or as "
    "pictures.";

const char* const EXAMPLES = R"(
Logs are written by icp-run -d, or with generateDebugFiles in a pipeline; saveIterationDetails keeps the iterations.

Examples:
  A window on all logs of a folder, the worst first:
    icp-log-viewer logs/ --sort quality
  Pictures, without a display: the final pose, all iterations in one sheet, one picture per iteration:
    icp-log-viewer run.icplog --snapshot run.png
    icp-log-viewer run.icplog --snapshot run.png --iteration all --view top --size 1600x1200
    icp-log-viewer run.icplog --snapshot-dir pictures/ --color residual
  A page for a bug report:
    icp-log-viewer run.icplog --html run.html
  A map with its layers, planes and lines:
    icp-log-viewer map.mm
    icp-log-viewer map.mm --snapshot map.png --hide raw

Exit code: 0, or 1 for wrong usage or input, or a window without a display (the reason is on stderr).
)";

void declare_logs(CLI::App& app, ViewerOptions& o)
{
    app.add_option("input", o.inputs, "Logs, folders of logs, or one map (.mm)")->type_name("PATH...");
    app.add_option("--sort", o.sort,
                   "Order of the logs: by name, quality (lowest first) or verdict (the best last)")
        ->check(CLI::IsMember({"name", "quality", "verdict"}))
        ->type_name("KEY");
    app.add_option("--verdict", o.verdict, "Only logs with this verdict, such as no_overlap")
        ->check(CLI::IsMember(
            {"aligned", "no_overlap", "under_constrained", "diverged", "worse_than_guess", "failed"}))
        ->type_name("VERDICT");
    app.add_option("--min-quality", o.min_quality, "Only logs with at least this quality, 0 to 1")
        ->check(CLI::Range(0.0, 1.0))
        ->type_name("Q");
    app.add_option("--max-quality", o.max_quality, "Only logs with at most this quality, 0 to 1")
        ->check(CLI::Range(0.0, 1.0))
        ->type_name("Q");
}

void declare_pictures(CLI::App& app, ViewerOptions& o)
{
    app.add_option("--snapshot", o.snapshot, "Write a picture; needs no display")->type_name("FILE.png");
    app.add_option("--snapshot-dir", o.snapshot_dir,
                   "Write a picture per iteration into a folder (made if missing); needs no display")
        ->type_name("DIR");
    app.add_option(
           "--html", o.html,
           "Write one page with the whole story of the run: a view that turns, plots, pictures; opens in "
           "any browser, without a network")
        ->type_name("FILE.html");
    app.add_option("--iteration", o.iteration,
                   "Of --snapshot: the number of an iteration (from 0), guess, rejected, final, or all (one "
                   "sheet). Default: final")
        ->type_name("K");
    app.add_option("--view", o.view, "From where: top, side, iso, or fit (default: suits the data)")
        ->check(CLI::IsMember({"top", "side", "iso", "fit"}))
        ->type_name("VIEW");
    app.add_option("--size", o.size, "Of a picture, pixels. Default: 1280x800")->type_name("WxH");
}

void declare_drawing(CLI::App& app, ViewerOptions& o)
{
    app.add_option("--color", o.color,
                   "Colour by side (global, local; layers of a map), height, or residual of the pairing")
        ->check(CLI::IsMember({"side", "height", "residual"}))
        ->type_name("BY");
    app.add_flag("--pairings", o.pairings, "Draw what is paired");
    app.add_flag("--frames", o.frames, "Draw the coordinate axes of both maps");
    app.add_flag("--covariance", o.covariance, "Draw the (enlarged) ellipsoid of the final translation");
    app.add_option("--voxels", o.voxels,
                   "Draw the cubes of this size (m) that hold points, instead of points")
        ->check(CLI::PositiveNumber)
        ->type_name("SIZE");
    app.add_option(
           "--clip", o.clip,
           "Of pictures: draw only what is at most so far before and behind the middle of the data (m; "
           "below 0: on its other side)")
        ->expected(2)
        ->type_name("BEFORE BEHIND");
    app.add_option("--hide", o.hide, "Layers (or planes, lines) that are not drawn")->type_name("LAYER...");
}

/// `1280x800`
std::pair<int, int> size_from_text(const std::string& text)
{
    const size_t x = text.find('x');
    const auto part = [&](size_t from, size_t count)
    {
        const auto number =
            x == std::string::npos ? std::nullopt : mp2p_icp::to_number(text.substr(from, count));
        if (!number || !(*number >= 1 && *number <= 1e6) || *number != std::floor(*number))
            throw std::invalid_argument("--size: expected WIDTHxHEIGHT in pixels, such as 1280x800, found '" +
                                        text + "'");
        return static_cast<int>(*number);
    };
    return {part(0, x), part(x + 1, std::string::npos)};
}

void check(const ViewerOptions& o)
{
    if (o.inputs.empty())
        throw std::invalid_argument(
            "a log, a folder of logs or a map is required (see icp-log-viewer --help)");
    if (o.min_quality > o.max_quality)
        throw std::invalid_argument("--min-quality must not be greater than --max-quality");
    size_from_text(o.size);
}
}  // namespace

mp2p_icp::LogSnapshotOptions ViewerOptions::picture() const
{
    mp2p_icp::LogSnapshotOptions p;
    std::tie(p.width, p.height) = size_from_text(size);
    p.direction = mp2p_icp::view_from_name(view);
    return p;
}

void ViewerOptions::apply_to(mp2p_icp::LogSceneOptions& options) const
{
    options.color_by_residual = color == "residual";
    for (auto* style : {&options.global, &options.local})
    {
        style->by_height = color == "height";
        style->voxel_size = voxels;
        style->hidden.insert(hide.begin(), hide.end());
    }
    if (clip.size() == 2) options.clip = {clip[0], clip[1]};
    options.draw_pairings = pairings, options.frames = frames, options.covariance = covariance;
}

std::optional<ViewerOptions> parse_viewer_options(const std::vector<std::string>& arguments,
                                                  std::ostream& out)
{
    ViewerOptions options;
    CLI::App app(DESCRIPTION, "icp-log-viewer");
    set_program_texts(app, EXAMPLES, 40);
    declare_logs(app, options);
    declare_pictures(app, options);
    declare_drawing(app, options);
    if (!parse_command_line(app, arguments, out)) return {};
    check(options);
    return options;
}

}  // namespace mp2p_icp_apps
