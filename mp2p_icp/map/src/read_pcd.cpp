#include <liblzf/lzf.h>
#include <mp2p_icp/errors.h>

#include <cmath>
#include <map>

#include "cloud_readers.h"
#include "files.h"
#include "scalar_types.h"
#include "text_scan.h"

namespace mp2p_icp
{
namespace
{
struct Field
{
    std::string name;
    ScalarType type = ScalarType::F32;
    uint64_t count = 1;
    uint64_t size_bytes() const { return size_of(type) * count; }
    bool is_packed_colour() const { return (name == "rgb" || name == "rgba") && size_of(type) == 4; }
};

struct Header
{
    std::vector<Field> fields;
    uint64_t points = 0;
    std::string data;  ///< ascii, binary, binary_compressed
    std::optional<mrpt::math::TPoint3D> written_offset;
    bool has_viewpoint = false;  ///< other than the identity
    size_t size = 0;             ///< bytes
    uint64_t lines = 0;

    uint64_t point_size() const
    {
        uint64_t sum = 0;
        for (const auto& f : fields) sum += f.size_bytes();
        return sum;
    }
    uint64_t values_per_point() const
    {
        uint64_t n = 0;
        for (const auto& f : fields) n += f.count;
        return n;
    }
};

constexpr uint64_t LARGEST_COUNT = 1 << 20;  // of one field: keeps sums of sizes far from overflow

// ---- Header -----------------------------------------------------------------------------------------------

class HeaderReader
{
 public:
    HeaderReader(const std::string& source, std::string_view bytes) : source_(source), lines_(bytes) {}

    Header read()
    {
        std::string_view line;
        while (lines_.next(line))
        {
            if (!line.empty() && line[0] == '#')
            {
                if (const auto offset = offset_in_comment(line.substr(1))) header_.written_offset = offset;
                continue;
            }
            if (!split_words(line, Separators::Blanks, words_)) fail("a shorter line", shown(line));
            if (words_.empty()) continue;
            entries_[std::string(words_[0])] = {words_.begin() + 1, words_.end()};
            places_[std::string(words_[0])] = lines_.line_number();
            if (words_[0] == "DATA") return finish();
        }
        fail("a 'DATA' line after it", "the end of the file");
    }

 private:
    using Words = std::vector<std::string>;

    [[noreturn]] void fail(const std::string& expected, const std::string& found) const
    {
        throw DataError(source_, place_line(lines_.line_number()), expected, found);
    }
    [[noreturn]] void fail_at(const std::string& key, const std::string& expected,
                              const std::string& found) const
    {
        const auto it = places_.find(key);
        throw DataError(source_, it == places_.end() ? "header" : place_line(it->second),
                        key + ": " + expected, found);
    }

    Header finish()
    {
        read_fields();
        read_point_count();
        const auto& view = entries_["VIEWPOINT"];
        header_.has_viewpoint = !view.empty() && !is_identity(view);
        const auto& data = entries_["DATA"];
        header_.data = data.size() == 1 ? data[0] : "";
        if (header_.data != "ascii" && header_.data != "binary" && header_.data != "binary_compressed")
            fail("'DATA ascii|binary|binary_compressed'", shown(data.empty() ? "" : data[0]));
        header_.size = lines_.position();
        header_.lines = lines_.line_number();
        return std::move(header_);
    }

    static bool is_identity(const Words& viewpoint)
    {
        const double identity[7] = {0, 0, 0, 1, 0, 0, 0};
        for (size_t i = 0; i < 7; i++)
            if (i >= viewpoint.size() || parse_number(viewpoint[i]) != identity[i]) return false;
        return true;
    }

    void read_fields()
    {
        const auto& names = entries_.count("FIELDS") ? entries_["FIELDS"] : entries_["COLUMNS"];
        const auto &sizes = entries_["SIZE"], &types = entries_["TYPE"], &counts = entries_["COUNT"];
        if (names.empty()) fail("a 'FIELDS' line before", "'DATA'");
        const std::string n = std::to_string(names.size()) + " entries, as in FIELDS";
        if (sizes.size() != names.size()) fail_at("SIZE", n, std::to_string(sizes.size()));
        if (types.size() != names.size()) fail_at("TYPE", n, std::to_string(types.size()));
        if (!counts.empty() && counts.size() != names.size())
            fail_at("COUNT", n, std::to_string(counts.size()));
        for (size_t i = 0; i < names.size(); i++)
        {
            Field f;
            f.name = names[i];
            f.type = type(types[i], sizes[i]);
            const auto count = counts.empty() ? std::optional<uint64_t>(1) : parse_count(counts[i]);
            if (!count || *count == 0 || *count > LARGEST_COUNT)
                fail_at("COUNT", "a number from 1 to " + std::to_string(LARGEST_COUNT), shown(counts[i]));
            f.count = *count;
            header_.fields.push_back(f);
        }
    }

