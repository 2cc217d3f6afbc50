#include <mp2p_icp/OptimalTF_Result.h>

namespace mp2p_icp
{
std::string to_string(SolveStatus status)
{
    switch (status)
    {
        case SolveStatus::Determined:
            return "determined";
        case SolveStatus::UnderConstrained:
            return "under-constrained";
        default:
            return "no pairings";
    }
}

}  // namespace mp2p_icp
