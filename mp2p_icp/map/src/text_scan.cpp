#include "text_scan.h"

#include <charconv>
#include <cmath>
#include <limits>

namespace mp2p_icp
{
bool LineScanner::next(std::string_view& line)
{
    if (at_ >= text_.size()) return false;
    const size_t end = text_.find('\n', at_);
    line = text_.substr(at_, end == std::string_view::npos ? end : end - at_);
    at_ = end == std::string_view::npos ? text_.size() : end + 1;
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    number_++;
    return true;
}

bool split_words(std::string_view line, Separators separators, std::vector<std::string_view>& words,
                 size_t max_words)
{
    words.clear();
    const auto is_blank = [](char c) { return c == ' ' || c == '\t'; };
    const auto is_comma = [&](char c)
    { return separators == Separators::BlanksAndCommas && (c == ',' || c == ';'); };
    size_t i = 0;
    bool after_comma = false;
    while (true)
    {
        while (i < line.size() && is_blank(line[i])) i++;
        if (i == line.size()) return true;  // one comma at the end of a line is harmless
        const size_t begin = i;
        while (i < line.size() && !is_blank(line[i]) && !is_comma(line[i])) i++;
        if (words.size() == max_words) return false;
        if (i > begin || after_comma || words.empty()) words.push_back(line.substr(begin, i - begin));
        while (i < line.size() && is_blank(line[i])) i++;
        after_comma = i < line.size() && is_comma(line[i]);
        if (after_comma) i++;
    }
}

std::optional<double> parse_number(std::string_view word)
{
    if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error == std::errc::invalid_argument) return {};
    const std::string_view left = word.substr(static_cast<size_t>(end - word.data()));
    if (!left.empty())  // `1.#QNAN`, `-1.#IND`, `1.#INF`: Visual C++ of old; `-nan(ind)`: the newer one
    {
        if (left.substr(0, 4) == "#INF") return value * std::numeric_limits<double>::infinity();
        if (left[0] == '#' || (std::isnan(value) && left[0] == '('))
            return std::numeric_limits<double>::quiet_NaN();
        return {};
    }
    if (error == std::errc::result_out_of_range)
    {
        const bool tiny =
            word.find("e-") != std::string_view::npos || word.find("E-") != std::string_view::npos;
        return tiny ? 0.0 : std::numeric_limits<double>::infinity();
    }
    return value;
}

std::optional<uint64_t> parse_count(std::string_view word)
{
    uint64_t value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size()) return {};
    return value;
}

std::string shown(std::string_view text)
{
    constexpr size_t longest = 40;
    std::string out = "'";
    for (const char c : text.substr(0, longest)) out += c >= ' ' && c < 127 ? c : '?';
    return out + (text.size() > longest ? "...'" : "'");
}

}  // namespace mp2p_icp
