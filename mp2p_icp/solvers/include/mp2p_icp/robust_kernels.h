#pragma once

#include <cstdint>

namespace mp2p_icp
{
/// Functions that let large residuals weigh less. Their scale c is in the units of the residual.
enum class RobustKernel : uint8_t
{
    None,
    GemanMcClure,  ///< weight (c^2 / (e^2 + c^2))^2
    Cauchy         ///< weight c^2 / (e^2 + c^2)
};

/// The factor (0..1] on the weight of a squared residual e^2 for iteratively reweighted least squares;
/// `scale` > 0.
inline double robust_weight(RobustKernel kernel, double residual_sq, double scale)
{
    const double ratio = scale * scale / (residual_sq + scale * scale);
    switch (kernel)
    {
        case RobustKernel::GemanMcClure:
            return ratio * ratio;
        case RobustKernel::Cauchy:
            return ratio;
        default:
            return 1.0;
    }
}

}  // namespace mp2p_icp
