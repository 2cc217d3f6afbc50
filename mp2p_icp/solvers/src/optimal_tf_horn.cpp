#include <mp2p_icp/optimal_tf_horn.h>

#include "weighted_closed_form.h"

namespace mp2p_icp
{
bool optimal_tf_horn(const Pairings& in, const WeightParameters& wp, OptimalTF_Result& result,
                     const std::optional<mrpt::poses::CPose3D>& guess)
{
    ClosedForm how;
    how.guess = guess, how.sigma = wp.sigma;
    return solve_weighted(in, wp, how, result);
}

}  // namespace mp2p_icp
