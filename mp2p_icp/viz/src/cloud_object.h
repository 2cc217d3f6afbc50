#pragma once

#include <mp2p_icp/log_scene.h>
#include <mrpt/opengl/COctoMapVoxels.h>

#include <vector>

#include "uploaded_cloud.h"

namespace mp2p_icp
{
/// A cloud layer in the scene: its points, or the cubes of a grid in which there are any, made when they are
/// asked for.
class CloudObject : public mrpt::opengl::CSetOfObjects
{
 public:
    /// \param vertices in scene coordinates \param unit metres of one of these
    CloudObject(const std::vector<mrpt::math::TPoint3Df>& vertices, double unit,
                const std::shared_ptr<size_t>& uploads);

    size_t size() const { return points_->size(); }
    /// Touches only what has changed.
    void style(const mrpt::img::TColor& color, const MapStyle& style);

 private:
    void make_voxels(const mrpt::img::TColor& color, const MapStyle& style);

    std::shared_ptr<UploadedCloud> points_;
    double unit_;
    mrpt::opengl::COctoMapVoxels::Ptr voxels_;
    mrpt::img::TColor voxel_color_;
    double voxel_size_ = 0;
    bool voxels_by_height_ = false;
};

}  // namespace mp2p_icp
