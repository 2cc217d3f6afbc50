#include "scale_bar.h"

#include <mp2p_icp/numbers.h>

#include <cmath>

namespace mp2p_icp
{
double round_length(double limit)
{
    const double decade = std::pow(10.0, std::floor(std::log10(limit)));
    for (const double step : {5.0, 2.0})
        if (step * decade <= limit) return step * decade;
    return decade;
}

std::string length_text(double metres)
{
    char digits[32];
    std::snprintf(digits, sizeof(digits), "%.1g", metres);  // one digit says it all: 1, 2 or 5
    const double shown = *to_number(digits);
    return to_text(shown) + " m";
}

void draw_scale_bar(mrpt::img::CImage& picture, int right, int top, int max_width, double metres_per_px,
                    const Lettering& lettering)
{
    const double length = round_length(max_width * metres_per_px);
    const int width = static_cast<int>(std::lround(length / metres_per_px));
    const int left = right - width, middle = top + lettering.line_height() / 2, tick = 5 * lettering.scale;
    const mrpt::img::TColor black(0, 0, 0);
    const int half_thickness = lettering.scale;
    picture.filledRectangle(left, middle - half_thickness, right, middle + half_thickness, black);
    for (const int end : {left, right})
        picture.filledRectangle(end - half_thickness / 2, middle - tick, end + half_thickness / 2,
                                middle + tick, black);
    const std::string label = length_text(length);
    draw_text(picture, left - lettering.width(label) - lettering.letter_width(), top, label, lettering);
}

}  // namespace mp2p_icp
