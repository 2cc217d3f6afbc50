#pragma once

#include <mrpt/opengl/CPointCloud.h>

#include <memory>

namespace mp2p_icp
{
/// A cloud that counts how often its points are sent to the graphics card, and is sent again only when that
/// is needed.
class UploadedCloud : public mrpt::opengl::CPointCloud
{
 public:
    explicit UploadedCloud(std::shared_ptr<size_t> uploads) : uploads_(std::move(uploads))
    {
        enableVariablePointSize(false);
    }

    /// Of the highest, and of the lowest points.
    static uint8_t lighter(uint8_t c) { return static_cast<uint8_t>(255 - (255 - c) / 4); }
    static uint8_t darker(uint8_t c) { return static_cast<uint8_t>(c / 3); }

    void style(const mrpt::img::TColor& color, bool by_height)
    {
        if (color == styled_color_ && by_height == by_height_) return;
        styled_color_ = color, by_height_ = by_height;
        setColor_u8(color);
        setGradientColors(
            mrpt::img::TColorf(mrpt::img::TColor(darker(color.R), darker(color.G), darker(color.B))),
            mrpt::img::TColorf(mrpt::img::TColor(lighter(color.R), lighter(color.G), lighter(color.B))));
        enableColorFromZ(by_height);
    }

    void renderUpdateBuffers() const override
    {
        ++*uploads_;
        CPointCloud::renderUpdateBuffers();
    }

 private:
    std::shared_ptr<size_t> uploads_;
    mrpt::img::TColor styled_color_{0, 0, 0, 0};
    bool by_height_ = false;
};

}  // namespace mp2p_icp
