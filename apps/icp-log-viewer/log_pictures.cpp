#include "log_pictures.h"

#include <mp2p_icp/errors.h>
#include <mp2p_icp/html_report.h>
#include <mp2p_icp/load_map.h>

#include <filesystem>
#include <ostream>

#include "log_files.h"

namespace mp2p_icp_apps
{
using mp2p_icp::LogMoment;
using mp2p_icp::LogScene;

namespace
{
constexpr size_t PANELS_OF_A_SHEET = 12, PICTURES_OF_A_PAGE = 12;

std::string name_of(const std::string& path)
{
    return std::filesystem::path(path).filename().string();
}

/// The file name, without its suffixes, of one of several logs, put before the suffix of an output, or behind
/// a folder.
std::filesystem::path with_log_name(const std::filesystem::path& output, const std::string& log_path)
{
    std::string name = name_of(log_path);
    name.erase(std::min(name.size(), name.find(".icplog")));
    auto path = output;
    return output.has_extension()
               ? path.replace_filename(output.stem().string() + "-" + name + output.extension().string())
               : output / name;
}

void save(const mp2p_icp::LogPicture& picture, const std::string& path, std::ostream& out)
{
    mp2p_icp::save_picture(picture.image, path);
    out << "Written: " << path << "\n";
}

/// `guess`, `iteration-003`, `rejected`, `final`, with a number before it that keeps them in order.
std::string file_name_of(const LogMoment& moment, size_t position)
{
    char text[48];
    const char* kind = moment.kind == LogMoment::Kind::Guess       ? "guess"
                       : moment.kind == LogMoment::Kind::Rejected  ? "rejected"
                       : moment.kind == LogMoment::Kind::Iteration ? "iteration"
                                                                   : "final";
    if (moment.kind == LogMoment::Kind::Iteration)
        std::snprintf(text, sizeof(text), "%04zu-%s-%03zu.png", position, kind, moment.iteration);
    else
        std::snprintf(text, sizeof(text), "%04zu-%s.png", position, kind);
    return text;
}

/// The pictures of one log.
class LogPictures
{
 public:
    LogPictures(const std::string& path, const ViewerOptions& options, std::ostream& out)
        : options_(options),
          out_(out),
          name_(name_of(path)),
          log_(load_log(path)),
          scene_(log_),
          picture_(options.picture())
    {
        auto drawing = scene_.options();
        options.apply_to(drawing);
        scene_.set_options(drawing);
        picture_.captions = {name_ + ": " + mp2p_icp::verdict_caption(*log_)};
    }

    void write_one(const std::string& path)
    {
        const auto all = log_moments(*log_);
        const auto moments = options_.iteration == "all"
                                 ? mp2p_icp::some_moments(all, PANELS_OF_A_SHEET)
                                 : std::vector<LogMoment>{moment_from_text(*log_, options_.iteration)};
        save(draw_log(scene_, moments, picture_), path, out_);
    }

    void write_each_into(const std::filesystem::path& folder)
    {
        std::error_code ignored;
        std::filesystem::create_directories(folder, ignored);
        const auto moments = log_moments(*log_);
        for (size_t i = 0; i < moments.size(); i++)
            save(draw_log(scene_, {moments[i]}, picture_), (folder / file_name_of(moments[i], i)).string(),
                 out_);
    }

    void write_page(const std::string& path)
    {
        mp2p_icp::HtmlReportOptions page;
        page.title = name_;
        for (const auto& moment : mp2p_icp::some_moments(log_moments(*log_), PICTURES_OF_A_PAGE))
            page.pictures.push_back({to_string(moment), draw_log(scene_, {moment}, picture_).image});
        mp2p_icp::save_html_report(*log_, path, page);
        out_ << "Written: " << path << "\n";
    }

 private:
    const ViewerOptions& options_;
    std::ostream& out_;
    std::string name_;
    mp2p_icp::LogRecord::Ptr log_;
    LogScene scene_;
    mp2p_icp::LogSnapshotOptions picture_;
};

void write_map_picture(const ViewerOptions& options, std::ostream& out)
{
    if (!options.snapshot_dir.empty()) throw std::invalid_argument("--snapshot-dir: a map has no iterations");
    if (!options.html.empty()) throw std::invalid_argument("--html: the page is that of a run, not of a map");
    const auto& path = options.inputs.front();
    const auto map = mp2p_icp::load_map(path).map;
    LogScene scene{mp2p_icp::metric_map_t::ConstPtr(map)};
    auto drawing = scene.options();
    options.apply_to(drawing);
    scene.set_options(drawing);
    auto picture = options.picture();
    picture.captions = {name_of(path) + ": " + map->contents_summary()};
    save(draw_log(scene, {LogMoment()}, picture), options.snapshot, out);
}

/// The logs that the options ask for, in their order.
std::vector<std::string> chosen_logs(const ViewerOptions& options)
{
    const auto paths = find_logs(options.inputs);
    if (paths.size() == 1) return paths;
    std::vector<LogSummary> logs;
    for (const auto& path : paths)
        if (logs.push_back(summary_of(path)); !logs.back().problem.empty())
            throw std::runtime_error(logs.back().problem);
    std::vector<std::string> chosen;
    for (const auto& log : sorted_and_filtered(logs, options)) chosen.push_back(log.path);
    if (chosen.empty()) throw std::invalid_argument("no log has the verdict and quality that were asked for");
    return chosen;
}
}  // namespace

void write_pictures(const ViewerOptions& options, std::ostream& out)
{
    if (is_map_path(options.inputs.front())) return write_map_picture(options, out);
    const auto logs = chosen_logs(options);
    const auto output = [&](const std::string& asked, const std::string& log)
    { return (logs.size() == 1 ? std::filesystem::path(asked) : with_log_name(asked, log)).string(); };
    for (const auto& log : logs)
    {
        LogPictures pictures(log, options, out);
        if (!options.snapshot.empty()) pictures.write_one(output(options.snapshot, log));
        if (!options.snapshot_dir.empty()) pictures.write_each_into(output(options.snapshot_dir, log));
        if (!options.html.empty()) pictures.write_page(output(options.html, log));
    }
}

}  // namespace mp2p_icp_apps
