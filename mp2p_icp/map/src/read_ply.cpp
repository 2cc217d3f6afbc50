#include <mp2p_icp/errors.h>

#include <map>

#include "cloud_readers.h"
#include "scalar_types.h"
#include "text_scan.h"

namespace mp2p_icp
{
namespace
{
enum class Encoding
{
    Ascii,
    LittleEndian,
    BigEndian
};

struct Property
{
    std::string name;
    ScalarType type = ScalarType::F32;               ///< of a list: of its items
    std::optional<ScalarType> list_count_type = {};  ///< only lists have one
};

struct Element
{
    std::string name;
    uint64_t count = 0;
    uint64_t line = 0;  ///< where the header declares it
    std::vector<Property> properties;

    bool has_list() const
    {
        for (const auto& p : properties)
            if (p.list_count_type) return true;
        return false;
    }
    /// Bytes of one item in a binary file, where lists are empty.
    size_t min_size() const
    {
        size_t size = 0;
        for (const auto& p : properties) size += size_of(p.list_count_type.value_or(p.type));
        return size;
    }
};

struct Header
{
    Encoding encoding = Encoding::Ascii;
    std::vector<Element> elements;
    std::optional<mrpt::math::TPoint3D> written_offset;
    size_t size = 0;     ///< bytes
    uint64_t lines = 0;  ///< of the header
};

const char* name_of(Encoding e)
{
    return e == Encoding::Ascii          ? "PLY (ascii)"
           : e == Encoding::LittleEndian ? "PLY (binary little endian)"
                                         : "PLY (binary big endian)";
}

// ---- Header -----------------------------------------------------------------------------------------------

/// Reads the header line by line; each line has its own function.
class HeaderReader
{
 public:
    HeaderReader(const std::string& source, std::string_view bytes) : source_(source), lines_(bytes) {}

    Header read()
    {
        std::string_view line;
        if (!lines_.next(line) || line.substr(0, 3) != "ply") fail("'ply'", shown(line));
        while (true)
        {
            if (!lines_.next(line)) fail("'end_header'", "the end of the file");
            split_words(line, Separators::Blanks, words_, 64);
            if (words_.empty() || words_[0] == "obj_info") continue;
            if (words_[0] == "end_header") break;
            if (words_[0] == "format")
                read_format(line);
            else if (words_[0] == "comment")
                read_comment(line);
            else if (words_[0] == "element")
                read_element(line);
            else if (words_[0] == "property")
                read_property(line);
            else
                fail("a keyword of a PLY header", shown(line));
        }
        if (!has_format_) fail("a 'format' line before", "'end_header'");
        header_.size = lines_.position();
        header_.lines = lines_.line_number();
        return std::move(header_);
    }

 private:
    [[noreturn]] void fail(const std::string& expected, const std::string& found) const
    {
        throw DataError(source_, place_line(lines_.line_number()), expected, found);
    }

    void read_format(std::string_view line)
    {
        static const std::map<std::string_view, Encoding> known = {
            {"ascii", Encoding::Ascii},
            {"binary_little_endian", Encoding::LittleEndian},
            {"binary_big_endian", Encoding::BigEndian}};
        if (words_.size() != 3 || !known.count(words_[1]) || words_[2] != "1.0")
            fail("'format ascii|binary_little_endian|binary_big_endian 1.0'", shown(line));
        header_.encoding = known.at(words_[1]);
        has_format_ = true;
    }

    void read_comment(std::string_view line)
    {
        const auto at = line.find("comment") + std::string_view("comment").size();
        if (const auto offset = offset_in_comment(line.substr(at))) header_.written_offset = offset;
    }

    void read_element(std::string_view line)
    {
        const auto count = words_.size() == 3 ? parse_count(words_[2]) : std::nullopt;
        if (!count) fail("'element NAME COUNT'", shown(line));
        for (const auto& e : header_.elements)
            if (e.name == words_[1]) fail("each element once", shown(line));
        Element e;
        e.name = words_[1];
        e.count = *count;
        e.line = lines_.line_number();
        header_.elements.push_back(e);
    }

