// Real data. What comes with Debian's mrpt-common is tested always, the optional data where it is present.
#include <gtest/gtest.h>
#include <mp2p_icp/load_map.h>

#include <algorithm>
#include <fstream>

#include "icp_test_tools.h"
#include "laser_rawlog.h"
#include "test_data.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
struct Scan
{
    metric_map_t map;
    CPose3D odometry;
};

/// Every scan of the rawlog, made into layers by the pipeline, with the accumulated odometry.
std::vector<Scan> scans_of(const std::string& path, const Pipeline& pipeline)
{
    std::vector<Scan> scans;
    for (const auto& s : laser_scans(path)) scans.push_back({map_of_scan(pipeline, *s.scan), s.odometry});
    return scans;
}

/// Distance of a point to the polyline of the scan, whose points are linked when they are consecutive and
/// less than 1 m apart.
double distance_to_polyline(const mrpt::math::TPoint3D& p, const mrpt::maps::CPointsMap& scan)
{
    const auto& x = scan.getPointsBufferRef_x();
    const auto& y = scan.getPointsBufferRef_y();
    double best = std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < x.size(); i++)
    {
        const Eigen::Vector2d a(double(x[i]), double(y[i])), q(p.x, p.y);
        best = std::min(best, (q - a).norm());
        if (i + 1 == x.size()) continue;
        const Eigen::Vector2d d = Eigen::Vector2d(double(x[i + 1]), double(y[i + 1])) - a;
        if (d.norm() > 1.0 || d.norm() == 0) continue;
        best = std::min(best, (q - a - d * std::clamp((q - a).dot(d) / d.squaredNorm(), 0.0, 1.0)).norm());
    }
    return best;
}

/// Median over the points that have a partner within 10 cm. A wrong pose spreads these distances evenly:
/// median 5 cm.
double median_distance(const mrpt::maps::CPointsMap& global, const mrpt::maps::CPointsMap& local,
                       const CPose3D& pose)
{
    std::vector<double> distances;
    for (size_t i = 0; i < local.size(); i++)
    {
        mrpt::math::TPoint3D p;
        local.getPoint(i, p.x, p.y, p.z);
        const double d = distance_to_polyline(pose.composePoint(p), global);
        if (d < 0.10) distances.push_back(d);
    }
    if (distances.empty()) return std::numeric_limits<double>::infinity();
    std::nth_element(distances.begin(), distances.begin() + static_cast<long>(distances.size() / 2),
                     distances.end());
    return distances[distances.size() / 2];
}

Results run(const Pipeline& pipeline, const metric_map_t& local, const metric_map_t& global)
{
    Results r;
    pipeline.icp->align(local, global, {}, pipeline.parameters, r);
    return r;
}

/// Loads two files as they are, and aligns them from the identity with the default pipeline for them.
Results run_default(const std::string& local_path, const std::string& global_path)
{
    metric_map_t local = *load_map(local_path).map, global = *load_map(global_path).map;
    Pipeline pipeline =
        pipeline_from_yaml(yaml_from_text(shipped_pipeline(default_pipeline_for(local, global))));
    ParameterSource source;
    source.updateVariables(extent_variables(local, global));
    pipeline.attachToParameterSource(source);
    for (auto* map : {&local, &global})
        mp2p_icp_filters::apply_filter_pipeline(pipeline.filters["filters"], *map);
    return run(pipeline, local, global);
}
}  // namespace

