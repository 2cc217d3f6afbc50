#include <mp2p_icp/nn_index.h>
#include <mp2p_icp/point_fields.h>

#include <algorithm>
#include <nanoflann.hpp>

namespace mp2p_icp
{
namespace
{
/// nanoflann's view on three coordinate arrays.
struct CloudAdaptor
{
    const float *x, *y, *z;
    size_t count;
    size_t kdtree_get_point_count() const { return count; }
    float kdtree_get_pt(size_t i, size_t dim) const { return (dim == 0 ? x : dim == 1 ? y : z)[i]; }
    template <class Box>
    bool kdtree_get_bbox(Box&) const
    {
        return false;
    }
};

/// The finite points of a cloud that also has others, and their indices there. (A tree that holds one NaN
/// finds wrong neighbours.)
struct FinitePoints
{
    bool is_needed = false;
    PointArrays points;
    std::vector<uint32_t> original_id;  ///< increasing, so that ties stay in the order of the cloud

    explicit FinitePoints(const mrpt::maps::CPointsMap& cloud)
    {
        const std::vector<size_t> indices = finite_points(cloud);
        is_needed = indices.size() < cloud.size();
        if (!is_needed) return;
        points.resize(indices.size());
        original_id.assign(indices.begin(), indices.end());
        for (size_t k = 0; k < indices.size(); k++)
            cloud.getPointFast(indices[k], points.x[k], points.y[k], points.z[k]);
    }
    CloudAdaptor adaptor(const mrpt::maps::CPointsMap& cloud) const
    {
        if (!is_needed)
            return {cloud.getPointsBufferRef_x().data(), cloud.getPointsBufferRef_y().data(),
                    cloud.getPointsBufferRef_z().data(), cloud.size()};
        return {points.x.data(), points.y.data(), points.z.data(), points.size()};
    }
};

/** The k nearest within a radius, ties by the lower index, so that the answer does not depend on how the tree
 * was walked. Contract: nanoflann's result sets (addPoint, worstDist, full).
 */
class BoundedNearest
{
 public:
    BoundedNearest(uint32_t k, float max_dist_sq, uint32_t* ids, float* dist_sq)
        : k_(k), limit_(max_dist_sq), ids_(ids), dist_sq_(dist_sq)
    {
    }
    uint32_t count() const { return count_; }
    bool full() const { return count_ == k_; }
    float worstDist() const
    {
        // The tree skips what is not nearer than this, by distances that it sums with rounding of its own: a
        // little more lets all candidates and ties through to addPoint(), which is exact.
        const float worst = full() ? std::min(limit_, dist_sq_[k_ - 1]) : limit_;
        return std::nextafter(worst * (1 + 1e-5f), std::numeric_limits<float>::infinity());
    }
    bool addPoint(float dist_sq, uint32_t id)
    {
        if (!(dist_sq < limit_)) return true;
        const auto before = [&](uint32_t slot)
        { return dist_sq < dist_sq_[slot] || (dist_sq == dist_sq_[slot] && id < ids_[slot]); };
        if (full() && !before(k_ - 1)) return true;
        uint32_t slot = full() ? k_ - 1 : count_++;
        for (; slot > 0 && before(slot - 1); slot--)
            dist_sq_[slot] = dist_sq_[slot - 1], ids_[slot] = ids_[slot - 1];
        dist_sq_[slot] = dist_sq, ids_[slot] = id;
        return true;
    }

 private:
    uint32_t k_, count_ = 0;
    float limit_;
    uint32_t* ids_;
    float* dist_sq_;
};

class KdTreeIndex : public NearestNeighborIndex
{
 public:
    KdTreeIndex(const mrpt::maps::CPointsMap::ConstPtr& points, uint32_t leaf_max_points)
        : points_(points),
          finite_(*points),
          cloud_(finite_.adaptor(*points)),
          tree_(3, cloud_,
                nanoflann::KDTreeSingleIndexAdaptorParams(leaf_max_points ? leaf_max_points
                                                                          : 10))  // builds it, too
    {
    }

    size_t size() const override { return points_->size(); }

    std::optional<mrpt::math::TBoundingBoxf> bounding_box() const override
    {
        if (cloud_.count == 0) return {};
        const auto& b = tree_.root_bbox;
        return mrpt::math::TBoundingBoxf({b[0].low, b[1].low, b[2].low}, {b[0].high, b[1].high, b[2].high});
    }

    void nearest(const PointArrays& queries, size_t first, size_t last, uint32_t k, const float* max_dist_sq,
                 uint32_t* ids, float* dist_sq) const override
    {
        if (k == 0) return;
        for (size_t i = first; i < last; i++)
        {
            BoundedNearest found(k, max_dist_sq[i], ids + i * k, dist_sq + i * k);
            const float query[3] = {queries.x[i], queries.y[i], queries.z[i]};
            if (cloud_.count > 0) tree_.findNeighbors(found, query, nanoflann::SearchParams());
            if (finite_.is_needed)
                for (uint32_t* id = ids + i * k; id != ids + i * k + found.count(); ++id)
                    *id = finite_.original_id[*id];
            std::fill(ids + i * k + found.count(), ids + (i + 1) * k, NO_NEIGHBOR);
            std::fill(dist_sq + i * k + found.count(), dist_sq + (i + 1) * k,
                      std::numeric_limits<float>::infinity());
        }
    }

    void nearest_and_bound(const PointArrays& queries, size_t first, size_t last, const float* max_dist_sq,
                           uint32_t* ids, float* dist_sq, float* others) const override
    {
        std::vector<uint32_t> two_ids(2 * last);
        std::vector<float> two(2 * last);
        nearest(queries, first, last, 2, max_dist_sq, two_ids.data(), two.data());
        for (size_t i = first; i < last; i++)
        {
            ids[i] = two_ids[2 * i], dist_sq[i] = two[2 * i];
            others[i] = surely_nearer_than(std::min(max_dist_sq[i], two[2 * i + 1]));
        }
    }

 private:
    using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, CloudAdaptor>,
                                                     CloudAdaptor, 3, uint32_t>;
    mrpt::maps::CPointsMap::ConstPtr points_;
    FinitePoints finite_;
    CloudAdaptor cloud_;
    Tree tree_;
};
}  // namespace

NearestNeighborIndex::ConstPtr make_kdtree_index(const mrpt::maps::CPointsMap::ConstPtr& points,
                                                 uint32_t leaf_max_points)
{
    return std::make_shared<KdTreeIndex>(points, leaf_max_points);
}

}  // namespace mp2p_icp
