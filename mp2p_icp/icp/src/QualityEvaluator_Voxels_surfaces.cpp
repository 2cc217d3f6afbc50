#include "QualityEvaluator_Voxels_surfaces.h"

#include <mp2p_icp/parallel.h>

#include <algorithm>
#include <cmath>

namespace mp2p_icp
{
namespace
{
/// Calls `use` for a voxel and the 26 around it.
template <class Use>
void for_each_around(const Voxel& v, const Use& use)
{
    for (int32_t dx = -1; dx <= 1; dx++)
        for (int32_t dy = -1; dy <= 1; dy++)
            for (int32_t dz = -1; dz <= 1; dz++) use(Voxel{v.x + dx, v.y + dy, v.z + dz});
}
}  // namespace

std::optional<Voxel> VoxelGrid::voxel_of(const Eigen::Vector3d& point) const
{
    constexpr double LIMIT = 1'000'000;
    const Eigen::Array3d v = (point.array() / side_).floor();
    if (!(v.abs() < LIMIT).all()) return {};
    return Voxel{static_cast<int32_t>(v[0]), static_cast<int32_t>(v[1]), static_cast<int32_t>(v[2])};
}

// ---- VoxelTable -------------------------------------------------------------------------------------------

size_t VoxelTable::slot_of(const Voxel& v) const
{
    const auto part = [](int32_t i, uint64_t factor) { return static_cast<uint64_t>(i) * factor; };
    uint64_t hash =
        part(v.x, 0x9E3779B97F4A7C15u) ^ part(v.y, 0xC2B2AE3D27D4EB4Fu) ^ part(v.z, 0x165667B19E3779F9u);
    hash = (hash ^ (hash >> 32)) * 0xD6E8FEB86659FD93u;
    size_t slot = static_cast<size_t>(hash >> 32) & (slots_.size() - 1);
    while (slots_[slot] != NONE && !(voxels_[slots_[slot]] == v)) slot = (slot + 1) & (slots_.size() - 1);
    return slot;
}

uint32_t VoxelTable::find(const Voxel& v) const
{
    return slots_.empty() ? NONE : slots_[slot_of(v)];
}

uint32_t VoxelTable::find_or_add(const Voxel& v)
{
    if (2 * (voxels_.size() + 1) > slots_.size()) grow();
    uint32_t& number = slots_[slot_of(v)];
    if (number == NONE)
    {
        number = static_cast<uint32_t>(voxels_.size());
        voxels_.push_back(v);
    }
    return number;
}

void VoxelTable::grow()
{
    slots_.assign(std::max<size_t>(64, 2 * slots_.size()), NONE);
    for (uint32_t i = 0; i < voxels_.size(); i++) slots_[slot_of(voxels_[i])] = i;
}

// ---- VoxelSurfaces ----------------------------------------------------------------------------------------

void VoxelSurfaces::add(const Eigen::Vector3d& point)
{
    const auto v = grid_.voxel_of(point);
    if (!v) return;
    const uint32_t number = table_.find_or_add(*v);
    if (number == sums_.size()) sums_.emplace_back();
    const Eigen::Vector3d d = point - grid_.centre_of(*v);
    Sums& s = sums_[number];
    s.count += 1, s.first += d, s.second += d * d.transpose();
}

VoxelSurfaces::Sums VoxelSurfaces::sums_around(const Voxel& v) const
{
    Sums total;
    for_each_around(v,
                    [&](const Voxel& other)
                    {
                        const uint32_t number = table_.find(other);
                        if (number == VoxelTable::NONE) return;
                        const Sums& s = sums_[number];
                        const Eigen::Vector3d shift = grid_.centre_of(other) - grid_.centre_of(v);
                        const Eigen::Matrix3d cross = s.first * shift.transpose();
                        total.count += s.count;
                        total.first += s.first + s.count * shift;
                        total.second +=
                            s.second + cross + cross.transpose() + s.count * shift * shift.transpose();
                    });
    return total;
}

SurfacePiece VoxelSurfaces::surface(const Voxel& v) const
{
    constexpr double LEAST_POINTS = 5, THICKNESS = 0.1,
                     WIDTH = 0.02;  // the latter two are ratios of variances
    const Sums s = sums_around(v);
    SurfacePiece out;
    const Eigen::Vector3d mean = s.first / s.count;
    out.mean = grid_.centre_of(v) + mean;
    Eigen::Matrix3d covariance = s.second / s.count - mean * mean.transpose();
    if (flat_)  // as if walls stood upon it
    {
        covariance.row(2).setZero(), covariance.col(2).setZero();
        covariance(2, 2) = grid_.side() * grid_.side();
    }
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
    eigen.computeDirect(covariance);
    out.axes = eigen.eigenvectors();
    out.variances = eigen.eigenvalues().cwiseMax(0.0);
    out.planar = s.count >= LEAST_POINTS && out.variances[0] <= THICKNESS * out.variances[1] &&
                 out.variances[1] >= WIDTH * out.variances[2];
    return out;
}

void VoxelSurfaces::finish()
{
    surfaces_.resize(sums_.size());
    parallel_for_blocks(surfaces_.size(),
                        [this](size_t first, size_t last)
                        {
                            for (size_t i = first; i < last; i++) surfaces_[i] = surface(table_.voxels()[i]);
                        });
}

double VoxelSurfaces::planar_share() const
{
    const auto planar =
        std::count_if(surfaces_.begin(), surfaces_.end(), [](const auto& s) { return s.planar; });
    return static_cast<double>(planar) / std::max(1.0, static_cast<double>(surfaces_.size()));
}

const SurfacePiece* VoxelSurfaces::at(const Voxel& v) const
{
    const uint32_t number = table_.find(v);
    return number == VoxelTable::NONE ? nullptr : &surfaces_[number];
}

VoxelSurfaces::Fit VoxelSurfaces::fit(const Eigen::Vector3d& point) const
{
    Fit out;
    const auto voxel = grid_.voxel_of(point);
    if (!voxel) return out;
    const double across_sq = sigma() * sigma(), along_sq = 0.25 * grid_.side() * grid_.side();
    const auto look = [&](const Voxel& v)
    {
        const SurfacePiece* piece = at(v);
        if (!piece) return;
        const Eigen::Array3d y = (piece->axes.transpose() * (point - piece->mean)).array().abs();
        // Evenly filled pieces end at sqrt(3) standard deviations.
        const Eigen::Array3d beyond = (y - (3 * piece->variances.array()).sqrt()).max(0.0);
        const double along = beyond[2] * beyond[2] + (piece->planar ? beyond[1] : 0.0) * beyond[1];
        const double across = piece->planar ? y[0] * y[0] / (across_sq + piece->variances[0])
                                            : (beyond[0] * beyond[0] + beyond[1] * beyond[1]) / along_sq;
        out.score = std::max(out.score, std::exp(-0.5 * (across + along / along_sq)));
        out.covered = out.covered || (piece->planar && along == 0);
    };
    for_each_around(*voxel, look);
    return out;
}

bool VoxelSurfaces::separates(const SurfacePiece& piece, const Voxel& v, const Eigen::Vector3d& point,
                              double from_range, double to_range) const
{
    if (!piece.planar) return false;
    const Eigen::Vector3d normal = piece.normal();
    const double height = normal.dot(point - piece.mean), at_origin = normal.dot(piece.mean);
    const double far = 3 * std::sqrt(sigma() * sigma() + piece.variances[0]);
    if (std::abs(height) < far || std::abs(at_origin) < far) return false;
    const double fraction = at_origin / normal.dot(point);  // of the way to the point
    const double range = fraction * point.norm();
    if (!(range >= from_range && range <= to_range)) return false;
    return ((fraction * point - grid_.centre_of(v)).array().abs() <= 0.51 * grid_.side()).all();
}

bool VoxelSurfaces::crosses(const Eigen::Vector3d& point, double from_range, double to_range) const
{
    const double step = 0.5 * grid_.side();
    const Eigen::Vector3d direction = point.normalized();
    std::optional<Voxel> before;
    const double steps = std::min(MAX_STEPS, std::floor((to_range - from_range) / step));
    for (double k = 0; k <= steps; k++)
    {
        const auto v = grid_.voxel_of((to_range - k * step) * direction);
        if (!v || (before && *before == *v)) continue;
        before = v;
        const SurfacePiece* piece = at(*v);
        if (piece && separates(*piece, *v, point, from_range, to_range)) return true;
    }
    return false;
}

}  // namespace mp2p_icp
