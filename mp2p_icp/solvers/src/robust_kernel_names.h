#pragma once

#include <mp2p_icp/robust_kernels.h>

#include <string>
#include <utility>
#include <vector>

namespace mp2p_icp
{
/// The kernels as they are named in YAML.
inline std::vector<std::pair<RobustKernel, std::string>> robust_kernel_names()
{
    return {{RobustKernel::None, "None"},     {RobustKernel::GemanMcClure, "GemanMcClure"},
            {RobustKernel::Cauchy, "Cauchy"}, {RobustKernel::Huber, "Huber"},
            {RobustKernel::Tukey, "Tukey"},   {RobustKernel::Truncated, "Truncated"}};
}
}  // namespace mp2p_icp
