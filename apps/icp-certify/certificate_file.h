#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pairing_lines.h"
#include "wide_numbers.h"

namespace mp2p_icp_certify
{
/// A guess of the pose with its information matrix: of (dt, omega) with t = t0 + dt, R = exp([omega]x) R0.
struct Prior
{
    Pose mean;
    Mat6 information = Mat6::Zero();
};

struct ListedMinimum
{
    Pose pose;
    Real cost = 0;
};

/// What a certificate file says, with nothing added or checked but its form.
struct Certificate
{
    std::string verdict;  ///< global, global_ambiguous, unobservable or gap
    Real tolerance = 0, cost = 0, scale = 0, gap = 0, margin = 0;
    Pose pose;
    Mat9 G = Mat9::Zero();
    std::vector<ListedMinimum> minima;
    std::optional<Prior> prior;
    std::vector<Pairing> pairings;
};

/** Reads a certificate.
 * \param pairings_file if not empty: take the pairings from there
 * \exception std::exception (mp2p_icp::DataError, mp2p_icp::ConfigError) names the file, the line, what was
 * expected and what was found.
 */
Certificate read_certificate(const std::string& file_name, const std::string& pairings_file = "");

/// Only pairings: one a line, or the block `pairings` of a YAML file. \exception as read_certificate()
std::vector<Pairing> read_pairings(const std::string& file_name);

}  // namespace mp2p_icp_certify
