#pragma once

#include <mp2p_icp/optimal_tf_certified.h>

#include <ostream>

namespace mp2p_icp
{
/** Runs optimal_tf_certified() and writes what proves its answer, as YAML (docs/formats.md): pose, cost, gap,
 * G, minima, and all pairings that count with the weights of the problem that was certified. `icp-certify`
 * checks it without any code of the solvers. \exception std::invalid_argument as optimal_tf_certified(), and
 * if there is nothing to solve with.
 */
CertifiedResult write_certificate(std::ostream& out, const Pairings& pairings,
                                  const CertifiedParameters& parameters = {});

}  // namespace mp2p_icp
