#pragma once

#include "picture_text.h"

namespace mp2p_icp
{
/// The largest of ..., 0.1, 0.2, 0.5, 1, 2, 5, ... that is not above `limit` (positive).
double round_length(double limit);

/// Such as `0.05 m`, `20 m`.
std::string length_text(double metres);

/// A bar of a round length with its label, ending at `right`; at most `max_width` pixels long.
void draw_scale_bar(mrpt::img::CImage& picture, int right, int top, int max_width, double metres_per_px,
                    const Lettering& lettering);

}  // namespace mp2p_icp
