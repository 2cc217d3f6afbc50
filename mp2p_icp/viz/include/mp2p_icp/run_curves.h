#pragma once

#include <mp2p_icp/LogRecord.h>
#include <mp2p_icp/pose_step.h>

#include <array>
#include <vector>

namespace mp2p_icp
{
/// One of something for each kind of pairing, in this order.
constexpr size_t PAIRING_KIND_COUNT = 5;
constexpr std::array<const char*, PAIRING_KIND_COUNT> PAIRING_KIND_NAMES = {"pt2pt", "pt2ln", "pt2pl",
                                                                            "ln2ln", "pl2pl"};
template <class T>
using PerPairingKind = std::array<T, PAIRING_KIND_COUNT>;

PerPairingKind<size_t> pairing_counts(const Pairings& pairings);

/** The distance of each pairing at a pose of local with respect to global, m: between points; of a point from
 * a line or plane; of a local line's base point from the global line; of a local plane's centroid from the
 * global plane. In the order of the lists; NaN or infinite where the input is.
 */
PerPairingKind<std::vector<double>> residual_distances(const Pairings& pairings,
                                                       const mrpt::poses::CPose3D& localWrtGlobal);

/// What one iteration did. Numbers are not finite where those of the log are not.
struct RunCurvePoint
{
    size_t iteration = 0;
    PoseStep step;      ///< since the iteration before it; of the first one since the guess
    PoseStep to_final;  ///< to the pose at which the iterations ended, also if the verdict rejects it
    PerPairingKind<size_t> pairings = {};
    double rms_residual = 0;  ///< IterationRecord::residual_rms, m
    double cost = 0;          ///< IterationRecord::cost, m^2
};

/// One point for each iteration, in order.
using RunCurves = std::vector<RunCurvePoint>;

/// The course of a run, also of iterations without details. Thread-safe; O(number of iterations).
RunCurves run_curves(const LogRecord& log);

/// Which distances are how frequent.
struct ResidualHistogram
{
    /** End of the last bin, m; bins are equally wide and begin at 0. It is twice the distance within which
     * 90 % of all pairings lie, or the largest distance if that is less: a few far ones do not squeeze the
     * rest. 0 if no distance is above 0; then all are in the first bin.
     */
    double upper = 0;

    struct Counts
    {
        std::vector<size_t> bins;
        size_t beyond = 0;      ///< farther than `upper`
        size_t not_finite = 0;  ///< the sum of all three is the number of pairings
    };
    PerPairingKind<Counts> kinds;
};

/** Of residual_distances(). Without pairings, all counts are 0.
 * \exception std::invalid_argument if there are no bins. Thread-safe; O(number of pairings).
 */
ResidualHistogram residual_histogram(const Pairings& pairings, const mrpt::poses::CPose3D& localWrtGlobal,
                                     size_t bins = 40);

}  // namespace mp2p_icp
