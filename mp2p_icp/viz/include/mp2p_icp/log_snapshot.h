#pragma once

#include <mp2p_icp/log_scene.h>
#include <mp2p_icp/picture_panels.h>

#include <string>
#include <vector>

namespace mp2p_icp
{
/** `top` (x to the right, y upwards), `side` (x to the right, z upwards), `iso` (obliquely from above), or
 * `fit`: chosen from the data, see fit_view(). \exception std::invalid_argument for another name.
 */
ViewDirection view_from_name(const std::string& name);

struct LogSnapshotOptions
{
    int width = 1280, height = 800;     ///< of the whole picture, pixels; 200..4096
    ViewDirection direction;            ///< by default chosen from the data
    std::vector<std::string> captions;  ///< lines above the picture; too long ones are wrapped
    bool automatic_point_sizes =
        true;  ///< from the number of points, instead of those of the scene's options
};

/// A finished picture, and how to find a world point in it.
struct LogPicture
{
    mrpt::img::CImage image;
    OrthoView view;  ///< of all panels; world = the original coordinates of the global map
    std::vector<PictureArea> panels;

    /// Pixel, in the whole picture, of a point of the world as drawn in a panel.
    mrpt::math::TPoint2D pixel(size_t panel, const mrpt::math::TPoint3D& point) const;
};

/// Such as `aligned: converged, ... | quality 97.1 %, 12 iterations, rms 0.012 m`.
std::string verdict_caption(const LogRecord& log);

/** Draws a log at some moments, one panel each, all seen from the same place, with the options of the scene.
 * Leaves the scene at the last moment. A scene of a map alone has one moment.
 * \exception std::invalid_argument for no moment, one that the log does not hold, a size out of range, or
 * panels that would be smaller than 40 pixels.
 * \exception std::runtime_error if this machine cannot render without a display (says which packages to
 * install).
 */
LogPicture draw_log(LogScene& scene, const std::vector<LogMoment>& moments,
                    const LogSnapshotOptions& options = {});

/// Of many moments, the first, the last, and a choice that is denser at the beginning, where more happens.
std::vector<LogMoment> some_moments(const std::vector<LogMoment>& all, size_t at_most);

}  // namespace mp2p_icp
