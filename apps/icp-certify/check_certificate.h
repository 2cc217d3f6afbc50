#pragma once

#include <array>
#include <string>
#include <vector>

#include "certificate_file.h"

namespace mp2p_icp_certify
{
/// A number of the file, and the one that was found here.
struct TwoNumbers
{
    Real found = 0, in_file = 0;
};

/// What was found out about a certificate.
struct Findings
{
    std::array<size_t, NUMBER_OF_KINDS> pairings{};  ///< how many of each kind
    bool has_prior = false;
    std::string verdict;  ///< of the file
    Real tolerance = 0;   ///< of the file

    bool compared = false;  ///< the numbers below were found: the rotations are rotations
    TwoNumbers cost;        ///< m^2, at the given rotation
    TwoNumbers scale;       ///< m^2
    TwoNumbers gap;         ///< m^2. found: proven, with all roundings of the file
    TwoNumbers margin;      ///< least eigenvalue of G

    Real rounding = 0;            ///< m^2: how far a single sum of the file may be off
    Real largest_mismatch = 0;    ///< m^2: of a coefficient of G's polynomial
    Real gradient = 0;            ///< m^2/rad, length
    Real translation_excess = 0;  ///< m^2: what the given translation costs more than the best one
    Real weakest_motion = 0;      ///< information along the worst determined motion, relative to the best one
    size_t minima = 0;            ///< listed ones
    size_t equal_minima = 0;  ///< of these, other ones than the pose that cost no more, within the tolerance

    std::vector<std::string> failures;  ///< one sentence each, with both numbers
    bool holds() const { return failures.empty(); }
};

/// Rebuilds everything from the pairings. \exception std::invalid_argument if the prior is no prior
Findings check_certificate(const Certificate& certificate);

/// Both as text, with as many digits as are needed to tell them apart.
std::array<std::string, 2> texts_of(Real a, Real b);
/// Six digits.
std::string text_of(Real value);

}  // namespace mp2p_icp_certify
