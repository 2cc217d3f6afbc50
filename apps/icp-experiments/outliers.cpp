#include "experiment.h"
#include "outlier_levels.h"
#include "pose_study_figures.h"

namespace mp2p_icp_apps::experiments
{
namespace
{
using mp2p_icp::OutlierRejection;

PoseStudy study_of(const ExperimentOptions& options)
{
    PoseStudy study = outlier_study(options, "outliers", "200 point pairings, σ = 1 mm, uniform outliers");
    study.number = 8;
    const auto w = Weighting::Report;
    study.methods = {with_scale_test(olae(w)),
                     with_scale_test(horn(w)),
                     gauss_newton(w),
                     horn(w),
                     olae(w),
                     with_scale_test(olae_newton(w)),
                     horn_with(OutlierRejection::NoiseScale),
                     horn_with(OutlierRejection::ConsistencyGraph),
                     horn_with(OutlierRejection::GncTruncated),
                     horn_with(OutlierRejection::GncGemanMcClure)};
    return study;
}

/// The mean over all runs of a level, as a share of all outliers or inliers.
Finding mean_share(const PoseStudyResult& r, const std::string& of, const std::string& what,
                   size_t PoseSample::*count, bool of_outliers)
{
    Finding finding{what + ", " + of, {}};
    const size_t m = r.method_index(of);
    for (size_t level = 0; level < r.study.levels.size(); level++)
    {
        double sum = 0;
        for (size_t k = 0; k < r.repetitions; k++) sum += static_cast<double>(r.at(level, k, m).*count);
        const double ratio = r.study.levels[level].outlier_ratio;
        const double all =
            static_cast<double>(r.study.points * r.repetitions) * (of_outliers ? ratio : 1 - ratio);
        finding.values.emplace_back(r.study.levels[level].label, sum / all);
    }
    return finding;
}
}  // namespace

/// The report's experiment on its scale test, eq. (3), and what finds all outliers.
Experiment outliers()
{
    Experiment e{"outliers", "Outliers among 200 point pairings, with and without the scale test", {}};
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
        for (const auto& q : quantities()) findings.push_back(median_ratio(r, "olae", "olae-scale-test", q));
        for (const auto& q : quantities())
            for (const std::string id :
                 {"horn-scale-test", "olae-scale-test", "olae-newton-scale-test", "horn-noise-scale",
                  "horn-consistency-graph", "horn-gnc-truncated", "horn-gnc-geman-mcclure"})
                findings.push_back(median_ratio(r, "horn", id, q));
        findings.push_back(mean_share(r, "horn-scale-test", "share of the outliers that are kept",
                                      &PoseSample::outliers_kept, true));
        findings.push_back(mean_share(r, "horn-scale-test", "share of the inliers that are lost",
                                      &PoseSample::inliers_lost, false));
        workshop.deliver(
            e, yaml, findings,
            {box_figure(r, "outliers", {"olae-scale-test", "horn-scale-test", "gauss-newton", "horn"}),
             median_figure(r, "outliers-rejection")});
    };
    return e;
}

}  // namespace mp2p_icp_apps::experiments
