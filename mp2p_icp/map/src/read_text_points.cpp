#include <mp2p_icp/errors.h>

#include <algorithm>

#include "cloud_readers.h"
#include "text_scan.h"

namespace mp2p_icp
{
namespace
{
using Words = std::vector<std::string_view>;

bool is_comment(std::string_view line)
{
    return line.substr(0, 1) == "#" || line.substr(0, 2) == "//";
}
std::string_view comment_text(std::string_view line)
{
    return line.substr(line[0] == '#' ? 1 : 2);
}
bool is_blank(std::string_view line)
{
    return line.find_first_not_of(" \t") == std::string_view::npos;
}

/// The words of a line of names. Between commas the first word is the name: `x [m], y [m]` are two.
Words header_words(std::string_view line)
{
    constexpr size_t MOST = 4096;
    Words words;
    if (line.find_first_of(",;") == std::string_view::npos)
    {
        split_words(line, Separators::Blanks, words, MOST);
        return words;
    }
    Words in_field;
    while (!line.empty() && words.size() < MOST)
    {
        const size_t end = std::min(line.find_first_of(",;"), line.size());
        split_words(line.substr(0, end), Separators::Blanks, in_field, MOST);
        words.push_back(in_field.empty() ? std::string_view() : in_field[0]);
        line.remove_prefix(std::min(end + 1, line.size()));
    }
    return words;
}

/// Names of columns: words that are not numbers, x, y and z among them.
std::vector<std::string> column_names(std::string_view line)
{
    const Words words = header_words(line);
    if (words.size() < 3) return {};
    std::vector<std::string> names;
    bool seen[3] = {false, false, false};
    for (auto w : words)
    {
        if (!w.empty() && w.front() == '"') w.remove_prefix(1);
        if (!w.empty() && w.back() == '"') w.remove_suffix(1);
        if (parse_number(w)) return {};
        for (size_t k = 0; k < 3; k++)
            seen[k] = seen[k] || w == std::string(1, "xyz"[k]) || w == std::string(1, "XYZ"[k]);
        names.emplace_back(w);
    }
    return seen[0] && seen[1] && seen[2] ? names : std::vector<std::string>();
}

std::vector<std::string> default_names(size_t columns)
{
    if (columns == 4) return {"x", "y", "z", "intensity"};
    if (columns == 6) return {"x", "y", "z", "r", "g", "b"};
    std::vector<std::string> names = {"x", "y", "z"};
    for (size_t i = 3; i < columns; i++) names.push_back("column " + std::to_string(i + 1));
    return names;
}

/// What stands before the first row of numbers.
struct Preamble
{
    std::vector<std::string> names;  ///< empty: not given
    std::optional<mrpt::math::TPoint3D> written_offset;
    bool has_name_line = false;  ///< the names are a line of their own, not a comment
    std::string_view first_row;
    uint64_t first_row_line = 0;
};

Preamble read_preamble(const std::string& source, LineScanner& lines)
{
    Preamble p;
    std::string_view line;
    while (lines.next(line))
    {
        if (is_blank(line)) continue;
        if (is_comment(line))
        {
            const auto text = comment_text(line);
            if (const auto offset = offset_in_comment(text)) p.written_offset = offset;
            if (const auto names = column_names(text); !names.empty() && !p.has_name_line) p.names = names;
            continue;
        }
        const auto names = p.has_name_line ? std::vector<std::string>() : column_names(line);
        if (names.empty())
        {
            p.first_row = line;
            p.first_row_line = lines.line_number();
            return p;
        }
        p.names = names;
        p.has_name_line = true;
    }
    throw DataError(source, place_line(lines.line_number()), "a row of numbers", "the end of the file");
}

/// An upper bound for the rows: the memory for them is claimed once, and exactly where there are no comments.
uint64_t count_lines(std::string_view text)
{
    const auto ends = static_cast<uint64_t>(std::count(text.begin(), text.end(), '\n'));
    return ends + (text.empty() || text.back() == '\n' ? 0 : 1);
}

/// `0,5;1,25;3`, as programs write it in some countries, would be read as other columns, without a word.
void refuse_decimal_commas(const std::string& source, const Preamble& preamble)
{
    const auto has = [&](char c) { return preamble.first_row.find(c) != std::string_view::npos; };
    if (has(',') && has(';'))
        throw DataError(source, place_line(preamble.first_row_line),
                        "one kind of separator, and numbers with a decimal point", shown(preamble.first_row));
}

class RowReader
{
 public:
    RowReader(const std::string& source, size_t columns, RawCloudBuilder& builder)
        : source_(source), values_(columns), is_colour_(columns), builder_(builder)
    {
        for (size_t i = 0; i < columns; i++) is_colour_[i] = builder.is_colour(i);
    }

    void read(std::string_view line, uint64_t number)
    {
        const bool fits = split_words(line, Separators::BlanksAndCommas, words_, values_.size());
        if (!fits || words_.size() != values_.size())
            throw DataError(source_, place_line(number), std::to_string(values_.size()) + " numbers",
                            fits ? std::to_string(words_.size()) : "more");
        for (size_t i = 0; i < values_.size(); i++)
        {
            const auto value = parse_number(words_[i]);
            if (!value) throw DataError(source_, place_line(number), "a number", shown(words_[i]));
            values_[i] = *value;
            if (is_colour_[i] && !parse_count(words_[i])) builder_.set_colours_are_integers(false);
        }
        builder_.add_row(values_.data());
    }

 private:
    const std::string& source_;
    std::vector<double> values_;
    std::vector<bool> is_colour_;
    RawCloudBuilder& builder_;
    Words words_;
};
}  // namespace

RawCloud read_text_points(const std::string& source, std::string_view bytes)
{
    LineScanner lines(bytes);
    const auto preamble = read_preamble(source, lines);
    Words words;
    if (!split_words(preamble.first_row, Separators::BlanksAndCommas, words) || words.size() < 3)
        throw DataError(source, place_line(preamble.first_row_line), "three or more numbers",
                        shown(preamble.first_row));

    refuse_decimal_commas(source, preamble);
    // A comment with another number of names is just a comment.
    const bool named = preamble.names.size() == words.size();
    if (preamble.has_name_line && !named)
        throw DataError(source, place_line(preamble.first_row_line),
                        std::to_string(preamble.names.size()) + " numbers, as many as the columns have names",
                        std::to_string(words.size()));
    std::vector<CloudColumn> columns;
    for (const auto& name : named ? preamble.names : default_names(words.size()))
        columns.push_back({name, true});
    RawCloudBuilder builder(source, place_line(preamble.first_row_line), columns);
    builder.reserve(count_lines(lines.rest()) + 1, bytes.size());

    RowReader row(source, columns.size(), builder);
    row.read(preamble.first_row, preamble.first_row_line);
    std::string_view line;
    while (lines.next(line))
        if (!is_blank(line) && !is_comment(line)) row.read(line, lines.line_number());

    RawCloud cloud = builder.finish("text, " + std::to_string(columns.size()) + " columns");
    cloud.written_offset = preamble.written_offset;
    return cloud;
}

}  // namespace mp2p_icp