    void read_property(std::string_view line)
    {
        if (header_.elements.empty()) fail("an 'element' line before", shown(line));
        Property p;
        if (words_.size() == 5 && words_[1] == "list")
        {
            p.list_count_type = type(words_[2]);
            p.type = type(words_[3]);
            if (!is_integer(*p.list_count_type)) fail("a list with a whole number as its count", shown(line));
        }
        else if (words_.size() == 3)
            p.type = type(words_[1]);
        else
            fail("'property TYPE NAME' or 'property list TYPE TYPE NAME'", shown(line));
        p.name = words_.back();
        header_.elements.back().properties.push_back(p);
    }

    ScalarType type(std::string_view name) const
    {
        static const std::map<std::string_view, ScalarType> known = {
            {"char", ScalarType::I8},    {"int8", ScalarType::I8},     {"uchar", ScalarType::U8},
            {"uint8", ScalarType::U8},   {"short", ScalarType::I16},   {"int16", ScalarType::I16},
            {"ushort", ScalarType::U16}, {"uint16", ScalarType::U16},  {"int", ScalarType::I32},
            {"int32", ScalarType::I32},  {"uint", ScalarType::U32},    {"uint32", ScalarType::U32},
            {"long", ScalarType::I64},   {"int64", ScalarType::I64},   {"ulong", ScalarType::U64},
            {"uint64", ScalarType::U64}, {"float", ScalarType::F32},   {"float32", ScalarType::F32},
            {"double", ScalarType::F64}, {"float64", ScalarType::F64},
        };
        const auto it = known.find(name);
        if (it == known.end()) fail("a PLY type such as float or uchar", shown(name));
        return it->second;
    }

    const std::string& source_;
    LineScanner lines_;
    std::vector<std::string_view> words_;
    Header header_;
    bool has_format_ = false;
};

// ---- Data -------------------------------------------------------------------------------------------------

/// Walks over the items of a binary PLY.
class BinaryReader
{
 public:
    BinaryReader(const std::string& source, std::string_view bytes, const Header& header)
        : source_(source),
          bytes_(bytes),
          at_(header.size),
          swap_((header.encoding == Encoding::BigEndian) != is_big_endian_machine())
    {
    }

    /// Checks that the bytes left can hold the element at all, so that its count may be believed.
    void check_count(const Element& e) const
    {
        const uint64_t left = bytes_.size() - at_, size = e.min_size();
        if (size > 0 && e.count > left / size)
            throw DataError(source_, place_byte(at_),
                            std::to_string(e.count) + " of element '" + e.name + "' (" +
                                std::to_string(size) + " bytes or more each)",
                            std::to_string(left) + " bytes");
    }

    void skip(const Element& e)
    {
        check_count(e);
        if (!e.has_list())
            at_ += e.min_size() * e.count;
        else
            for (uint64_t i = 0; i < e.count; i++) read_item(e, nullptr);
    }

    /// One item; `values` (may be null) gets one number per property, 0 for lists.
    void read_item(const Element& e, double* values)
    {
        for (const auto& p : e.properties)
        {
            const double v = take(e, p.list_count_type.value_or(p.type));
            if (p.list_count_type) skip_list(e, v, size_of(p.type));
            if (values) *values++ = p.list_count_type ? 0.0 : v;
        }
    }

 private:
    double take(const Element& e, ScalarType t)
    {
        need(e, size_of(t));
        const double v = load_scalar(t, bytes_.data() + at_, swap_);
        at_ += size_of(t);
        return v;
    }

    void skip_list(const Element& e, double count, size_t item_size)
    {
        if (count < 0)
            throw DataError(source_, place_byte(at_), "a list of 0 or more items", "a negative count");
        if (count > static_cast<double>((bytes_.size() - at_) / item_size)) need(e, bytes_.size() - at_ + 1);
        at_ += static_cast<size_t>(count) * item_size;
    }

    void need(const Element& e, uint64_t size) const
    {
        if (bytes_.size() - at_ < size)
            throw DataError(source_, place_byte(at_), "the rest of element '" + e.name + "'",
                            "the end of the file");
    }

