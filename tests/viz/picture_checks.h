#pragma once

#include <mrpt/img/CImage.h>
#include <mrpt/img/TColor.h>
#include <mrpt/math/TPoint2D.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace mp2p_icp_test
{
inline mrpt::img::TColor color_at(const mrpt::img::CImage& image, int x, int y)
{
    const auto* bgr = image.ptr<uint8_t>(static_cast<unsigned>(x), static_cast<unsigned>(y));
    return {bgr[2], bgr[1], bgr[0]};
}

/// Equal up to the rounding of scaling the picture down.
inline bool like(const mrpt::img::TColor& a, const mrpt::img::TColor& b)
{
    constexpr int ROUNDING = 3;
    return std::abs(a.R - b.R) <= ROUNDING && std::abs(a.G - b.G) <= ROUNDING &&
           std::abs(a.B - b.B) <= ROUNDING;
}

/// How many pixels of a rectangle have that colour.
inline size_t count(const mrpt::img::CImage& image, const mrpt::img::TColor& color, int left, int top,
                    int width, int height)
{
    size_t n = 0;
    for (int y = top; y < top + height; y++)
        for (int x = left; x < left + width; x++) n += like(color_at(image, x, y), color);
    return n;
}

inline size_t count(const mrpt::img::CImage& image, const mrpt::img::TColor& color)
{
    return count(image, color, 0, 0, static_cast<int>(image.getWidth()), static_cast<int>(image.getHeight()));
}

/// Is the colour within one pixel of that place?
inline bool seen_at(const mrpt::img::CImage& image, const mrpt::math::TPoint2D& pixel,
                    const mrpt::img::TColor& color)
{
    const int x = static_cast<int>(std::floor(pixel.x)), y = static_cast<int>(std::floor(pixel.y));
    if (x < 1 || y < 1 || x + 2 > static_cast<int>(image.getWidth()) ||
        y + 2 > static_cast<int>(image.getHeight()))
        return false;
    return count(image, color, x - 1, y - 1, 3, 3) > 0;
}

const mrpt::img::TColor WHITE(255, 255, 255), RED(255, 0, 0), GREEN(0, 255, 0);
}  // namespace mp2p_icp_test
