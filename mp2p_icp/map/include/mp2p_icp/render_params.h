#pragma once

#include <mrpt/img/TColor.h>
#include <mrpt/img/color_maps.h>

#include <map>
#include <optional>
#include <string>

namespace mp2p_icp
{
struct render_params_planes_t
{
    bool visible = true;
    double halfWidth = 1.0;     ///< half the side of the square drawn, m
    double gridSpacing = 0.25;  ///< m
    mrpt::img::TColor color{0xff, 0xff, 0xff, 0xff};
};

struct render_params_lines_t
{
    bool visible = true;
    mrpt::img::TColor color{0xff, 0x00, 0x00, 0xff};
    double length = 20.0;  ///< of the segment drawn, centred at the line's base point, m
};

enum class Coordinate : uint8_t
{
    X = 0,
    Y,
    Z
};

/// Colours by a coordinate.
struct color_mode_t
{
    bool keep_original_cloud_color = false;
    mrpt::img::TColormap colorMap = mrpt::img::cmHOT;
    std::optional<Coordinate> recolorizeByCoordinate;
    std::optional<float> colorMapMinCoord, colorMapMaxCoord;  ///< empty: from the data
};

struct render_params_point_layer_t
{
    float pointSize = 1.0f;
    mrpt::img::TColor color{0x00, 0x00, 0xff, 0xff};
    std::optional<color_mode_t> colorMode;
};

struct render_params_points_t
{
    bool visible = true;
    render_params_point_layer_t allLayers;  ///< when perLayer is empty
    std::map<std::string, render_params_point_layer_t>
        perLayer;  ///< if not empty, only these layers are drawn
};

struct render_params_t
{
    render_params_planes_t planes;
    render_params_lines_t lines;
    render_params_points_t points;
};

}  // namespace mp2p_icp
