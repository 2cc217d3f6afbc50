#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace mp2p_icp
{
/// Functions that let large residuals e weigh less. Their scale c is in the units of the residual.
enum class RobustKernel : uint8_t
{
    None,
    GemanMcClure,  ///< weight (c^2 / (e^2 + c^2))^2
    Cauchy,        ///< weight c^2 / (e^2 + c^2)
    Huber,         ///< weight 1 up to c, c / e beyond
    Tukey,         ///< weight (1 - e^2 / c^2)^2 up to c, 0 beyond
    Truncated      ///< weight 1 up to c, 0 beyond
};

/** The factor [0..1] on the weight of a squared residual e^2 for iteratively reweighted least squares: the
 * derivative of robust_loss() by e^2. `scale` > 0.
 */
inline double robust_weight(RobustKernel kernel, double residual_sq, double scale)
{
    const double scale_sq = scale * scale, ratio = scale_sq / (residual_sq + scale_sq);
    switch (kernel)
    {
        case RobustKernel::GemanMcClure:
            return ratio * ratio;
        case RobustKernel::Cauchy:
            return ratio;
        case RobustKernel::Huber:
            return residual_sq <= scale_sq ? 1.0 : scale / std::sqrt(residual_sq);
        case RobustKernel::Tukey:
            return residual_sq <= scale_sq ? std::pow(1 - residual_sq / scale_sq, 2) : 0.0;
        case RobustKernel::Truncated:
            return residual_sq <= scale_sq ? 1.0 : 0.0;
        default:
            return 1.0;
    }
}

/// What a squared residual e^2 costs: e^2 itself when small (without kernel: always), in units of e^2.
/// `scale` > 0.
inline double robust_loss(RobustKernel kernel, double residual_sq, double scale)
{
    const double scale_sq = scale * scale;
    switch (kernel)
    {
        case RobustKernel::GemanMcClure:
            return scale_sq * (residual_sq / (residual_sq + scale_sq));
        case RobustKernel::Cauchy:
            return scale_sq * std::log1p(residual_sq / scale_sq);
        case RobustKernel::Huber:
            return residual_sq <= scale_sq ? residual_sq : 2 * scale * std::sqrt(residual_sq) - scale_sq;
        case RobustKernel::Tukey:
            return scale_sq / 3 * (1 - std::pow(std::max(0.0, 1 - residual_sq / scale_sq), 3));
        case RobustKernel::Truncated:
            return std::min(residual_sq, scale_sq);
        default:
            return residual_sq;
    }
}

}  // namespace mp2p_icp