    ScalarType type(const std::string& letter, const std::string& size) const
    {
        static const std::map<std::string, ScalarType> known = {
            {"I1", ScalarType::I8},  {"U1", ScalarType::U8},  {"I2", ScalarType::I16},
            {"U2", ScalarType::U16}, {"I4", ScalarType::I32}, {"U4", ScalarType::U32},
            {"I8", ScalarType::I64}, {"U8", ScalarType::U64}, {"F4", ScalarType::F32},
            {"F8", ScalarType::F64}};
        const auto it = known.find(letter + size);
        if (it == known.end())
            fail_at("TYPE", "I or U of size 1, 2, 4, 8 or F of size 4, 8", shown(letter + size));
        return it->second;
    }

    void read_point_count()
    {
        const auto count = [this](const std::string& key) -> std::optional<uint64_t>
        {
            if (!entries_.count(key)) return {};
            const auto& words = entries_[key];
            const auto n = words.size() == 1 ? parse_count(words[0]) : std::nullopt;
            if (!n || *n > UINT32_MAX)
                fail_at(key, "one number below 2^32", shown(words.empty() ? "" : words[0]));
            return n;
        };
        const auto width = count("WIDTH"), height = count("HEIGHT"), points = count("POINTS");
        if (!width && !points) fail("a 'WIDTH' or 'POINTS' line before", "'DATA'");
        const uint64_t by_size = width ? *width * height.value_or(1) : *points;
        if (points && *points != by_size)
            fail_at("POINTS", "WIDTH times HEIGHT, " + std::to_string(by_size), std::to_string(*points));
        header_.points = by_size;
    }

