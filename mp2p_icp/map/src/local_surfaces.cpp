#include <mp2p_icp/block_grid.h>
#include <mp2p_icp/local_surfaces.h>
#include <mp2p_icp/numbers.h>
#include <mp2p_icp/parallel.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace mp2p_icp
{
SurfaceShape LocalSurface::shape(const ShapeLimits& limits) const
{
    const double e0 = double(eigenvalues[0]), e1 = double(eigenvalues[1]), e2 = double(eigenvalues[2]);
    if (!(e2 > 0) || !std::isfinite(e2)) return SurfaceShape::Unknown;
    if (e1 <= limits.line * e2)
        return count >= limits.line_points ? SurfaceShape::Linear : SurfaceShape::Unknown;
    if (e0 <= limits.plane * e2 && e1 >= limits.plane_width * e2)
        return count >= limits.plane_points ? SurfaceShape::Planar : SurfaceShape::Unknown;
    return SurfaceShape::Other;
}

namespace
{
/// An eigenvector has no sign of its own: makes the first of its largest components positive.
Eigen::Vector3f with_sign(const Eigen::Vector3d& v)
{
    const Eigen::Vector3f f = v.cast<float>();
    Eigen::Index largest = 0;
    for (const Eigen::Index i : {1, 2})
        if (std::abs(f[i]) > std::abs(f[largest])) largest = i;
    return f[largest] < 0 ? Eigen::Vector3f(-f) : f;
}

class SurfaceMaker
{
 public:
    SurfaceMaker(const mrpt::maps::CPointsMap& points, const NearestNeighborIndex& index,
                 const LocalSurfaceOptions& options)
        : x_(points.getPointsBufferRef_x().data()),
          y_(points.getPointsBufferRef_y().data()),
          z_(points.getPointsBufferRef_z().data()),
          index_(index),
          k_(options.neighbors),
          max_dist_sq_(static_cast<float>(options.radius * options.radius))
    {
    }

    /// Those of the points first ... last - 1, with one call of the index.
    void make(size_t first, size_t last, LocalSurface* out) const
    {
        const size_t n = last - first;
        PointArrays queries;
        queries.x.assign(x_ + first, x_ + last);
        queries.y.assign(y_ + first, y_ + last);
        queries.z.assign(z_ + first, z_ + last);
        const std::vector<float> limits(n, max_dist_sq_);
        std::vector<uint32_t> ids(n * k_);
        std::vector<float> dist_sq(n * k_);
        index_.nearest(queries, 0, n, k_, limits.data(), ids.data(), dist_sq.data());
        for (size_t i = 0; i < n; i++)
        {
            const auto begin = ids.begin() + static_cast<std::ptrdiff_t>(i * k_);
            auto end = begin;
            while (end != begin + static_cast<std::ptrdiff_t>(k_) && *end != NO_NEIGHBOR) ++end;
            // In the order of the layer: the sums then depend on the set alone.
            std::sort(begin, end);
            out[first + i] = surface(first + i, &*begin, static_cast<size_t>(end - begin));
        }
    }

 private:
    /// Sums run over differences to the point, which are exact in double.
    LocalSurface surface(size_t point, const uint32_t* ids, size_t count) const
    {
        LocalSurface s;
        const Eigen::Vector3d origin = at(point);
        if (count == 0 || !origin.allFinite()) return s;
        const double share = 1.0 / static_cast<double>(count);
        Eigen::Vector3d mean = Eigen::Vector3d::Zero();
        for (size_t j = 0; j < count; j++) mean += at(ids[j]) - origin;
        mean *= share;
        Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
        for (size_t j = 0; j < count; j++)
        {
            const Eigen::Vector3d d = at(ids[j]) - origin - mean;
            covariance += d * d.transpose();
        }
        covariance *= share;
        const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(covariance);
        s.count = static_cast<uint32_t>(count);
        s.to_mean = mean.cast<float>();
        s.eigenvalues = eigen.eigenvalues().cwiseMax(0.0).cast<float>();
        s.normal = with_sign(eigen.eigenvectors().col(0));
        s.direction = with_sign(eigen.eigenvectors().col(2));
        return s;
    }

    Eigen::Vector3d at(size_t i) const { return {double(x_[i]), double(y_[i]), double(z_[i])}; }

    const float *x_, *y_, *z_;
    const NearestNeighborIndex& index_;
    uint32_t k_;
    float max_dist_sq_;
};

void check(const LocalSurfaceOptions& options)
{
    if (options.voxel > 0 && std::isfinite(options.voxel)) return;
    if (options.voxel != 0)
        throw std::invalid_argument("local surfaces: 'voxel' must be positive and finite, or 0, not " +
                                    to_text(options.voxel));
    if (options.neighbors < 1)
        throw std::invalid_argument("local surfaces: 'neighbors' must be at least 1, not 0");
    if (!(options.radius > 0) || !std::isfinite(options.radius))
        throw std::invalid_argument("local surfaces: 'radius' must be positive and finite, not " +
                                    to_text(options.radius));
}

LocalSurface as_local_surface(const VoxelSurface& v, const Eigen::Vector3f& point)
{
    LocalSurface s;
    s.to_mean = Eigen::Vector3f(v.mean_x, v.mean_y, v.mean_z) - point;
    s.normal = {v.nx, v.ny, v.nz}, s.direction = {v.dx, v.dy, v.dz};
    s.eigenvalues = {v.eigenvalues[0], v.eigenvalues[1], v.eigenvalues[2]};
    s.count = v.count, s.voxels = v.voxels;
    return s;
}
}  // namespace

LocalSurfaces::ConstPtr local_surfaces_of(const PointView& points, const SurfacesOfVoxels& voxels,
                                          const LocalSurfaceOptions& options)
{
    const auto out = std::make_shared<LocalSurfaces>();
    out->options = options;
    out->of_point.resize(points.size);
    for (size_t i = 0; i < points.size; i++)
        if (const uint32_t v = voxels.voxel_of_point[i]; v != NO_NEIGHBOR)
            out->of_point[i] = as_local_surface(voxels.of_voxel[v], {points.x[i], points.y[i], points.z[i]});
    return out;
}

LocalSurfaces::ConstPtr compute_local_surfaces(const mrpt::maps::CPointsMap& points,
                                               const NearestNeighborIndex* index,
                                               const LocalSurfaceOptions& options)
{
    check(options);
    if (options.voxel > 0) return local_surfaces_of(points, voxel_surfaces(points, options.voxel), options);
    if (!index) throw std::invalid_argument("local surfaces: neighbours need an index");
    if (index->size() != points.size())
        throw std::invalid_argument("local surfaces: the index is of " + std::to_string(index->size()) +
                                    " points, the layer has " + std::to_string(points.size()));
    const auto out = std::make_shared<LocalSurfaces>();
    out->options = options;
    out->of_point.resize(points.size());
    const SurfaceMaker maker(points, *index, options);
    parallel_for_blocks(points.size(),
                        [&](size_t first, size_t last) { maker.make(first, last, out->of_point.data()); });
    return out;
}

}  // namespace mp2p_icp
