#include <mp2p_icp/errors.h>
#include <mp2p_icp/load_map.h>
#include <mp2p_icp/observation_points.h>
#include <mrpt/maps/CSimplePointsMap.h>

#include "archives.h"
#include "cloud_layer.h"
#include "cloud_readers.h"
#include "content_kind.h"
#include "files.h"
#include "gzip.h"
#include "one_line_reason.h"
#include "text_scan.h"

namespace mp2p_icp
{
using mrpt::math::TPoint3D;

namespace
{
// ---- Any file ---------------------------------------------------------------------------------------------

struct Content
{
    std::string bytes;  ///< decompressed
    ContentKind kind = ContentKind::Text;
    std::vector<std::string> notes;
};

Content read_content(const std::string& path)
{
    Content c;
    c.bytes = read_whole_file(path);
    const bool compressed = is_gzip(c.bytes);
    c.bytes = gunzip_all(path, std::move(c.bytes));
    // Windows programs begin a text in UTF-8 with it.
    if (constexpr std::string_view BYTE_ORDER_MARK = "\xef\xbb\xbf"; c.bytes.rfind(BYTE_ORDER_MARK, 0) == 0)
        c.bytes.erase(0, BYTE_ORDER_MARK.size());
    c.kind = detect_kind(path, c.bytes);
    const bool is_mrpt =
        c.kind == ContentKind::MetricMap || c.kind == ContentKind::SimpleMap || c.kind == ContentKind::Rawlog;
    if (has_gz_suffix(path) && !compressed) c.notes.push_back("named .gz, but it is not compressed");
    if (compressed && !has_gz_suffix(path) && !is_mrpt)
        c.notes.push_back("not named .gz, but it is compressed");
    return c;
}

void add_suffix_note(const std::string& path, ContentKind kind, LoadReport& report)
{
    const auto note = suffix_note(path, kind, report.kind);
    if (!note.empty()) report.notes.push_back(note);
}

// ---- Entries of rawlogs and simplemaps --------------------------------------------------------------------

struct ObservationsPath
{
    std::string file;
    uint64_t entry = 0;
};

std::optional<ObservationsPath> parse_observations_path(const std::string& path)
{
    const auto colon = path.rfind(':');
    if (colon == std::string::npos) return {};
    const ObservationsPath p = {path.substr(0, colon), 0};
    const auto entry = parse_count(std::string_view(path).substr(colon + 1));
    const auto suffix = suffix_of(p.file);
    if (!entry || (suffix != ".rawlog" && suffix != ".simplemap")) return {};
    return ObservationsPath{p.file, *entry};
}

LoadedMap load_observation_points(const std::string& path, const LoadOptions& options)
{
    LoadedMap out;
    const auto frame = load_observations(path, out.report);
    const auto points = mrpt::maps::CSimplePointsMap::Create();
    try
    {
        for (const auto& o : *frame)
            if (o) out.report.points_dropped_nonfinite += insert_observation_points(*o, *points).value_or(0);
    }
    catch (const std::exception& e)  // a file that is stored beside the rawlog, for example
    {
        throw DataError(path, one_line_reason(e));
    }
    out.report.points_read = points->size() + out.report.points_dropped_nonfinite;
    if (points->empty())
        throw DataError(
            path, "there is no finite point among its " + std::to_string(out.report.points_read) + " points");
    out.map = metric_map_t::Create();
    out.map->layers[options.layer] = points;
    return out;
}

// ---- Clouds and maps --------------------------------------------------------------------------------------

RawCloud read_cloud(const std::string& path, const Content& c)
{
    switch (c.kind)
    {
        case ContentKind::Ply:
            return read_ply(path, c.bytes);
        case ContentKind::Pcd:
            return read_pcd(path, c.bytes);
        case ContentKind::Obj:
            return read_obj(path, c.bytes);
        case ContentKind::Text:
            return read_text_points(path, c.bytes);
        case ContentKind::Kitti:
            return read_kitti(path, c.bytes);
        case ContentKind::SimpleMap:
            throw DataError(path, "is a simplemap; name one of its entries, such as " + path + ":0");
        case ContentKind::Rawlog:
            throw DataError(path, "is a rawlog; name one of its entries, such as " + path + ":0");
        case ContentKind::MetricMap:
            break;
    }
    throw std::logic_error("read_cloud: a map is no cloud");
}

/// An input that has been read: a cloud whose coordinate offset is still open, or a map.
struct Input
{
    std::optional<RawCloud> cloud;
    ContentKind kind = ContentKind::Text;
    LoadedMap map;
};

Input open_input(const std::string& path, const LoadOptions& options)
{
    Input in;
    if (is_observations_path(path))
        in.map = load_observation_points(path, options);
    else
    {
        Content c = read_content(path);
        in.kind = c.kind;
        auto& notes = in.map.report.notes;
        if (c.kind == ContentKind::MetricMap)
        {
            in.map = read_metric_map(path, c.bytes);
            add_suffix_note(path, c.kind, in.map.report);
        }
        else
            in.cloud = read_cloud(path, c);
        notes.insert(notes.end(), c.notes.begin(), c.notes.end());
    }
    if (!in.cloud && options.coordinate_offset)
        in.map.report.notes.push_back("the coordinate offset that was asked for is for plain clouds only");
    return in;
}

LoadedMap finish_input(Input&& in, const std::string& path, const std::string& layer, const TPoint3D& offset)
{
    if (!in.cloud) return std::move(in.map);
    LoadedMap out = to_map(std::move(*in.cloud), path, layer, offset);
    add_suffix_note(path, in.kind, out.report);
    auto& notes = out.report.notes;
    notes.insert(notes.end(), in.map.report.notes.begin(), in.map.report.notes.end());
    return out;
}

TPoint3D offset_of(const Input& in, const LoadOptions& options)
{
    return in.cloud ? choose_offset(*in.cloud, options) : in.map.map->coordinate_offset();
}

/// The other map's offset, if this cloud is far away, too, and near to it.
TPoint3D common_offset(const Input& in, const LoadOptions& options, const TPoint3D& other)
{
    const auto box = in.cloud ? finite_box(*in.cloud) : std::nullopt;
    const bool common = box && !options.coordinate_offset && other != TPoint3D(0, 0, 0) &&
                        !is_near(*box, {0, 0, 0}) && is_near(*box, other);
    return common ? other : offset_of(in, options);
}
}  // namespace

LoadedMap load_map(const std::string& path, const LoadOptions& options)
{
    Input in = open_input(path, options);
    const auto offset = offset_of(in, options);
    return finish_input(std::move(in), path, options.layer, offset);
}

std::pair<LoadedMap, LoadedMap> load_map_pair(const std::string& local_path, const std::string& global_path,
                                              const LoadOptions& options)
{
    LoadedMap global = load_map(global_path, options);
    Input in = open_input(local_path, options);
    const auto offset = common_offset(in, options, global.map->coordinate_offset());
    return {finish_input(std::move(in), local_path, options.layer, offset), std::move(global)};
}

bool is_observations_path(const std::string& path)
{
    return parse_observations_path(path).has_value();
}

mrpt::obs::CSensoryFrame::Ptr load_observations(const std::string& path, LoadReport& report)
{
    const auto p = parse_observations_path(path);
    if (!p) throw DataError(path, "", "a path such as file.rawlog:N or file.simplemap:N", "another one");
    const Content c = read_content(p->file);
    if (c.kind != ContentKind::Rawlog && c.kind != ContentKind::SimpleMap)
        throw DataError(p->file, "", "a rawlog or a simplemap", "another kind of file");
    const auto frame = read_observations(p->file, c.bytes, p->entry);
    report.source = path;
    report.kind =
        (c.kind == ContentKind::Rawlog ? "rawlog, entry " : "simplemap, entry ") + std::to_string(p->entry);
    report.notes.insert(report.notes.end(), c.notes.begin(), c.notes.end());
    add_suffix_note(p->file, c.kind, report);
    return frame;
}

}  // namespace mp2p_icp
