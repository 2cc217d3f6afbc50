#pragma once

#include <mp2p_icp/LogRecord.h>
#include <mp2p_icp/nn_index.h>

#include <string>
#include <vector>

namespace mp2p_icp
{
/// The cloud layers that a pipeline matches first.
struct MatchedLayers
{
    mrpt::maps::CPointsMap::ConstPtr global, local;  ///< null: there is none
    layer_name_t global_name, local_name;
};
MatchedLayers matched_layers(const LogRecord& log);

/// A pose and scale of the local map, and how well it fits there.
struct Fit
{
    mrpt::poses::CPose3D pose;  ///< stored coordinates
    double scale = 1;           ///< factor on the local coordinates
    double share = 0;           ///< of the local points that fit, 0..1
};

/** Two clouds, to be laid on each other in many ways. Works on a random subset of the local points, so its
 * time does not depend on the size of the maps.
 *
 * A local point fits where its nearest global point stands on a plane or line, and the local point is on it:
 * within three standard deviations of the points of that neighbourhood, and a quarter of the spacing, which
 * pairings of points leave open. Where there is neither plane nor line, within two spacings: of points spread
 * at random over a surface, the nearest neighbour is farther than 2 times the median of these distances once
 * in 2^4 times (than 3 times, once in 2^9: farther is not nearby).
 *
 * Each direction of surfaces counts by the square root of its points, so that a large floor, which fits
 * wherever there is a floor, does not outvote all else.
 */
class MapFit
{
 public:
    /// Both clouds must have a finite point.
    MapFit(const mrpt::maps::CPointsMap& global, const mrpt::maps::CPointsMap& local);

    double spacing() const { return spacing_; }              ///< median distance of neighbours, global, m
    double local_spacing() const { return local_spacing_; }  ///< the same of the local cloud, m
    double radius() const { return radius_; }                ///< rms distance of local points from their mean
    double global_radius() const { return global_radius_; }
    double nearby() const { return 3 * spacing_; }
    /// From the mean of the local to that of the global points.
    mrpt::poses::CPose3D means_together(const mrpt::poses::CPose3D& turned_as) const;

    /// Of the local points that fit.
    double share(const mrpt::poses::CPose3D& pose, double scale = 1) const;
    /** Do those local points fit near which the global map has anything: at least three quarters of them,
     * they being a third of all, and leaving no motion free? Of streets of which only a part is the same, at
     * the right pose: 23 of 24 that share 60 %, 17 of 24 that share half. Of 120 pairs of different streets,
     * and of parts that lie apart, from 24 starts each: none (0.7 instead of three quarters: one).
     */
    bool fits_where_maps_overlap(const mrpt::poses::CPose3D& pose) const;
    /// ICP from a start, on points with a matching distance that shrinks from `gate` to nearby(), then on
    /// planes.
    Fit fit_from(const mrpt::poses::CPose3D& start, double gate, double scale = 1) const;
    /// The scale that fits the pairs within nearby() best, at the pose and scale of a fit (Umeyama, 1991).
    double better_scale(const Fit& fit) const;
    /// The motions that the surfaces on which the local points lie leave free, judged as for a verdict. Empty
    /// also if few of them lie on anything.
    std::vector<FreeTwist> free_motions(const mrpt::poses::CPose3D& pose) const;
    /// The rms distance that the local points move between two poses, m.
    double displacement(const mrpt::poses::CPose3D& a, const mrpt::poses::CPose3D& b) const;

 private:
    struct Nearest;
    Nearest nearest_of(const mrpt::poses::CPose3D& pose, double scale, double within) const;
    bool fits(const Nearest& nearest, size_t i) const;
    Pairings pairs_of(const Nearest& nearest) const;
    std::vector<FreeTwist> left_free(const Pairings& pairings, const mrpt::poses::CPose3D& pose) const;

    metric_map_t global_;
    std::vector<mrpt::math::TPoint3Df> local_;  ///< finite ones, a subset
    std::vector<double> weights_;               ///< of the local points; their sum is 1
    mrpt::maps::CPointsMap::ConstPtr global_points_;
    NearestNeighborIndex::ConstPtr index_;
    LocalSurfaces::ConstPtr surfaces_;  ///< of the global points
    mrpt::math::TPoint3D local_mean_, global_mean_;
    double spacing_ = 0, local_spacing_ = 0, radius_ = 0, global_radius_ = 0;
};

}  // namespace mp2p_icp
