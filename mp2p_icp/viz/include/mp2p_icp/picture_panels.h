#pragma once

#include <mrpt/img/CImage.h>
#include <mrpt/img/TColor.h>

#include <string>
#include <utility>
#include <vector>

namespace mp2p_icp
{
/// A rectangle of a picture, in pixels from its left and top borders.
struct PictureArea
{
    int left = 0, top = 0, width = 0, height = 0;
};

/// \exception std::invalid_argument naming `what` for a size that is not in [lowest, 4096].
void check_picture_size(int value, int lowest, const char* what);

/** A white picture with captions at its top, panels of equal size side by side (and one above the other),
 * each with a title, and a footer for a legend and a scale bar. Draw into panels first, then finish().
 */
class PicturePanels
{
 public:
    /// \param titles one per panel; `columns` of them stand side by side
    PicturePanels(int width, int height, const std::vector<std::string>& captions,
                  const std::vector<std::string>& titles, int columns);

    const std::vector<PictureArea>& panels() const { return panels_; }
    void draw(size_t panel, const mrpt::img::CImage& content);

    using Legend = std::vector<std::pair<std::string, mrpt::img::TColor>>;
    /// Captions, titles, lines between the panels, legend and scale bar.
    mrpt::img::CImage finish(const Legend& legend, double metres_per_px);

 private:
    int line_height() const;
    void draw_texts();
    void draw_borders();
    void draw_legend(const Legend& legend, int right);

    int scale_ = 1, pad_ = 0;
    std::vector<std::string> captions_, titles_;
    int captions_top_ = 0, footer_top_ = 0;
    std::vector<PictureArea> panels_;
    mrpt::img::CImage image_;
};

/// Writes a picture; the suffix of the path decides the format. \exception DataError if it cannot be written.
void save_picture(const mrpt::img::CImage& image, const std::string& path);

}  // namespace mp2p_icp
