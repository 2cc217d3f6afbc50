#include "experiment.h"
#include "noise_levels.h"
#include "pose_study_figures.h"

namespace mp2p_icp_apps::experiments
{
namespace
{
PoseStudy study_of(const ExperimentOptions& options)
{
    PoseStudy study;
    study.id = "points", study.about = "100 point pairings";
    study.number = 1, study.points = 100;
    set_point_levels(options, study);
    const auto w = Weighting::Report;  // all points weigh the same anyway
    study.methods = {olae(w), horn(w), gauss_newton(w), olae_least_squares(w), olae_newton(w), certified(w)};
    return study;
}
}  // namespace

/// The report's figure 1.
Experiment noise_points()
{
    Experiment e{"noise-points", "Noise on 100 point pairings: OLAE, Horn and Gauss-Newton", {}};
    e.run = [e](const ExperimentOptions& options, Workshop& workshop)
    {
        const size_t repetitions = options.repetitions.value_or(1000);
        const std::vector results = {
            run_study(study_of(options), repetitions, options.seed, workshop.repetitions())};
        const auto& r = results[0];
        write_study_csv(results, workshop.path(e.name + ".csv"));
        YamlWriter yaml = workshop.summary(e, repetitions, study_columns(r.study));
        write_study_summary(results, yaml);

        const auto &rotation = quantities()[0], &translation = quantities()[1];
        workshop.deliver(
            e, yaml,
            {rmse_ratio(r, "olae", "horn", rotation), rmse_ratio(r, "olae", "horn", translation),
             bound_ratio(r, "horn", rotation), bound_ratio(r, "olae", rotation),
             largest(r, "gauss-newton", "largest angle between Gauss-Newton's pose and Horn's, rad",
                     &PoseSample::rotation_from_horn),
             largest(r, "gauss-newton", "largest distance between Gauss-Newton's pose and Horn's, m",
                     &PoseSample::translation_from_horn)},
            {report_noise_figure(r, "noise-points", {"olae", "horn", "gauss-newton"}),
             bound_figure(r, "noise-points-bound")});
    };
    return e;
}

}  // namespace mp2p_icp_apps::experiments
