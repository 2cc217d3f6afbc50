#include "experiment.h"
#include "noise_levels.h"
#include "pose_study_figures.h"

namespace mp2p_icp_apps::experiments
{
namespace
{
PoseStudy base_study(const ExperimentOptions& options, const std::string& id, const std::string& about)
{
    PoseStudy study;
    study.id = id, study.about = about, study.points = 1;
    set_mixed_levels(options, study);
    return study;
}

/// As the report has it.
PoseStudy directions(const ExperimentOptions& options)
{
    PoseStudy study = base_study(options, "planes", "1 point and 100 plane pairings, directions only");
    study.number = 2, study.planes = 100;
    const auto w = Weighting::Report;
    study.methods = {olae(w), horn(w), gauss_newton(w), olae_least_squares(w), olae_newton(w), certified(w)};
    return study;
}

std::vector<PoseMethod> with_all_rows()
{
    const auto w = Weighting::Likely;
    return {olae(w), horn(w), gauss_newton(w), certified(w), gauss_newton_unit()};
}

PoseStudy with_offsets(const ExperimentOptions& options)
{
    PoseStudy study = base_study(options, "planes-offsets", "1 point and 100 plane pairings with offsets");
    study.number = 3, study.planes = 100, study.offsets = true, study.methods = with_all_rows();
    return study;
}

PoseStudy lines(const ExperimentOptions& options)
{
    PoseStudy study = base_study(options, "lines", "1 point and 100 line pairings");
    study.number = 4, study.lines = 100, study.offsets = true, study.methods = with_all_rows();
    return study;
}
}  // namespace

/// The report's figure 2; with what the positions of planes say on top; and the same with lines.
Experiment noise_planes()
{
    Experiment e{"noise-planes", "Noise on 1 point and 100 plane pairings, or 100 line pairings", {}};
    e.run = [e](const ExperimentOptions& options, Workshop& workshop)
    {
        const size_t repetitions = options.repetitions.value_or(1000);
        std::vector<PoseStudyResult> results;
        for (const auto& study : {directions(options), with_offsets(options), lines(options)})
            results.push_back(run_study(study, repetitions, options.seed, workshop.repetitions()));
        write_study_csv(results, workshop.path(e.name + ".csv"));
        YamlWriter yaml = workshop.summary(e, repetitions, study_columns(results[0].study));
        write_study_summary(results, yaml);

        const auto &rotation = quantities()[0], &translation = quantities()[1];
        workshop.deliver(
            e, yaml,
            {rmse_ratio(results[0], "olae", "horn", rotation),
             rmse_ratio(results[0], "olae", "horn", translation), bound_ratio(results[0], "horn", rotation),
             largest(results[0], "gauss-newton", "largest angle between Gauss-Newton's pose and Horn's, rad",
                     &PoseSample::rotation_from_horn),
             bound_ratio(results[1], "horn-ml", translation),
             bound_ratio(results[1], "gauss-newton-ml", rotation),
             bound_ratio(results[1], "gauss-newton-ml", translation),
             bound_ratio(results[1], "gauss-newton-unit", translation),
             bound_ratio(results[2], "horn-ml", translation),
             bound_ratio(results[2], "gauss-newton-ml", rotation),
             bound_ratio(results[2], "gauss-newton-ml", translation)},
            {report_noise_figure(results[0], "noise-planes", {"olae", "horn", "gauss-newton"}),
             bound_figure(results[0], "noise-planes-bound"), bound_figure(results[1], "noise-planes-offsets"),
             bound_figure(results[2], "noise-planes-lines")});
    };
    return e;
}

}  // namespace mp2p_icp_apps::experiments