    const std::string& source_;
    LineScanner lines_;
    std::vector<std::string_view> words_;
    std::map<std::string, Words> entries_;
    std::map<std::string, uint64_t> places_;
    Header header_;
};

// ---- Data -------------------------------------------------------------------------------------------------

/// The packed colour 0xRRGGBB of 4 bytes, whatever type they are declared as.
double packed_colour(const char* p)
{
    return load_as<uint32_t>(p, is_big_endian_machine());
}

double value_at(const Field& f, const char* p)
{
    if (f.count != 1) return 0;
    return f.is_packed_colour() ? packed_colour(p) : load_scalar(f.type, p, is_big_endian_machine());
}

/// \param stride from one point to the next, for each field; \param start of each field
void read_binary(const Header& h, const char* data, const std::vector<uint64_t>& start,
                 const std::vector<uint64_t>& stride, RawCloudBuilder& builder)
{
    std::vector<double> values(h.fields.size());
    for (uint64_t i = 0; i < h.points; i++)
    {
        for (size_t k = 0; k < h.fields.size(); k++)
            values[k] = value_at(h.fields[k], data + start[k] + i * stride[k]);
        builder.add_row(values.data());
    }
}

void read_interleaved(const std::string& source, std::string_view bytes, const Header& h,
                      RawCloudBuilder& builder)
{
    const uint64_t left = bytes.size() - h.size;
    if (h.points > left / h.point_size())
        throw DataError(source, place_byte(h.size),
                        std::to_string(h.points) + " points of " + std::to_string(h.point_size()) + " bytes",
                        std::to_string(left) + " bytes");
    builder.reserve(h.points, bytes.size());
    std::vector<uint64_t> start, stride(h.fields.size(), h.point_size());
    uint64_t at = 0;
    for (const auto& f : h.fields)
    {
        start.push_back(at);
        at += f.size_bytes();
    }
    read_binary(h, bytes.data() + h.size, start, stride, builder);
}

/// The content of a `binary_compressed` block, all checks made before memory is claimed.
std::string decompress(const std::string& source, std::string_view bytes, const Header& h)
{
    const auto left = bytes.substr(h.size);
    if (left.size() < 8)
        throw DataError(source, place_byte(h.size), "two sizes of 4 bytes",
                        std::to_string(left.size()) + " bytes");
    const uint64_t packed = load_as<uint32_t>(left.data(), is_big_endian_machine());
    const uint64_t full = load_as<uint32_t>(left.data() + 4, is_big_endian_machine());
    if (packed > left.size() - 8)
        throw DataError(source, place_byte(h.size), std::to_string(packed) + " compressed bytes",
                        std::to_string(left.size() - 8));
    const bool huge = h.points > READ_MEMORY_BUDGET_BYTES / h.point_size();
    const uint64_t wanted = huge ? UINT64_MAX : h.points * h.point_size();
    if (full != wanted)
        throw DataError(source, place_byte(h.size + 4),
                        "the size of " + std::to_string(h.points) + " points of " +
                            std::to_string(h.point_size()) + " bytes",
                        std::to_string(full));
    constexpr uint64_t largest_ratio = 132;  // LZF: 3 bytes stand for at most 264 (and 2 for 8)
    if (full > packed * largest_ratio || full + bytes.size() > READ_MEMORY_BUDGET_BYTES)
        throw DataError(source, place_byte(h.size + 4), "a size that the compressed bytes can hold",
                        std::to_string(full));
    std::string content(full, '\0');
    if (full > 0 && lzf_decompress(left.data() + 8, static_cast<unsigned>(packed), content.data(),
                                   static_cast<unsigned>(full)) != full)
        throw DataError(source, place_byte(h.size + 8), "intact LZF data", "damaged data");
    return content;
}

void read_compressed(const std::string& source, std::string_view bytes, const Header& h,
                     RawCloudBuilder& builder)
{
    const std::string content = decompress(source, bytes, h);
    builder.reserve(h.points, bytes.size() + content.size());
    std::vector<uint64_t> start, stride;  // one field after the other
    uint64_t at = 0;
    for (const auto& f : h.fields)
    {
        start.push_back(at);
        stride.push_back(f.size_bytes());
        at += f.size_bytes() * h.points;
    }
    read_binary(h, content.data(), start, stride, builder);
}

/// Colours are written as the packed whole number, or as the float that has the same bits.
double ascii_value(const Field& f, std::string_view word, double value)
{
    if (!f.is_packed_colour() || parse_count(word)) return value;
    const auto as_float = static_cast<float>(value);
    char bytes[4];
    std::memcpy(bytes, &as_float, 4);
    return load_as<uint32_t>(bytes, false);
}

void read_ascii(const std::string& source, std::string_view bytes, const Header& h, RawCloudBuilder& builder)
{
    LineScanner lines(bytes.substr(h.size));
    const uint64_t values_per_point = h.values_per_point();
    constexpr uint64_t most_values = 4096;  // bounds the memory for the words of a line
    if (values_per_point > most_values)
        throw DataError(source, "header", "at most " + std::to_string(most_values) + " values per line",
                        std::to_string(values_per_point));
    if (h.points > (lines.rest().size() + 1) / (2 * values_per_point))  // a digit and a separator each
        throw DataError(source, place_line(h.lines + 1), std::to_string(h.points) + " lines of points",
                        std::to_string(lines.rest().size()) + " bytes");
    builder.reserve(h.points, bytes.size());

    std::vector<std::string_view> words;
    std::vector<double> values(h.fields.size());
    const auto fail = [&](const std::string& expected, const std::string& found)
    { throw DataError(source, place_line(h.lines + lines.line_number()), expected, found); };
    std::string_view line;
    for (uint64_t n = 0; n < h.points;)
    {
        if (!lines.next(line))
            fail(std::to_string(h.points - n) + " more points after it", "the end of the file");
        if (!split_words(line, Separators::Blanks, words, values_per_point) ||
            words.size() != values_per_point)
        {
            if (words.empty()) continue;
            fail(std::to_string(values_per_point) + " values", shown(line));
        }
        size_t at = 0;
        for (size_t k = 0; k < h.fields.size(); at += h.fields[k++].count)
        {
            const auto value = parse_number(words[at]);
            if (!value) fail("a number", shown(words[at]));
            values[k] = h.fields[k].count == 1 ? ascii_value(h.fields[k], words[at], *value) : 0;
        }
        builder.add_row(values.data());
        n++;
    }
}
}  // namespace

RawCloud read_pcd(const std::string& source, std::string_view bytes)
{
    const Header header = HeaderReader(source, bytes).read();
    std::vector<CloudColumn> columns;
    for (const auto& f : header.fields) columns.push_back({f.name, is_integer(f.type), f.count != 1});
    RawCloudBuilder builder(source, "header", columns);

    if (header.data == "ascii")
        read_ascii(source, bytes, header, builder);
    else if (header.data == "binary")
        read_interleaved(source, bytes, header, builder);
    else
        read_compressed(source, bytes, header, builder);

    RawCloud cloud = builder.finish("PCD (" + header.data + ")");
    cloud.written_offset = header.written_offset;
    if (header.has_viewpoint) cloud.notes.push_back("the VIEWPOINT of the file is ignored");
    return cloud;
}

}  // namespace mp2p_icp
