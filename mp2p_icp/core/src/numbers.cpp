#include <mp2p_icp/numbers.h>

#include <cctype>
#include <charconv>
#include <limits>

namespace mp2p_icp
{
std::string to_text(double value)
{
    if (std::isnan(value)) return ".nan";
    if (std::isinf(value)) return value > 0 ? ".inf" : "-.inf";
    char buffer[32];
    const auto end = std::to_chars(buffer, buffer + sizeof(buffer), value).ptr;
    return std::string(buffer, end);
}

std::optional<double> to_number(const std::string& text)
{
    const bool has_sign = !text.empty() && (text[0] == '+' || text[0] == '-');
    const double sign = has_sign && text[0] == '-' ? -1.0 : 1.0;
    std::string digits = text.substr(has_sign ? 1 : 0);
    for (auto& c : digits) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (digits == ".inf" || digits == "inf") return sign * std::numeric_limits<double>::infinity();
    if (digits == ".nan" || digits == "nan") return std::numeric_limits<double>::quiet_NaN();
    // from_chars() takes a sign of its own, and words.
    if (digits.empty() || (digits[0] != '.' && !std::isdigit(static_cast<unsigned char>(digits[0]))))
        return {};
    double value = 0;
    const char* end = digits.data() + digits.size();
    const auto [stop, problem] = std::from_chars(digits.data(), end, value);
    if (problem != std::errc() || stop != end) return {};
    return sign * value;
}

}  // namespace mp2p_icp
