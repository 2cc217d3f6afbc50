#include "experiment.h"
#include "outlier_levels.h"
#include "pose_study_figures.h"

namespace mp2p_icp_apps::experiments
{
namespace
{
PoseStudy study_of(const ExperimentOptions& options)
{
    PoseStudy study = outlier_study(
        options, "robust-loss", "200 point pairings, σ = 1 mm, uniform outliers, estimate 0.5 m and 2° off");
    study.number = 9;
    const auto w = Weighting::Report;
    study.methods = {with_loss(olae(w)), horn(w), with_loss(horn(w)), with_loss(olae(w), 5),
                     horn_with(mp2p_icp::OutlierRejection::GncTruncated)};
    return study;
}
}  // namespace

/// The report's experiment on the robust loss at a given estimate, and what needs no estimate.
Experiment robust_loss()
{
    Experiment e{"robust-loss", "Outliers among 200 point pairings, with and without a robust loss", {}};
    e.run = [e](const ExperimentOptions& options, Workshop& workshop)
    {
        const size_t repetitions = options.repetitions.value_or(1000);
        const std::vector results = {
            run_study(study_of(options), repetitions, options.seed, workshop.repetitions())};
        const auto& r = results[0];
        write_study_csv(results, workshop.path(e.name + ".csv"));
        YamlWriter yaml = workshop.summary(e, repetitions, study_columns(r.study));
        write_study_summary(results, yaml);

        std::vector<Finding> findings;
        for (const auto& q : quantities())
            for (const std::string id :
                 {"olae-loss", "horn-loss", "olae-loss-iterated", "horn-gnc-truncated"})
                findings.push_back(median_ratio(r, "horn", id, q));
        for (const std::string id : {"olae-loss", "olae-loss-iterated"})
            findings.push_back(bound_ratio(r, id, quantities()[0]));
        workshop.deliver(
            e, yaml, findings,
            {box_figure(r, "robust-loss", {"olae-loss", "horn"}), median_figure(r, "robust-loss-more")});
    };
    return e;
}

}  // namespace mp2p_icp_apps::experiments
