#pragma once

#include <mrpt/img/CImage.h>
#include <mrpt/img/TColor.h>

#include <string>
#include <vector>

namespace mp2p_icp
{
/// Letters of a fixed width, 10x20 pixels times a whole scale.
struct Lettering
{
    int scale = 1;

    int letter_width() const { return 10 * scale; }
    int line_height() const { return 22 * scale; }
    int width(const std::string& text) const;
};

/// Black on white (the ground under the text is painted white). What does not fit into the picture is cut
/// off.
void draw_text(mrpt::img::CImage& picture, int left, int top, const std::string& text,
               const Lettering& lettering);

/// Breaks texts at spaces into lines of at most `max_letters`; a longer word is broken anywhere.
std::vector<std::string> wrapped(const std::vector<std::string>& texts, size_t max_letters);

}  // namespace mp2p_icp
