#pragma once

#include <mp2p_icp/metricmap.h>
#include <mp2p_icp/ortho_view.h>
#include <mp2p_icp/picture_panels.h>
#include <mrpt/img/CImage.h>
#include <mrpt/img/TColor.h>
#include <mrpt/poses/CPose3D.h>

#include <string>
#include <vector>

namespace mp2p_icp
{
struct SnapshotOptions
{
    int width = 1600, height = 800;     ///< of the whole picture, pixels; 400..4096 and 300..4096
    std::vector<std::string> captions;  ///< lines above the picture; too long ones are wrapped
    ViewDirection direction;  ///< from where to look; by default chosen from the data, see fit_view()

    // Blue and orange of the Okabe-Ito palette: told apart by all kinds of colour vision, and in grey print.
    mrpt::img::TColor global_color{0x00, 0x72, 0xB2};
    mrpt::img::TColor local_color{0xD5, 0x5E, 0x00};
};

/// A finished picture, and how to find a world point in it.
struct AlignmentPicture
{
    mrpt::img::CImage image;
    OrthoView view;             ///< of both halves; world = the frame of the global map
    PictureArea before, after;  ///< where the clouds are drawn

    /// Pixel, in the whole picture, of a point of the world as drawn in one of the halves.
    mrpt::math::TPoint2D pixel(const PictureArea& half, const mrpt::math::TPoint3D& point) const;
};

/** Draws an alignment: on the left both maps before it (`local` at `guess`), on the right after it (`local`
 * at `result`), both seen from the same place; above them the captions, below them a legend and a scale
 * bar. Cloud layers only; planes, lines and points that are not finite are left out. The view fits the
 * bulk of all points, see fit_view().
 * \param guess,result poses of the local map as seen from the global one.
 * \exception std::invalid_argument for a map without a finite point, a pose that is not finite, or a size
 * out of range.
 * \exception std::runtime_error if this machine cannot render without a display (says which packages to
 * install).
 * Thread-safe. About 0.3 s.
 */
AlignmentPicture draw_alignment(const metric_map_t& global, const metric_map_t& local,
                                const mrpt::poses::CPose3D& guess, const mrpt::poses::CPose3D& result,
                                const SnapshotOptions& options = {});

/** draw_alignment() into a file; its suffix (`.png`, `.jpg`, ...) decides the format.
 * \exception DataError if the file cannot be written. Others as draw_alignment().
 */
void save_alignment_snapshot(const metric_map_t& global, const metric_map_t& local,
                             const mrpt::poses::CPose3D& guess, const mrpt::poses::CPose3D& result,
                             const SnapshotOptions& options, const std::string& png_path);

}  // namespace mp2p_icp
