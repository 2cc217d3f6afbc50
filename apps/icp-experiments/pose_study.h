#pragma once

#include <mp2p_icp/synthetic/report_worlds.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "pose_method.h"
#include "workshop.h"

namespace mp2p_icp_apps::experiments
{
/// A place on the horizontal axis of a figure: worlds of one kind.
struct StudyLevel
{
    std::vector<double> coordinates;  ///< one per column of PoseStudy
    std::string label;                ///< below the axis; may have two lines
    mp2p_icp::synthetic::ReportNoise noise;
    double outlier_ratio = 0;

    bool exact() const { return noise.points == 0 && noise.normals == 0; }
};

/// How the worlds of a study look, and who is asked for their pose.
struct PoseStudy
{
    std::string id, about;
    uint64_t number = 0;  ///< of its random streams: not shared by two studies
    size_t points = 0, planes = 0, lines = 0;
    bool offsets = false;         ///< do the positions of planes and lines count, beside their directions?
    std::vector<Column> columns;  ///< of the levels' coordinates
    std::string x_label;
    std::vector<StudyLevel> levels;
    std::vector<PoseMethod> methods;  ///< one of them is `horn` or `horn-ml`
    bool with_outliers = false;
};

/// One method on one world.
struct PoseSample
{
    bool solved = false;
    double rotation = 0, translation = 0;                      ///< errors, rad, m
    double rotation_bound = 0, translation_bound = 0;          ///< Cramer-Rao, of this world's right pairings
    double rotation_from_horn = 0, translation_from_horn = 0;  ///< from Horn's pose of the same world
    size_t outliers_kept = 0, inliers_lost = 0;
};

/// Rotation or translation.
struct Quantity
{
    std::string id, name, unit;  ///< such as `rotation`, `SO(3) error`, `rad`
    double PoseSample::*error;
    double PoseSample::*bound;
};
const std::vector<Quantity>& quantities();

class PoseStudyResult
{
 public:
    PoseStudyResult(const PoseStudy& of, size_t count)
        : study(of), repetitions(count), samples_(of.levels.size() * count * of.methods.size())
    {
    }
    const PoseStudy study;
    const size_t repetitions;

    PoseSample& at(size_t level, size_t repetition, size_t method)
    {
        return samples_[(level * repetitions + repetition) * study.methods.size() + method];
    }
    const PoseSample& at(size_t level, size_t repetition, size_t method) const
    {
        return const_cast<PoseStudyResult*>(this)->at(level, repetition, method);
    }

    /// \exception std::logic_error if the study does not have it
    size_t method_index(const std::string& id) const;
    std::vector<double> values(size_t level, size_t method, double PoseSample::*member) const;
    Statistics statistics(size_t level, size_t method, const Quantity& q) const
    {
        return statistics_of(values(level, method, q.error));
    }
    /// The root mean square of the bounds of all worlds of a level.
    double bound(size_t level, const Quantity& q) const
    {
        return root_mean_square(values(level, 0, q.bound));
    }

 private:
    std::vector<PoseSample> samples_;
};

/// Every method on `repetitions` worlds per level.
PoseStudyResult run_study(const PoseStudy& study, size_t repetitions, uint64_t seed,
                          const Repetitions& workers);

// ---- Files ------------------------------------------------------------------------------------------------
std::vector<Column> study_columns(const PoseStudy& study);
/// All runs of studies that have the same columns.
void write_study_csv(const std::vector<PoseStudyResult>& results, const std::string& path);
/// Per study, level and method: medians, quartiles, RMSE, the bound, and the ratio of both.
void write_study_summary(const std::vector<PoseStudyResult>& results, YamlWriter& yaml);

}  // namespace mp2p_icp_apps::experiments
