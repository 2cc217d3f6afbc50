#include <mp2p_icp/errors.h>

#include "cloud_readers.h"
#include "text_scan.h"

namespace mp2p_icp
{
namespace
{
bool is_vertex(std::string_view line)
{
    return line.size() > 1 && line[0] == 'v' && (line[1] == ' ' || line[1] == '\t');
}

/// A vertex line may end in a comment.
std::string_view without_comment(std::string_view line)
{
    return line.substr(0, line.find('#'));
}

/// The number of vertices, and of words in the first vertex line.
struct Survey
{
    uint64_t vertices = 0;
    size_t words = 0;
    uint64_t first_line = 0;
};

Survey survey(const std::string& source, std::string_view bytes)
{
    Survey s;
    LineScanner lines(bytes);
    std::vector<std::string_view> words;
    std::string_view line;
    while (lines.next(line))
    {
        if (!is_vertex(line) || s.vertices++ > 0) continue;
        split_words(without_comment(line), Separators::Blanks, words, 16);
        s.words = words.size();
        s.first_line = lines.line_number();
    }
    if (s.vertices == 0)
        throw DataError(source, place_line(lines.line_number()), "a vertex ('v x y z')",
                        "the end of the file");
    if (s.words != 4 && s.words != 5 && s.words != 7)
        throw DataError(source, place_line(s.first_line), "'v x y z', 'v x y z w' or 'v x y z r g b'",
                        std::to_string(s.words) + " words");
    return s;
}
}  // namespace

RawCloud read_obj(const std::string& source, std::string_view bytes)
{
    const Survey s = survey(source, bytes);
    std::vector<CloudColumn> columns = {{"x"}, {"y"}, {"z"}};
    if (s.words == 5) columns.push_back({"w"});
    if (s.words == 7) columns.insert(columns.end(), {{"r"}, {"g"}, {"b"}});
    RawCloudBuilder builder(source, place_line(s.first_line), columns);
    builder.reserve(s.vertices, bytes.size());

    LineScanner lines(bytes);
    std::vector<std::string_view> words;
    std::vector<double> values(columns.size());
    std::string_view line;
    while (lines.next(line))
    {
        if (!is_vertex(line)) continue;
        if (!split_words(without_comment(line), Separators::Blanks, words, s.words) ||
            words.size() != s.words)
            throw DataError(source, place_line(lines.line_number()),
                            std::to_string(s.words - 1) + " numbers after 'v'", shown(line));
        for (size_t i = 0; i < values.size(); i++)
        {
            const auto value = parse_number(words[i + 1]);
            if (!value)
                throw DataError(source, place_line(lines.line_number()), "a number", shown(words[i + 1]));
            values[i] = *value;
        }
        builder.add_row(values.data());
    }
    return builder.finish("OBJ (vertices)");
}

}  // namespace mp2p_icp
