#pragma once

#include <mp2p_icp/LogRecord.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace mp2p_icp
{
/// Why a run ended as it did.
enum class DiagnosisCause : uint8_t
{
    AllIsWell = 0,
    EmptyMap,           ///< a map has no point to match
    NonFinitePoints,    ///< most points of a map are NaN or infinite
    TooFewPoints,       ///< fewer than can tell a pose from chance
    TooFewIterations,   ///< it was on its way
    FreeMotion,         ///< the scene allows motions that change nothing, as along a corridor
    WrongScale,         ///< the maps are not in the same unit
    WrongFrame,         ///< a map is turned: upside down, or its axes are exchanged
    InvertedGuess,      ///< the inverse of the guess fits: maps or pose swapped
    BadGuess,           ///< the maps do fit, too far from the guess to be found
    ThresholdTooSmall,  ///< the maps fit near the guess, just farther than the matching distance
    ThresholdTooLarge,  ///< far pairs pull the pose away from where the maps fit
    NoOverlap,          ///< what the maps show lies apart, and fits nowhere
    DifferentPlaces,    ///< they lie on each other, and fit nowhere
    Unknown
};
/// Such as `bad guess`.
std::string to_string(DiagnosisCause cause);

/// What diagnose() found.
struct Diagnosis
{
    DiagnosisCause cause = DiagnosisCause::Unknown;
    /// At most ten lines for people: the verdict, the cause, the findings behind it; the last says what to
    /// try.
    std::vector<std::string> sentences;

    /// The share of the local points that lie on what the global ones show, where the run ended (0..1); each
    /// direction of surfaces counts by the square root of its points.
    double overlap = 0;
    /// Motions that change nothing: those of the result, else those that surfaces do not tell.
    std::vector<FreeTwist> free;
    /// A pose (stored coordinates) at which the maps fit much better, and the factor on the local coordinates
    /// that it needs, where one was found.
    std::optional<mrpt::poses::CPose3D> better_pose;
    double better_scale = 1.0;
    double better_overlap = 0;
};

/** Looks for the cause in the log: counts points, compares residuals with the spacing of the points, and, for
 * a run that is not to be trusted, tries other poses, scales and frames. How it decides, and why the limits
 * are what they are, stands in diagnosis.cpp. A second or so, whatever the size of the maps; the same
 * answer on any number of threads. \exception std::invalid_argument if the log lacks a map.
 */
Diagnosis diagnose(const LogRecord& log);

}  // namespace mp2p_icp
