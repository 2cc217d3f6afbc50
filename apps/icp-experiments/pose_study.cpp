#include "pose_study.h"

#include <mp2p_icp/observability.h>
#include <mp2p_icp/se3.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace mp2p_icp_apps::experiments
{
using namespace mp2p_icp;
using namespace mp2p_icp::synthetic;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using mrpt::poses::CPose3D;

namespace
{
// The estimate that methods with a robust loss are given: the truth, moved by so much.
constexpr double ESTIMATE_OFF_M = 0.5, ESTIMATE_OFF_RAD = 2 * M_PI / 180;
constexpr double DEVIATIONS_OF_INLIERS = 5, KERNEL_SCALE = 1;

Vector3d any_direction(SeededRandom& random)
{
    const double x = random.gaussian(), y = random.gaussian();
    return Vector3d(x, y, random.gaussian()).normalized();
}

/// Turned about the middle of the cube, then shifted.
CPose3D moved_truth(const ReportWorld& world, SeededRandom& random)
{
    const Vector3d middle = Vector3d::Constant(REPORT_CUBE / 2), axis = any_direction(random);
    const Matrix3d R = world.R * Eigen::AngleAxisd(ESTIMATE_OFF_RAD, axis).toRotationMatrix();
    const Vector3d shift = ESTIMATE_OFF_M * any_direction(random);
    return make_pose(R, world.R * middle + world.t - R * middle + shift);
}

/// Without noise any weights do, but they must be finite; then the bound is zero.
ReportNoise noise_for_weights(const StudyLevel& level)
{
    return level.exact() ? ReportNoise{.01, .1 * M_PI / 180} : level.noise;
}

Pairings right_pairings(const ReportWorld& world)
{
    Pairings p = world.exact;
    const auto& wrong = world.outliers;
    size_t kept = 0;
    for (size_t i = 0; i < p.paired_pt2pt.size(); i++)
        if (!std::binary_search(wrong.begin(), wrong.end(), i)) p.paired_pt2pt[kept++] = p.paired_pt2pt[i];
    p.paired_pt2pt.resize(kept);
    return p;
}

/// Roots of the traces of the Cramer-Rao bound.
PoseError bound_of(const ReportWorld& world, const StudyLevel& level, const PairWeights& likely)
{
    if (level.exact()) return {};
    ObservabilityParameters p;
    p.sigma = 1, p.pair_weights = likely;
    const auto covariance =
        observability(right_pairings(world), world.truth(), p).covariance_twist.asEigen().diagonal().eval();
    return {std::sqrt(covariance.tail<3>().sum()), std::sqrt(covariance.head<3>().sum())};
}

/// What a method did with the outliers of a world.
void count_outliers(const ReportWorld& world, const std::vector<size_t>& rejected, PoseSample& sample)
{
    size_t found = 0;
    for (const size_t i : rejected)
        found += std::binary_search(world.outliers.begin(), world.outliers.end(), i);
    sample.outliers_kept = world.outliers.size() - found, sample.inliers_lost = rejected.size() - found;
}

bool is_horn(const PoseMethod& method)
{
    return method.id == "horn" || method.id == "horn-ml";
}

/// All methods on one world.
void run_world(size_t level_index, size_t repetition, uint64_t seed, PoseStudyResult& result)
{
    const PoseStudy& study = result.study;
    const StudyLevel& level = study.levels[level_index];
    SeededRandom random = stream_of(seed, {study.number, level_index, repetition});
    ReportWorld world = report_world(study.points, study.planes, level.noise, random, study.lines);
    if (level.outlier_ratio > 0) add_outliers(world, level.outlier_ratio, random);
    PoseProblem problem{world.pairings, {}, {}};
    problem.likely = maximum_likelihood_weights(noise_for_weights(level), study.offsets);
    problem.estimate = moved_truth(world, random);
    problem.outlier_threshold = DEVIATIONS_OF_INLIERS * noise_for_weights(level).points;
    problem.kernel_scale = KERNEL_SCALE;
    const PoseError bound = bound_of(world, level, problem.likely);

    std::vector<CPose3D> poses(study.methods.size());
    size_t horn_index = 0;
    for (size_t m = 0; m < poses.size(); m++)
    {
        OptimalTF_Result found;
        PoseSample& sample = result.at(level_index, repetition, m);
        sample.solved = study.methods[m].solve(problem, found) && found.status == SolveStatus::Determined;
        const PoseError error = error_of(found.optimalPose, world);
        sample.rotation = error.rotation, sample.translation = error.translation;
        sample.rotation_bound = bound.rotation, sample.translation_bound = bound.translation;
        count_outliers(world, found.outliers.point2point, sample);
        poses[m] = found.optimalPose;
        if (is_horn(study.methods[m])) horn_index = m;
    }
    for (size_t m = 0; m < poses.size(); m++)
    {
        PoseSample& sample = result.at(level_index, repetition, m);
        const CPose3D &pose = poses[m], &horn = poses[horn_index];
        sample.rotation_from_horn = rotation_angle(rotation_of(horn).transpose() * rotation_of(pose));
        sample.translation_from_horn = (translation_of(pose) - translation_of(horn)).norm();
    }
}
}  // namespace

const std::vector<Quantity>& quantities()
{
    static const std::vector<Quantity> both = {
        {"rotation", "SO(3) error", "rad", &PoseSample::rotation, &PoseSample::rotation_bound},
        {"translation", "Translation error", "m", &PoseSample::translation, &PoseSample::translation_bound}};
    return both;
}

size_t PoseStudyResult::method_index(const std::string& id) const
{
    for (size_t m = 0; m < study.methods.size(); m++)
        if (study.methods[m].id == id) return m;
    throw std::logic_error("the study '" + study.id + "' has no method '" + id + "'");
}

std::vector<double> PoseStudyResult::values(size_t level, size_t method, double PoseSample::*member) const
{
    std::vector<double> out;
    for (size_t k = 0; k < repetitions; k++) out.push_back(at(level, k, method).*member);
    return out;
}

PoseStudyResult run_study(const PoseStudy& study, size_t repetitions, uint64_t seed,
                          const Repetitions& workers)
{
    PoseStudyResult result(study, repetitions);
    workers.run(study.about, study.levels.size() * repetitions,
                [&](size_t i) { run_world(i / repetitions, i % repetitions, seed, result); });
    return result;
}

std::vector<Column> study_columns(const PoseStudy& study)
{
    std::vector<Column> columns = {{"study", "which kind of world; see `studies`"}};
    columns.insert(columns.end(), study.columns.begin(), study.columns.end());
    const std::vector<Column> of_runs = {
        {"repetition", "index of the world, from 0; the same world for all methods"},
        {"method", "see `methods`"},
        {"solved", "1 if the method found a pose, and says that all six degrees of freedom are determined"},
        {"rotation_error_rad", "norm of the logarithm of the rotation's error"},
        {"translation_error_m", "distance from the true translation"},
        {"rotation_bound_rad", "root of the trace of the Cramer-Rao bound of the rotation"},
        {"translation_bound_m", "the same of the translation"},
        {"rotation_from_horn_rad", "angle between this pose and Horn's of the same world"},
        {"translation_from_horn_m", "distance between the translations of the two"}};
    columns.insert(columns.end(), of_runs.begin(), of_runs.end());
    if (study.with_outliers)
    {
        columns.push_back({"outliers_kept", "wrong pairings that the method did not reject"});
        columns.push_back({"inliers_lost", "right pairings that it did reject"});
    }
    return columns;
}

namespace
{
void write_row(const PoseStudyResult& r, size_t level, size_t repetition, size_t method, CsvFile& csv)
{
    const PoseSample& s = r.at(level, repetition, method);
    csv << r.study.id;
    for (const double coordinate : r.study.levels[level].coordinates) csv << coordinate;
    csv << repetition << r.study.methods[method].id << s.solved << s.rotation << s.translation
        << s.rotation_bound << s.translation_bound << s.rotation_from_horn << s.translation_from_horn;
    if (r.study.with_outliers) csv << s.outliers_kept << s.inliers_lost;
    csv.end_row();
}

void write_quantity(const PoseStudyResult& r, size_t level, size_t method, const Quantity& q,
                    YamlWriter& yaml)
{
    const Statistics s = r.statistics(level, method, q);
    const double bound = r.bound(level, q);
    yaml.numbers(q.id + "_" + q.unit, {{"median", s.median},
                                       {"q25", s.q25},
                                       {"q75", s.q75},
                                       {"rmse", s.rmse},
                                       {"bound", bound},
                                       {"rmse_over_bound", s.rmse / bound}});
}

void write_level(const PoseStudyResult& r, size_t level, YamlWriter& yaml)
{
    yaml.open_item();
    for (size_t c = 0; c < r.study.columns.size(); c++)
        yaml.value(r.study.columns[c].name, r.study.levels[level].coordinates[c]);
    yaml.open_map("methods");
    for (size_t m = 0; m < r.study.methods.size(); m++)
    {
        size_t unsolved = 0;
        for (size_t k = 0; k < r.repetitions; k++) unsolved += !r.at(level, k, m).solved;
        yaml.open_map(r.study.methods[m].id);
        yaml.value("runs", r.repetitions), yaml.value("unsolved", unsolved);
        for (const auto& q : quantities()) write_quantity(r, level, m, q, yaml);
        yaml.close();
    }
    yaml.close(), yaml.close();
}
}  // namespace

void write_study_csv(const std::vector<PoseStudyResult>& results, const std::string& path)
{
    CsvFile csv(path, study_columns(results.at(0).study));
    for (const auto& r : results)
        for (size_t level = 0; level < r.study.levels.size(); level++)
            for (size_t k = 0; k < r.repetitions; k++)
                for (size_t m = 0; m < r.study.methods.size(); m++) write_row(r, level, k, m, csv);
    csv.close();
}

void write_study_summary(const std::vector<PoseStudyResult>& results, YamlWriter& yaml)
{
    yaml.open_list("studies");
    for (const auto& r : results)
    {
        yaml.open_item();
        yaml.value("study", r.study.id), yaml.value("about", r.study.about);
        yaml.open_map("methods");
        for (const auto& method : r.study.methods) yaml.value(method.id, method.label);
        yaml.close();
        yaml.open_list("levels");
        for (size_t level = 0; level < r.study.levels.size(); level++) write_level(r, level, yaml);
        yaml.close(), yaml.close();
    }
    yaml.close();
}

}  // namespace mp2p_icp_apps::experiments
