#include "cloud_object.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace mp2p_icp
{
using mrpt::img::TColor;
using mrpt::math::TPoint3Df;

namespace
{
using Cell = std::array<int64_t, 3>;

/// Each cell once.
std::vector<Cell> occupied_cells(const mrpt::opengl::CPointCloud& points, double side)
{
    std::vector<Cell> cells;
    cells.reserve(points.size());
    const auto cell = [side](float x)
    { return static_cast<int64_t>(std::floor(static_cast<double>(x) / side)); };
    for (size_t i = 0; i < points.size(); i++)
    {
        const auto p = points.getPoint3Df(i);
        cells.push_back({cell(p.x), cell(p.y), cell(p.z)});
    }
    std::sort(cells.begin(), cells.end());
    cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
    return cells;
}

/// Between darker and lighter, as points get with their height.
TColor color_at(const TColor& color, double share)
{
    const auto mixed = [share](uint8_t c)
    {
        return static_cast<uint8_t>(UploadedCloud::darker(c) +
                                    share * (UploadedCloud::lighter(c) - UploadedCloud::darker(c)));
    };
    return {mixed(color.R), mixed(color.G), mixed(color.B)};
}
}  // namespace

CloudObject::CloudObject(const std::vector<TPoint3Df>& vertices, double unit,
                         const std::shared_ptr<size_t>& uploads)
    : points_(std::make_shared<UploadedCloud>(uploads)), unit_(unit)
{
    points_->loadFromPointsList(vertices);
    insert(points_);
}

void CloudObject::style(const TColor& color, const MapStyle& style)
{
    const bool as_voxels = style.voxel_size > 0;
    points_->style(color, style.by_height);
    points_->setPointSize(style.point_size_px);
    points_->setVisibility(!as_voxels);
    if (as_voxels && (!voxels_ || voxel_size_ != style.voxel_size || voxel_color_ != color ||
                      voxels_by_height_ != style.by_height))
        make_voxels(color, style);
    if (voxels_) voxels_->setVisibility(as_voxels);
}

void CloudObject::make_voxels(const TColor& color, const MapStyle& style)
{
    // Finer than a millionth of the scene, cells could not be counted, nor seen.
    const double side = std::max(style.voxel_size / unit_, 1e-6);
    const auto cells = occupied_cells(*points_, side);
    const auto by_z = [](const Cell& a, const Cell& b) { return a[2] < b[2]; };
    const auto [low, high] = std::minmax_element(cells.begin(), cells.end(), by_z);
    const auto middle = [side](int64_t cell)
    { return static_cast<float>((static_cast<double>(cell) + 0.5) * side); };
    if (voxels_) removeObject(voxels_);
    voxels_ = mrpt::opengl::COctoMapVoxels::Create();
    voxels_->resizeVoxelSets(1);
    voxels_->reserveVoxels(0, cells.size());
    voxels_->showGridLines(false);
    for (const auto& c : cells)
    {
        const double height = (*high)[2] > (*low)[2] ? static_cast<double>(c[2] - (*low)[2]) /
                                                           static_cast<double>((*high)[2] - (*low)[2])
                                                     : 0;
        voxels_->push_back_Voxel(0, {TPoint3Df(middle(c[0]), middle(c[1]), middle(c[2])), side,
                                     style.by_height ? color_at(color, height) : color});
    }
    const auto box = points_->getBoundingBox();
    const mrpt::math::TPoint3D cube(side, side, side);
    voxels_->setBoundingBox(box.min - cube, box.max + cube);
    insert(voxels_);
    voxel_color_ = color, voxel_size_ = style.voxel_size, voxels_by_height_ = style.by_height;
}

}  // namespace mp2p_icp
