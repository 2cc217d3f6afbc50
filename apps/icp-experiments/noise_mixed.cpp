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
    study.id = id, study.about = about, study.points = 100, study.planes = 100;
    set_mixed_levels(options, study);
    return study;
}

/// As the report has it, and with weights that follow the noise.
PoseStudy directions(const ExperimentOptions& options)
{
    PoseStudy study =
        base_study(options, "points-planes", "100 point and 100 plane pairings, directions only");
    study.number = 5;
    const auto report = Weighting::Report, likely = Weighting::Likely;
    study.methods = {olae(report), horn(report), gauss_newton(report),
                     olae(likely), horn(likely), gauss_newton(likely)};
    return study;
}

std::vector<PoseMethod> with_all_rows()
{
    const auto w = Weighting::Likely;
    return {olae(w), horn(w), gauss_newton(w), certified(w), gauss_newton_unit()};
}

PoseStudy with_offsets(const ExperimentOptions& options)
{
    PoseStudy study =
        base_study(options, "points-planes-offsets", "100 point and 100 plane pairings with offsets");
    study.number = 6, study.offsets = true, study.methods = with_all_rows();
    return study;
}

PoseStudy with_lines(const ExperimentOptions& options)
{
    PoseStudy study =
        base_study(options, "points-planes-lines", "100 point, 100 plane and 100 line pairings");
    study.number = 7, study.lines = 100, study.offsets = true, study.methods = with_all_rows();
    return study;
}
}  // namespace

/// The report's figure 3; with what the positions of planes say on top; and with lines.
Experiment noise_mixed()
{
    Experiment e{"noise-mixed", "Noise on 100 point and 100 plane pairings, and 100 line pairings", {}};
    e.run = [e](const ExperimentOptions& options, Workshop& workshop)
    {
        const size_t repetitions = options.repetitions.value_or(1000);
        std::vector<PoseStudyResult> results;
        for (const auto& study : {directions(options), with_offsets(options), with_lines(options)})
            results.push_back(run_study(study, repetitions, options.seed, workshop.repetitions()));
        write_study_csv(results, workshop.path(e.name + ".csv"));
        YamlWriter yaml = workshop.summary(e, repetitions, study_columns(results[0].study));
        write_study_summary(results, yaml);

        const auto &rotation = quantities()[0], &translation = quantities()[1];
        std::vector<Finding> findings = {rmse_ratio(results[0], "olae", "horn", rotation),
                                         rmse_ratio(results[0], "olae", "horn", translation)};
        for (const std::string id : {"olae", "horn", "gauss-newton", "olae-ml", "horn-ml", "gauss-newton-ml"})
            findings.push_back(bound_ratio(results[0], id, rotation));
        for (const size_t k : {1u, 2u})
            for (const std::string id : {"horn-ml", "gauss-newton-ml", "gauss-newton-unit"})
                for (const auto& q : {rotation, translation})
                    findings.push_back(bound_ratio(results[k], id, q));
        workshop.deliver(
            e, yaml, findings,
            {report_noise_figure(results[0], "noise-mixed", {"olae", "horn", "gauss-newton"}),
             bound_figure(results[0], "noise-mixed-weights"), bound_figure(results[1], "noise-mixed-offsets"),
             bound_figure(results[2], "noise-mixed-lines")});
    };
    return e;
}

}  // namespace mp2p_icp_apps::experiments
