#pragma once

#include <mp2p_icp/Parameters.h>
#include <mp2p_icp/PipelineRecord.h>
#include <mp2p_icp/Results.h>
#include <mp2p_icp/metricmap.h>
#include <mrpt/math/TPose3D.h>
#include <mrpt/poses/CPose3DPDFGaussianInf.h>
#include <mrpt/serialization/CSerializable.h>

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace mp2p_icp
{
/// What a run was made with: the same inputs give the same bits where all but `threads` is the same.
struct RunEnvironment
{
    std::string library_version, mrpt_version, compiler;
    std::string processor;  ///< its model, as the system names it
    uint32_t threads = 1;   ///< that were at hand
};
RunEnvironment this_environment();

/// One iteration of a run, in few numbers.
struct IterationRecord
{
    uint32_t iteration = 0;
    mrpt::poses::CPose3D pose;              ///< that was found, in stored coordinates
    double step_trans = 0, step_rot = 0;    ///< from the pose before, m and rad
    double gate = 0;                        ///< largest matching distance, m; infinite: there is none
    std::array<uint64_t, 5> pairings = {};  ///< pt2pt, pt2ln, pt2pl, ln2ln, pl2pl
    uint64_t potential_pairings = 0;
    double cost = 0;          ///< sum of weighted squared residuals of the pairings at the pose found, m^2
    double residual_rms = 0;  ///< of their distances, m
    int rank = 0;             ///< how many of the 6 degrees of freedom they determine
};

/** The whole story of one ICP run, to be looked at, and run again (see replay.h), later.
 *
 * Poses and pairings of the iterations are in stored coordinates, as the maps are: without their
 * coordinate_offset(). The guess, the prior and the result are in original ones, as ICP::align() takes and
 * gives them.
 */
class LogRecord : public mrpt::serialization::CSerializable
{
    DEFINE_SERIALIZABLE(LogRecord, mp2p_icp)

 public:
    metric_map_t::ConstPtr pcGlobal, pcLocal;
    /// Did functor_before_logging_... change what the maps here hold?
    bool globalWasEdited = false, localWasEdited = false;

    mrpt::math::TPose3D initialGuessLocalWrtGlobal;
    std::optional<mrpt::poses::CPose3DPDFGaussianInf> prior;
    Parameters icpParameters;
    PipelineRecord pipeline;
    RunVariables dynamicVariables;  ///< that formulas of any part saw, besides ICP_ITERATION

    Results icpResult;
    std::vector<IterationRecord> iterations;  ///< all of them

    struct DebugInfoPerIteration
    {
        mrpt::poses::CPose3D optimalPose;  ///< found with the pairings, in stored coordinates
        Pairings pairings;                 ///< in stored coordinates
    };
    using iterations_details_t = std::map<size_t, DebugInfoPerIteration>;
    /// By iteration; see Parameters::saveIterationDetails.
    std::optional<iterations_details_t> iterationsDetails;

    /// Of `match`, `solve`, `quality` (judging the end), `log` (what keeping this log took meanwhile), and
    /// `total`, s.
    std::map<std::string, double> timings_s;
    RunEnvironment environment;

    /// As a gzip file. Returns false if it cannot be written.
    bool save_to_file(const std::string& file_name) const;

    /** \exception DataError for a file that is missing, damaged, no log, or a log of the original mp2p_icp
     * (which holds other things). Nothing that is in the file can harm this process: see archive_file.h.
     */
    static LogRecord load_from_file(const std::string& file_name);
};

/// What a list of logs tells of one.
struct LogHeadline
{
    Verdict verdict = Verdict::failed;
    double quality = 0;
};

/** From the first bytes of a log, in well below a millisecond, whatever its size; so the rest of it may be
 * damaged. \exception DataError as LogRecord::load_from_file() for what these bytes tell. Thread-safe.
 */
LogHeadline read_log_headline(const std::string& file_name);

}  // namespace mp2p_icp
