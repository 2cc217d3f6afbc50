#pragma once

#include <mp2p_icp/observability.h>

#include <limits>

#include "prepared_pairings.h"

namespace mp2p_icp
{
struct AnalysisOptions
{
    std::optional<double> sigma;  ///< m; empty: from the residuals
    std::optional<double>
        coordinate_rounding;   ///< m; empty: `epsilon` times the largest coordinate / sqrt(12)
    double epsilon = 0x1p-23;  ///< of the coordinates' type
    /// Motions that rotate are free if their predicted deviation is above this, rad.
    double largest_deviation = std::numeric_limits<double>::infinity();
    const Pairings* feigned = nullptr;  ///< these and the following as in ObservabilityParameters
    double feigned_factor = 4;
    std::optional<mrpt::poses::CPose3DPDFGaussianInf> prior;
    double prior_deviation = std::numeric_limits<double>::infinity();
};

/// observability() of pairings as solvers use them.
Observability analyse(const PreparedPairings& in, const mrpt::poses::CPose3D& pose,
                      const AnalysisOptions& options);
/// observability() of sums.
Observability analyse(const PoseQuadratic& q, const mrpt::poses::CPose3D& pose,
                      const AnalysisOptions& options);

}  // namespace mp2p_icp
