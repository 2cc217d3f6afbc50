#include <mp2p_icp/optimal_tf_olae.h>

#include "weighted_closed_form.h"

namespace mp2p_icp
{
bool optimal_tf_olae(const Pairings& in, const WeightParameters& wp, OptimalTF_Result& result,
                     const std::optional<mrpt::poses::CPose3D>& guess, const OlaeParameters& parameters)
{
    ClosedForm how;
    how.method = parameters.system == OlaeSystem::Report         ? AttitudeMethod::OlaeReport
                 : parameters.system == OlaeSystem::LeastSquares ? AttitudeMethod::OlaeLeastSquares
                                                                 : AttitudeMethod::OlaeNewton;
    if (parameters.normalize_points)
        how.points = parameters.system == OlaeSystem::LeastSquares ? PointVectors::UnitsWithSquares
                                                                   : PointVectors::Units;
    how.guess = guess, how.sigma = wp.sigma;
    return solve_weighted(in, wp, how, result);
}

}  // namespace mp2p_icp