TEST(real_scans, the_whole_laser_rawlog_from_identity_guesses)
{
    const auto path = mrpt_dataset("2006-01ENE-21-SENA_Telecom Faculty_one_loop_only.rawlog");
    MP2P_ICP_SKIP_WITHOUT(path);
    const Pipeline pipeline = pipeline_from_yaml(yaml_from_text(shipped_pipeline("icp-2d-laser")));
    const auto scans = scans_of(path, pipeline);
    ASSERT_EQ(scans.size(), 225u);
    size_t good = 0, consistent = 0, near_line = 0, near_odometry = 0, aligned = 0, identity_good = 0;
    for (size_t k = 0; k + 1 < scans.size(); k++)
    {
        const auto &global = scans[k].map, &local = scans[k + 1].map;
        const Results forward = run(pipeline, local, global), backward = run(pipeline, global, local);
        const CPose3D there = forward.optimal_tf.mean, loop = there + backward.optimal_tf.mean;
        const CPose3D odometry = scans[k + 1].odometry - scans[k].odometry;
        const bool a =
            translation_of(loop).norm() < 0.02 && rotation_angle(rotation_of(loop)) < mrpt::DEG2RAD(0.3);
        const bool b = median_distance(*global.point_layer("raw"), *local.point_layer("raw"), there) < 0.02;
        const bool c =
            translation_error(there, odometry) < 0.3 && rotation_error(there, odometry) < mrpt::DEG2RAD(5.0);
        consistent += a, near_line += b, near_odometry += c, good += a && b && c,
            aligned += forward.trusted();
        identity_good +=
            median_distance(*global.point_layer("raw"), *local.point_layer("raw"), CPose3D()) < 0.02;
    }
    const double pairs = static_cast<double>(scans.size() - 1);
    std::cout << "of " << pairs << " pairs: " << 100 * static_cast<double>(consistent) / pairs
              << " % forward-backward, " << 100 * static_cast<double>(near_line) / pairs
              << " % point-to-line, " << 100 * static_cast<double>(near_odometry) / pairs << " % odometry, "
              << 100 * static_cast<double>(good) / pairs << " % all three; called aligned: " << aligned
              << "\n";
    EXPECT_GE(static_cast<double>(good), 0.95 * pairs);
    EXPECT_LT(static_cast<double>(identity_good), 0.5 * pairs)
        << "the test must not be passed by the identity";
}

TEST(real_scans, a_lidar_pair_with_known_truth)
{
    const auto source = shared_data("lidar_pair/source.ply"), target = shared_data("lidar_pair/target.ply"),
               truth_file = shared_data("lidar_pair/T_target_source.txt");
    MP2P_ICP_SKIP_WITHOUT(truth_file);
    Eigen::Matrix4d T;
    std::ifstream text(truth_file);
    for (int i = 0; i < 16; i++) text >> T(i / 4, i % 4);
    const CPose3D truth = make_pose(T.topLeftCorner<3, 3>(), T.topRightCorner<3, 1>());
    const Results r = run_default(source, target);
    EXPECT_EQ(r.verdict, Verdict::aligned) << r.verdict_reason;
    std::cout << "error " << translation_error(r.optimal_tf.mean, truth) << " m, "
              << mrpt::RAD2DEG(rotation_error(r.optimal_tf.mean, truth))
              << " deg (truth is good to 0.02 m, 0.23 deg)\n";
    EXPECT_LT(translation_error(r.optimal_tf.mean, truth), 0.06);
    EXPECT_LT(rotation_error(r.optimal_tf.mean, truth), mrpt::DEG2RAD(0.45));
    EXPECT_GT(translation_error(CPose3D(), truth), 0.4) << "the identity must not pass";
}

TEST(real_scans, two_stored_2d_maps)
{
    const auto global = shared_data("maps_2d/global_001.mm"), local = shared_data("maps_2d/local_001.mm");
    MP2P_ICP_SKIP_WITHOUT(local);
    const Results forward = run_default(local, global), backward = run_default(global, local);
    ASSERT_EQ(forward.verdict, Verdict::aligned) << forward.verdict_reason;
    ASSERT_EQ(backward.verdict, Verdict::aligned) << backward.verdict_reason;
    const CPose3D loop = forward.optimal_tf.mean + backward.optimal_tf.mean;
    std::cout << "pose " << forward.optimal_tf.mean << ", forward-backward " << translation_of(loop).norm()
              << " m, " << mrpt::RAD2DEG(rotation_angle(rotation_of(loop))) << " deg, quality "
              << forward.quality << "\n";
    EXPECT_LT(translation_of(loop).norm(), 0.05);
    EXPECT_LT(rotation_angle(rotation_of(loop)), mrpt::DEG2RAD(0.5));
    EXPECT_LT(forward.cost_at_end, 0.5 * forward.cost_at_guess);
}
