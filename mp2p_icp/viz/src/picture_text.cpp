#include "picture_text.h"

#include <algorithm>

namespace mp2p_icp
{
namespace
{
bool starts_a_letter(char byte)
{
    return (static_cast<unsigned char>(byte) & 0xC0u) != 0x80u;
}  // in UTF-8

size_t letters(const std::string& text)
{
    return static_cast<size_t>(std::count_if(text.begin(), text.end(), starts_a_letter));
}

/// Bytes of the first `count` letters.
size_t bytes_of(const std::string& text, size_t count)
{
    size_t byte = 0;
    for (; byte < text.size(); byte++)
        if (starts_a_letter(text[byte]) && count-- == 0) break;
    return byte;
}

/// Where to break a text that is too long: behind the last space that fits, or in the middle of a word.
size_t break_position(const std::string& text, size_t max_letters)
{
    const size_t fits = bytes_of(text, max_letters);
    const size_t space = text.rfind(' ', fits);
    return space == std::string::npos || space == 0 ? fits : space;
}
}  // namespace

int Lettering::width(const std::string& text) const
{
    return static_cast<int>(letters(text)) * letter_width();
}

void draw_text(mrpt::img::CImage& picture, int left, int top, const std::string& text,
               const Lettering& lettering)
{
    const Lettering unscaled;
    if (text.empty()) return;
    const auto width = static_cast<unsigned>(unscaled.width(text)),
               height = static_cast<unsigned>(unscaled.line_height());
    mrpt::img::CImage strip(width, height, mrpt::img::CH_RGB);
    strip.filledRectangle(0, 0, unscaled.width(text), unscaled.line_height(), {255, 255, 255});
    strip.selectTextFont("10x20");
    strip.textOut(0, 0, text, {0, 0, 0});
    const auto scale = static_cast<unsigned>(lettering.scale);
    strip.scaleImage(strip, width * scale, height * scale, mrpt::img::IMG_INTERP_CUBIC);

    const int room_right = static_cast<int>(picture.getWidth()) - left,
              room_below = static_cast<int>(picture.getHeight()) - top;
    if (left < 0 || top < 0 || room_right <= 0 || room_below <= 0) return;
    mrpt::img::CImage visible;
    strip.extract_patch(visible, 0, 0, std::min(width * scale, static_cast<unsigned>(room_right)),
                        std::min(height * scale, static_cast<unsigned>(room_below)));
    picture.drawImage(left, top, visible);
}

std::vector<std::string> wrapped(const std::vector<std::string>& texts, size_t max_letters)
{
    std::vector<std::string> lines;
    for (std::string rest : texts)
    {
        while (letters(rest) > std::max<size_t>(1, max_letters))
        {
            const size_t at = break_position(rest, std::max<size_t>(1, max_letters));
            lines.push_back(rest.substr(0, at));
            rest.erase(0, rest[at] == ' ' ? at + 1 : at);
        }
        lines.push_back(rest);
    }
    return lines;
}

}  // namespace mp2p_icp
