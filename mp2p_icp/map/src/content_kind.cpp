#include "content_kind.h"

#include <mp2p_icp/errors.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <vector>

#include "files.h"
#include "text_scan.h"

namespace mp2p_icp
{
namespace
{
bool starts_with(std::string_view text, std::string_view start)
{
    return text.substr(0, start.size()) == start;
}

bool is_ply(std::string_view c)
{
    return starts_with(c, "ply\n") || starts_with(c, "ply\r\n") || starts_with(c, "ply ");
}

/// PCD has no magic, but its header starts with one of two keywords after comments.
bool is_pcd(std::string_view content)
{
    LineScanner lines(content.substr(0, 1 << 16));
    std::string_view line;
    while (lines.next(line))
    {
        if (line.empty() || line[0] == '#') continue;
        return starts_with(line, "VERSION ") || starts_with(line, "FIELDS ") || starts_with(line, "COLUMNS ");
    }
    return false;
}

/// Control characters do not occur in text; bytes from 128 on do (comments in UTF-8 or Latin).
bool is_binary(std::string_view content)
{
    const auto sample = content.substr(0, 1 << 16);
    return std::any_of(
        sample.begin(), sample.end(),
        [](char c)
        { return (c >= 0 && c < ' ' && c != '\t' && c != '\n' && c != '\r' && c != '\f') || c == 127; });
}

bool is_obj_keyword(std::string_view word)
{
    constexpr std::array<std::string_view, 16> known = {"v",      "vn", "vt",     "vp", "f", "o",
                                                        "g",      "s",  "usemtl", "l",  "p", "cstype",
                                                        "mtllib", "mg", "usemap", "deg"};
    return std::find(known.begin(), known.end(), word) != known.end();
}

/// The first line with content tells text from OBJ.
ContentKind text_kind(const std::string& path, std::string_view content)
{
    LineScanner lines(content);
    std::vector<std::string_view> words;
    std::string_view line;
    while (lines.next(line))
    {
        split_words(line, Separators::BlanksAndCommas, words, 64);
        if (words.empty() || words[0].substr(0, 1) == "#" || words[0].substr(0, 2) == "//") continue;
        if (is_obj_keyword(words[0])) return ContentKind::Obj;
        const bool has_names =
            std::any_of(words.begin(), words.end(), [](auto w) { return w.find_first_of("xX") != w.npos; });
        if (parse_number(words[0]) || (words.size() >= 3 && has_names)) return ContentKind::Text;
        throw DataError(path, place_line(lines.line_number()),
                        "a PLY, PCD, OBJ, MRPT or KITTI file or rows of numbers", shown(line));
    }
    throw DataError(path, place_line(lines.line_number()), "a row of numbers", "the end of the file");
}

[[noreturn]] void throw_unsupported(const std::string& path, const std::string& kind)
{
    throw DataError(path, "is " + kind + ", a kind that is not supported");
}

void refuse_unsupported(const std::string& path, std::string_view content)
{
    if (starts_with(content, "LASF")) throw_unsupported(path, "a LAS/LAZ file");
    if (starts_with(content, "ASTM-E57")) throw_unsupported(path, "an E57 file");
    if (starts_with(content, "\x89HDF")) throw_unsupported(path, "an HDF5 file");
    if (starts_with(content, "glTF")) throw_unsupported(path, "a glTF file");
    if (starts_with(content, "PK\x03\x04")) throw_unsupported(path, "a ZIP archive");
    if (starts_with(content, "\x28\xb5\x2f\xfd")) throw_unsupported(path, "Zstandard-compressed");
    if (starts_with(content, "BZh")) throw_unsupported(path, "bzip2-compressed");
    if (starts_with(content,
                    "\xfd"
                    "7zXZ"))
        throw_unsupported(path, "xz-compressed");
}

ContentKind archive_kind(const std::string& path, const std::string& full_name)
{
    const std::string name =
        full_name.substr(full_name.find_last_of(':') + 1);  // old files have no namespaces
    if (full_name == "mp2p_icp::metric_map_t") return ContentKind::MetricMap;
    if (full_name == "mp2p_icp::LogRecord") throw_unsupported(path, "an ICP log (.icplog)");
    if (name == "CSimpleMap" || name == "CSensFrameProbSequence") return ContentKind::SimpleMap;
    const bool entry = name == "CRawlog" || name == "CSensoryFrame" || name == "CActionCollection" ||
                       name == "CPose2D" || starts_with(name, "CObservation");
    if (entry) return ContentKind::Rawlog;
    throw_unsupported(path, "an MRPT archive of the class " + full_name);
}
}  // namespace

std::string archive_class(std::string_view c)
{
    // First byte: 0x80 | length of the name; in old files: the length as 32 bits, little endian.
    if (c.size() < 5) return {};
    const auto first = static_cast<unsigned char>(c[0]);
    const bool old = first < 0x80 && c[1] == 0 && c[2] == 0 && c[3] == 0;
    if (first < 0x80 && !old) return {};
    const auto name = c.substr(old ? 4 : 1, first & 0x7f);
    const auto is_name_char = [](char ch) {
        return std::isalnum(static_cast<unsigned char>(ch)) || ch == '_' || ch == ':' || ch == '<' ||
               ch == '>';
    };
    const bool has_prefix =
        starts_with(name, "C") || starts_with(name, "mrpt::") || starts_with(name, "mp2p_icp::");
    if (name.size() != (first & 0x7fu) || name.size() < 6 || !has_prefix) return {};
    return std::all_of(name.begin(), name.end(), is_name_char) ? std::string(name) : std::string();
}

ContentKind detect_kind(const std::string& path, std::string_view content)
{
    if (content.empty()) throw DataError(path, "there is nothing in it");
    refuse_unsupported(path, content);
    if (is_ply(content)) return ContentKind::Ply;
    if (const auto name = archive_class(content); !name.empty()) return archive_kind(path, name);
    if (is_pcd(content)) return ContentKind::Pcd;
    if (!is_binary(content)) return text_kind(path, content);
    if (suffix_of(path) == ".bin") return ContentKind::Kitti;
    throw DataError(path, place_byte(0), "a PLY, PCD, OBJ, MRPT or KITTI file or rows of numbers",
                    "binary data of an unknown kind");
}

std::string suffix_note(const std::string& path, ContentKind kind, const std::string& kind_name)
{
    static const std::vector<std::vector<std::string>> usual = {
        {".ply"}, {".pcd"}, {".obj"},       {".xyz", ".txt", ".csv", ".asc", ".pts", ".dat"},
        {".bin"}, {".mm"},  {".simplemap"}, {".rawlog"}};
    const auto& suffixes = usual[static_cast<size_t>(kind)];
    const std::string suffix = suffix_of(path);
    if (std::find(suffixes.begin(), suffixes.end(), suffix) != suffixes.end()) return {};
    return (suffix.empty() ? std::string("without a suffix") : "named " + suffix) + ", but it is " +
           kind_name;
}

}  // namespace mp2p_icp
