#include "html_text.h"

#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>

namespace mp2p_icp
{
namespace
{
constexpr const char* REPLACEMENT = "\xEF\xBF\xBD";  // U+FFFD

bool is_continuation(const std::string& text, size_t i)
{
    return i < text.size() && (static_cast<unsigned char>(text[i]) & 0xC0u) == 0x80u;
}

/// How many bytes of sound UTF-8 begin here; 0 if none do.
size_t letter_length(const std::string& text, size_t i)
{
    const auto byte = static_cast<unsigned char>(text[i]);
    if (byte < 0x80) return 1;
    const size_t length = byte >= 0xF0 ? 4 : byte >= 0xE0 ? 3 : 2;
    if (byte < 0xC2 || byte > 0xF4) return 0;
    for (size_t k = 1; k < length; k++)
        if (!is_continuation(text, i + k)) return 0;
    const auto second = static_cast<unsigned char>(text[i + 1]);
    const bool overlong = (byte == 0xE0 && second < 0xA0) || (byte == 0xF0 && second < 0x90);
    const bool beyond = (byte == 0xED && second > 0x9F) || (byte == 0xF4 && second > 0x8F);
    return overlong || beyond ? 0 : length;
}

/// The text with each sound letter replaced by what `letter` makes of it.
template <class Letter>
std::string rewritten(const std::string& text, const Letter& letter)
{
    std::string out;
    for (size_t i = 0; i < text.size();)
    {
        const size_t length = letter_length(text, i);
        out += length ? letter(text.substr(i, length)) : std::string(REPLACEMENT);
        i += std::max<size_t>(1, length);
    }
    return out;
}

bool is_control(const std::string& letter)
{
    const auto byte = static_cast<unsigned char>(letter[0]);
    return (byte < 0x20 && byte != '\n' && byte != '\t') || byte == 0x7F;
}

std::string printed(const char* format, int digits, double value)
{
    char buffer[400];  // %f of the largest double takes 309 digits
    std::snprintf(buffer, sizeof(buffer), format, digits, value);
    return buffer;
}

/// What stands for a number that cannot be printed; empty if it can be.
std::string instead_of_number(double value)
{
    if (std::isnan(value)) return "–";
    if (std::isinf(value)) return value > 0 ? "∞" : "−∞";
    return {};
}
}  // namespace

std::string html_escaped(const std::string& text)
{
    return rewritten(text,
                     [](const std::string& letter) -> std::string
                     {
                         if (is_control(letter)) return REPLACEMENT;
                         switch (letter[0])
                         {
                             case '&':
                                 return "&amp;";
                             case '<':
                                 return "&lt;";
                             case '>':
                                 return "&gt;";
                             case '"':
                                 return "&quot;";
                             case '\'':
                                 return "&#39;";
                             default:
                                 return letter;
                         }
                     });
}

std::string json_string(const std::string& text)
{
    static const char* HEX = "0123456789abcdef";
    // A script ends at `</script`, whatever language it is in.
    return '"' +
           rewritten(text,
                     [](const std::string& letter) -> std::string
                     {
                         const auto byte = static_cast<unsigned char>(letter[0]);
                         if (byte >= 0x20 && byte != '"' && byte != '\\' && byte != '<') return letter;
                         return std::string("\\u00") + HEX[byte >> 4u] + HEX[byte & 15u];
                     }) +
           '"';
}

std::string base64(const void* bytes, size_t count)
{
    static const char* LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const auto* in = static_cast<const unsigned char*>(bytes);
    std::string out;
    out.reserve((count + 2) / 3 * 4);
    for (size_t i = 0; i < count; i += 3)
    {
        const size_t here = std::min<size_t>(3, count - i);
        uint32_t bits = 0;
        for (size_t k = 0; k < 3; k++) bits = bits << 8u | (k < here ? in[i + k] : 0u);
        for (size_t k = 0; k < 4; k++) out += k <= here ? LETTERS[bits >> (18 - 6 * k) & 63u] : '=';
    }
    return out;
}

std::string fixed_text(double value, int decimals)
{
    const std::string instead = instead_of_number(value);
    if (!instead.empty()) return instead;
    std::string text = printed("%.*f", decimals, value);
    // A zero has no sign.
    if (text[0] == '-' && text.find_first_not_of("-0.") == std::string::npos) text.erase(0, 1);
    return text;
}

std::string rounded_text(double value, int digits)
{
    const std::string instead = instead_of_number(value);
    return instead.empty() ? printed("%.*g", digits, value) : instead;
}

std::string distance_text(double metres)
{
    struct Unit
    {
        double metres;
        const char* name;
    };
    for (const Unit unit : {Unit{1e3, " km"}, Unit{1, " m"}, Unit{1e-3, " mm"}, Unit{1e-6, " µm"}})
        if (std::abs(metres) >= unit.metres * (unit.metres > 1 ? 10 : 0.1) && std::abs(metres) < 1e9)
            return rounded_text(metres / unit.metres, std::abs(metres) / unit.metres >= 1000 ? 4 : 3) +
                   unit.name;
    return rounded_text(metres, 3) + (std::isfinite(metres) ? " m" : "");
}

std::string degrees_text(double radians)
{
    return rounded_text(mrpt::RAD2DEG(radians), 3) + (std::isfinite(radians) ? "°" : "");
}

std::string count_text(size_t count)
{
    std::string text = std::to_string(count);
    for (auto at = static_cast<std::ptrdiff_t>(text.size()) - 3; at > 0; at -= 3)
        text.insert(static_cast<size_t>(at), "\xE2\x80\xAF");  // narrow no-break space
    return text;
}

}  // namespace mp2p_icp