    const std::string& source_;
    std::string_view bytes_;
    size_t at_;
    bool swap_;
};

/// Walks over the items of an ascii PLY, one per line.
class AsciiReader
{
 public:
    AsciiReader(const std::string& source, std::string_view bytes, const Header& header)
        : source_(source), lines_(bytes.substr(header.size)), lines_before_(header.lines)
    {
    }

    void check_count(const Element& e) const
    {
        const uint64_t line_size =
            2 * std::max<uint64_t>(e.properties.size(), 1);  // a digit and a separator each
        if (e.count > (lines_.rest().size() + 1) / line_size)
            throw DataError(source_, place_line(lines_before_ + lines_.line_number() + 1),
                            std::to_string(e.count) + " lines of element '" + e.name + "'",
                            std::to_string(lines_.rest().size()) + " bytes");
    }

    void skip(const Element& e)
    {
        if (e.properties.empty()) return;
        for (uint64_t i = 0; i < e.count; i++) next_line(e);
    }

    void read_item(const Element& e, double* values)
    {
        const auto line = next_line(e);
        if (!split_words(line, Separators::Blanks, words_)) fail("a shorter line", shown(line));
        size_t at = 0;
        for (const auto& p : e.properties)
        {
            const double v = number(at++, line);
            if (p.list_count_type)
            {
                if (!(v >= 0 && v <= static_cast<double>(words_.size()))) fail("a list's items", shown(line));
                at += static_cast<size_t>(v);
            }
            *values++ = p.list_count_type ? 0.0 : v;
        }
        if (at != words_.size()) fail(std::to_string(at) + " values", std::to_string(words_.size()));
    }

 private:
    [[noreturn]] void fail(const std::string& expected, const std::string& found) const
    {
        throw DataError(source_, place_line(lines_before_ + lines_.line_number()), expected, found);
    }

    std::string_view next_line(const Element& e)
    {
        std::string_view line;
        do
            if (!lines_.next(line))
                fail("the rest of element '" + e.name + "' after it", "the end of the file");
        while (line.find_first_not_of(" \t") == std::string_view::npos);
        return line;
    }

    double number(size_t at, std::string_view line) const
    {
        if (at >= words_.size()) fail("more than " + std::to_string(words_.size()) + " values", shown(line));
        const auto value = parse_number(words_[at]);
        if (!value) fail("a number", shown(words_[at]));
        return *value;
    }

    const std::string& source_;
    LineScanner lines_;
    uint64_t lines_before_;
    std::vector<std::string_view> words_;
};

template <class Reader>
void read_vertices(Reader& reader, const Header& header, RawCloudBuilder& builder, uint64_t bytes_held)
{
    for (const auto& e : header.elements)
    {
        if (e.name != "vertex")
        {
            reader.skip(e);
            continue;
        }
        reader.check_count(e);
        builder.reserve(e.count, bytes_held);
        std::vector<double> values(e.properties.size());
        for (uint64_t i = 0; i < e.count; i++)
        {
            reader.read_item(e, values.data());
            builder.add_row(values.data());
        }
        return;  // what follows the vertices is not of interest
    }
}
}  // namespace

RawCloud read_ply(const std::string& source, std::string_view bytes)
{
    const Header header = HeaderReader(source, bytes).read();
    const Element* vertex = nullptr;
    for (const auto& e : header.elements)
        if (e.name == "vertex") vertex = &e;
    if (!vertex)
        throw DataError(source, place_line(header.lines), "an element 'vertex' before", "'end_header'");

    std::vector<CloudColumn> columns;
    for (const auto& p : vertex->properties)
        columns.push_back({p.name, is_integer(p.type), p.list_count_type.has_value()});
    RawCloudBuilder builder(source, place_line(vertex->line), columns);
    if (header.encoding == Encoding::Ascii)
    {
        AsciiReader reader(source, bytes, header);
        read_vertices(reader, header, builder, bytes.size());
    }
    else
    {
        BinaryReader reader(source, bytes, header);
        read_vertices(reader, header, builder, bytes.size());
    }
    RawCloud cloud = builder.finish(name_of(header.encoding));
    cloud.written_offset = header.written_offset;
    return cloud;
}

}  // namespace mp2p_icp
