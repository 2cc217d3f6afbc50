#pragma once

#include <mp2p_icp/Pairings.h>
#include <mp2p_icp/WeightParameters.h>

#include <string>

namespace mp2p_icp_apps
{
struct PairingsFile
{
    mp2p_icp::Pairings pairings;
    mp2p_icp::PairWeights weights;
};

/** Pairings from lines of text, or from the block `pairings` of a YAML file (docs/formats.md).
 * \exception mp2p_icp::DataError for what cannot be read, and where directions of one kind differ in their
 * sign rule, or in the ratio of their weight to that of the position: solvers have one of each per kind.
 */
PairingsFile load_pairings(const std::string& file_name);

}  // namespace mp2p_icp_apps
