#include "outlier_levels.h"

#include "number_text.h"

namespace mp2p_icp_apps::experiments
{
PoseStudy outlier_study(const ExperimentOptions& options, const std::string& id, const std::string& about)
{
    PoseStudy study;
    study.id = id, study.about = about;
    study.points = 200, study.with_outliers = true;
    study.columns = {{"outlier_ratio", "share of the global points that are uniform in the cube instead"}};
    study.x_label = "outlier ratio [–]";
    for (const double ratio : options.outlier_ratios)
        study.levels.push_back({{ratio}, number_text(ratio), {1e-3, 0}, ratio});
    return study;
}

}  // namespace mp2p_icp_apps::experiments
