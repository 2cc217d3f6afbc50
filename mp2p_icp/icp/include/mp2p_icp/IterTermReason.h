#pragma once

#include <cstdint>
#include <string>

namespace mp2p_icp
{
/// Why the iterations of an ICP run ended.
enum class IterTermReason : uint8_t
{
    Undefined = 0,
    NoPairings,   ///< nothing to pair, or too little overlap
    SolverError,  ///< no solver took the pairings
    MaxIterations,
    Stalled,                  ///< the steps became smaller than asked for: the normal end
    QualityCheckpointFailed,  ///< the quality was too low at a checkpoint
    HookRequest,              ///< the iteration hook asked for it
    Cycled  ///< it came back to where it had been some iterations before, which it would do for ever. Of the
            ///< poses on that round, the one that fits best was taken
};

/// How far the result of an ICP run can be trusted.
enum class Verdict : uint8_t
{
    aligned = 0,        ///< trust it
    no_overlap,         ///< nothing, or too little, to pair. The guess is returned
    under_constrained,  ///< a pose was found, but the pairings leave motions free (Results::unobservable)
    diverged,           ///< not finite, or moved too far. The guess is returned
    worse_than_guess,   ///< fits worse than the guess. The guess is returned
    failed              ///< ended before it converged, see the termination reason. The guess is returned
};

/// The name; empty for a number that is none of them.
std::string to_string(IterTermReason reason);
std::string to_string(Verdict verdict);

}  // namespace mp2p_icp
