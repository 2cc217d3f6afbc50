#pragma once

#include <mp2p_icp/optimal_tf_certified.h>

#include <optional>

#include "prepared_pairings.h"

namespace mp2p_icp
{
/// optimal_tf_certified(), which also tells the pairings with the weights of the problem that was certified.
bool solve_certified(const Pairings& pairings, CertifiedResult& result, const CertifiedParameters& p,
                     std::optional<PreparedPairings>& certified);

}  // namespace mp2p_icp
