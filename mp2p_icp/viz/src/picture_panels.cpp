#include <mp2p_icp/errors.h>
#include <mp2p_icp/picture_panels.h>

#include <algorithm>
#include <stdexcept>

#include "picture_text.h"
#include "scale_bar.h"

namespace mp2p_icp
{
namespace
{
const mrpt::img::TColor GREY(0xB0, 0xB0, 0xB0);
}

void check_picture_size(int value, int lowest, const char* what)
{
    constexpr int HIGHEST = 4096;
    if (value < lowest || value > HIGHEST)
        throw std::invalid_argument(std::string(what) + " must be in [" + std::to_string(lowest) + ", " +
                                    std::to_string(HIGHEST) + "], found " + std::to_string(value));
}

PicturePanels::PicturePanels(int width, int height, const std::vector<std::string>& captions,
                             const std::vector<std::string>& titles, int columns)
    : scale_(std::max(1, std::min(height / 360, width / 720))), pad_(8 * scale_), titles_(titles)
{
    const Lettering lettering{scale_};
    const int line = line_height();
    const int letters_per_line = (width - 2 * pad_) / lettering.letter_width();
    captions_ = wrapped(captions, static_cast<size_t>(letters_per_line));
    const int max_lines = height * 2 / 5 / line;  // the clouds are what matters
    if (static_cast<int>(captions_.size()) > max_lines) captions_.resize(static_cast<size_t>(max_lines));

    captions_top_ = pad_ / 2;
    footer_top_ = height - line - pad_ / 2;
    const int top = captions_top_ + static_cast<int>(captions_.size()) * line;
    const int rows = (static_cast<int>(titles.size()) + columns - 1) / columns;
    const int row_height = (footer_top_ - top) / rows, title_height = line + pad_ / 2;
    const int panel_width = (width - (columns - 1) * pad_) / columns;
    for (int i = 0; i < static_cast<int>(titles.size()); i++)
    {
        const int column = i % columns, row = i / columns;
        const int left = column == columns - 1 ? width - panel_width : column * (panel_width + pad_);
        panels_.push_back(
            {left, top + row * row_height + title_height, panel_width, row_height - title_height - pad_ / 2});
    }
    image_.resize(static_cast<size_t>(width), static_cast<size_t>(height), mrpt::img::CH_RGB);
    image_.filledRectangle(0, 0, width, height, {255, 255, 255});
}

int PicturePanels::line_height() const
{
    return Lettering{scale_}.line_height();
}

void PicturePanels::draw(size_t panel, const mrpt::img::CImage& content)
{
    image_.drawImage(panels_.at(panel).left, panels_.at(panel).top, content);
}

void PicturePanels::draw_texts()
{
    const Lettering lettering{scale_};
    for (size_t i = 0; i < captions_.size(); i++)
        draw_text(image_, pad_, captions_top_ + static_cast<int>(i) * line_height(), captions_[i], lettering);
    for (size_t i = 0; i < titles_.size(); i++)
    {
        const auto& area = panels_[i];
        const int left = area.left + std::max(0, (area.width - lettering.width(titles_[i])) / 2);
        draw_text(image_, left, area.top - line_height() - pad_ / 2, titles_[i], lettering);
    }
}

void PicturePanels::draw_borders()
{
    const int right = static_cast<int>(image_.getWidth());
    for (const auto& area : panels_)
    {
        const int bottom = area.top + area.height;
        image_.filledRectangle(area.left, area.top - 1, area.left + area.width, area.top - 1, GREY);
        image_.filledRectangle(area.left, bottom, area.left + area.width, bottom, GREY);
        if (area.left == 0) continue;
        const int middle = area.left - pad_ / 2;
        image_.filledRectangle(middle - 1, area.top - line_height() - pad_ / 2, middle, bottom, GREY);
    }
    const auto &first = panels_.front(), &last = panels_.back();
    image_.filledRectangle(0, first.top - 1, right, first.top - 1, GREY);
    image_.filledRectangle(0, last.top + last.height, right, last.top + last.height, GREY);
}

void PicturePanels::draw_legend(const Legend& legend, int right)
{
    const Lettering lettering{scale_};
    int left = pad_;
    const int box = lettering.letter_width(), box_top = footer_top_ + (line_height() - box) / 2;
    for (const auto& [name, color] : legend)
    {
        const int width = 4 * box + lettering.width(name);
        if (left + width > right) break;
        image_.filledRectangle(left, box_top, left + box, box_top + box, color);
        draw_text(image_, left + 2 * box, footer_top_, name, lettering);
        left += width;
    }
}

mrpt::img::CImage PicturePanels::finish(const Legend& legend, double metres_per_px)
{
    draw_texts();
    draw_borders();
    const int width = static_cast<int>(image_.getWidth()),
              bar = std::min(panels_.front().width, width / 2) / 3;
    draw_legend(legend, width - 2 * pad_ - bar - 10 * Lettering{scale_}.letter_width());
    draw_scale_bar(image_, width - 2 * pad_, footer_top_, bar, metres_per_px, Lettering{scale_});
    return image_;
}

void save_picture(const mrpt::img::CImage& image, const std::string& path)
{
    bool written = false;
    try
    {
        written = image.saveToFile(path);
    }
    catch (const std::exception&)
    {
        // OpenCV throws for an unknown suffix, and returns false for everything else.
    }
    if (!written)
        throw DataError(path,
                        "the picture cannot be written there (is the folder there? is the suffix .png?)");
}

}  // namespace mp2p_icp
