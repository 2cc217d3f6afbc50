#pragma once

#include <mp2p_icp/parallel.h>

#include <optional>

#include "pairing_sums.h"
#include "pose_quadratic.h"

namespace mp2p_icp
{
/// How point pairings count.
enum class PointVectors : uint8_t
{
    Lengths,          ///< as they are
    Units,            ///< as unit vectors
    UnitsWithSquares  ///< and their squares are summed, too (OLAE's least squares needs them)
};

/** The pairs of vectors that a closed form aligns by a rotation: point pairings relative to their centroids
 * (as they are, or of unit length), points on lines and planes paired with their projections at the guess,
 * and directions.
 */
class VectorSet
{
 public:
    /// `signs`: the rotation at which free directions get their sign. `guess`: empty if points on lines and
    /// planes are not to be projected.
    VectorSet(const PreparedPairings& in, const PairingSums& sums, PointVectors points,
              const Eigen::Matrix3d& signs, const std::optional<OriginPose>& guess);

    /// The sums over all of them.
    const PointSums& profile() const { return profile_; }
    /// The centroids of the points (and projections), relative to the origins.
    const Eigen::Vector3d& a_mean() const { return origin_.a_mean; }
    const Eigen::Vector3d& b_mean() const { return origin_.b_mean; }

    struct Pair
    {
        double w = 0;
        Eigen::Vector3d a, b;
    };
    /// Of the i-th pairing; w = 0 if it has none.
    Pair pair(size_t i) const;

 private:
    void add_projections(size_t from);
    Pair point_pair(const PairingId& id) const;
    Pair direction_pair(const PairingId& id) const;
    template <class Pairs>
    PointSums sum(size_t from, const Pairs& pairs) const
    {
        return block_sum<PointSums>(in_.size() - from,
                                    [&](size_t first, size_t last)
                                    {
                                        PointSums s;
                                        for (size_t i = from + first; i < from + last; i++)
                                            if (const Pair p = pairs(i); p.w > 0) s.add(p.w, p.a, p.b);
                                        return s;
                                    });
    }

    const PreparedPairings& in_;
    const PairingSums& sums_;
    PointVectors points_;
    Eigen::Matrix3d signs_;
    std::optional<OriginPose> guess_;
    PointOrigin origin_;
    PointSums profile_;
};

}  // namespace mp2p_icp
