#pragma once

#include <mp2p_icp/synthetic/TriangleMesh.h>

#include <limits>
#include <optional>
#include <vector>

namespace mp2p_icp::synthetic
{
/** Finds what a ray meets first among the triangles of a mesh. Both faces of a triangle are seen; its
 * border belongs to it, so that no ray slips between neighbours. Keeps its own copy of the mesh.
 * Thread-safe.
 */
class RayTracer
{
 public:
    struct Hit
    {
        double range;       ///< m, along the ray
        uint32_t triangle;  ///< index into the mesh; of two at the same range, either
    };

    /// Builds a tree of boxes: O(n log^2 n).
    explicit RayTracer(const TriangleMesh& mesh);

    /** What the ray from `origin` meets first.
     * \param direction must have length 1
     * \return the nearest hit with a range in [0, max_range], if any. About a microsecond.
     */
    std::optional<Hit> first_hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                 double max_range = std::numeric_limits<double>::infinity()) const;

 private:
    struct Node
    {
        Eigen::Vector3d lo, hi;  // box around all triangles below this node
        uint32_t first =
            0;  // leaf: first of its entries in order_; else: the second child (the first child comes next)
        uint32_t count = 0;  // of triangles in a leaf; 0: not a leaf
    };

    void build(size_t first, size_t last);

    std::vector<Triangle> triangles_;
    std::vector<uint32_t> order_;
    std::vector<Node> nodes_;
};

}  // namespace mp2p_icp::synthetic
