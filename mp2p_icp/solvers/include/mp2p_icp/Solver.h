#pragma once

#include <mp2p_icp/OptimalTF_Result.h>
#include <mp2p_icp/Pairings.h>
#include <mp2p_icp/Parameterizable.h>
#include <mrpt/poses/CPose3DPDFGaussianInf.h>
#include <mrpt/rtti/CObject.h>
#include <mrpt/system/COutputLogger.h>

#include <optional>
#include <set>
#include <vector>

namespace mp2p_icp
{
class Solver;

/// What an ICP run tells its solvers.
struct SolverContext
{
    std::optional<mrpt::poses::CPose3D> guessRelativePose;  ///< the current estimate, of local wrt global
    std::optional<mrpt::poses::CPose3DPDFGaussianInf>
        prior;  ///< on the same pose; its information in 1/m^2, 1/rad^2
    std::optional<uint32_t> icpIteration;
    std::optional<mrpt::poses::CPose3D> currentCorrectionFromInitialGuess;
    std::optional<mrpt::poses::CPose3D> lastIcpStepIncrement;
    RunVariables variables;  ///< for formulas
    std::set<const Solver*>
        switched_off;  ///< by runUntilTranslationCorrectionSmallerThan; belongs to the run
};

/** Finds the pose that fits pairings best. Configured once, const while running; one object may serve several
 * threads. */
class Solver : public mrpt::rtti::CObject, public mrpt::system::COutputLogger, public Parameterizable
{
    DEFINE_VIRTUAL_MRPT_OBJECT(Solver)

 public:
    Solver() : mrpt::system::COutputLogger("Solver") {}

    uint32_t runFromIteration = 0;
    uint32_t runUpToIteration = 0;  ///< inclusive; 0: no limit
    /// m; once the last step of ICP was smaller, this solver hands over to the next one of the list. 0:
    /// never.
    double runUntilTranslationCorrectionSmallerThan = 0;
    bool enabled = true;

    /// \exception ConfigError
    void initialize(const yaml& params, const YamlPlace& place = {}) { load_parameters(params, place); }
    void declare_parameters(ParameterDeclaration& declare) override;

    /// Is it this solver's turn? Notes in the context when it has handed over.
    bool is_active(SolverContext& context) const;

    /// \return false if the pairings do not allow a solution, or if it is not this solver's turn.
    bool optimal_pose(const Pairings& pairings, OptimalTF_Result& out, SolverContext& context) const;

 protected:
    virtual bool impl_optimal_pose(const Pairings& pairings, OptimalTF_Result& out,
                                   const SolverContext& context) const = 0;
};

using solver_list_t = std::vector<Solver::Ptr>;

/// The first solver of the list that is active and succeeds gives the result. \return false if none does.
bool run_solvers(const solver_list_t& solvers, const Pairings& pairings, OptimalTF_Result& out,
                 SolverContext& context);

}  // namespace mp2p_icp
