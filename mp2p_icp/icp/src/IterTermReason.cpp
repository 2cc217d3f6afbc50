#include <mp2p_icp/IterTermReason.h>

namespace mp2p_icp
{
std::string to_string(IterTermReason reason)
{
    switch (reason)
    {
        case IterTermReason::NoPairings:
            return "NoPairings";
        case IterTermReason::SolverError:
            return "SolverError";
        case IterTermReason::MaxIterations:
            return "MaxIterations";
        case IterTermReason::Stalled:
            return "Stalled";
        case IterTermReason::QualityCheckpointFailed:
            return "QualityCheckpointFailed";
        case IterTermReason::HookRequest:
            return "HookRequest";
        case IterTermReason::Cycled:
            return "Cycled";
        case IterTermReason::Undefined:
            return "Undefined";
    }
    return "";
}

std::string to_string(Verdict verdict)
{
    switch (verdict)
    {
        case Verdict::aligned:
            return "aligned";
        case Verdict::no_overlap:
            return "no_overlap";
        case Verdict::under_constrained:
            return "under_constrained";
        case Verdict::diverged:
            return "diverged";
        case Verdict::worse_than_guess:
            return "worse_than_guess";
        case Verdict::failed:
            return "failed";
    }
    return "";
}

}  // namespace mp2p_icp
