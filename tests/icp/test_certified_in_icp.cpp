// The certified solver as the solver of every iteration: the poses of Gauss-Newton, without a start.
#include <gtest/gtest.h>
#include <mp2p_icp/Solver_Certified.h>
#include <mp2p_icp/Solver_GaussNewton.h>
#include <mp2p_icp/icp_pipeline_from_yaml.h>
#include <mp2p_icp/load_map.h>
#include <mp2p_icp/synthetic/load_obj_mesh.h>
#include <mp2p_icp/synthetic/random_pose.h>
#include <mp2p_icp/synthetic/sample_by_area.h>

#include "icp_test_tools.h"
#include "test_data.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
solver_list_t certified()
{
    return {std::make_shared<Solver_Certified>()};
}
solver_list_t gauss_newton()
{
    const auto solver = std::make_shared<Solver_GaussNewton>();
    solver->maxIterations = 30;  // to the minimum
    return {solver};
}

Results run_default(const metric_map_t& raw_local, const metric_map_t& raw_global,
                    const solver_list_t& solvers)
{
    metric_map_t local = raw_local, global = raw_global;
    Pipeline pipeline =
        pipeline_from_yaml(yaml_from_text(shipped_pipeline(default_pipeline_for(local, global))));
    ParameterSource source;
    source.updateVariables(extent_variables(local, global));
    pipeline.attachToParameterSource(source);
    if (pipeline.filters.count("filters"))
        for (auto* map : {&local, &global})
            mp2p_icp_filters::apply_filter_pipeline(pipeline.filters["filters"], *map);
    pipeline.icp->solvers() = solvers;
    Results r;
    pipeline.icp->align(local, global, {}, pipeline.parameters, r);
    return r;
}

/// Both end where the other does: on the same pairings both find the minimum to 1e-9 or so, and ICP stops at
/// steps of `step` (of the object's or the scene's size).
void expect_same_pose(const metric_map_t& local, const metric_map_t& global, double step_m, double step_rad)
{
    const Results a = run_default(local, global, certified()), b = run_default(local, global, gauss_newton());
    EXPECT_EQ(a.verdict, Verdict::aligned) << a.verdict_reason;
    EXPECT_EQ(b.verdict, Verdict::aligned) << b.verdict_reason;
    EXPECT_LT(translation_error(a.optimal_tf.mean, b.optimal_tf.mean), step_m);
    EXPECT_LT(rotation_error(a.optimal_tf.mean, b.optimal_tf.mean), step_rad);
    EXPECT_GT(rotation_error(a.optimal_tf.mean, CPose3D()), 100 * step_rad) << "the identity must not pass";
}
}  // namespace

TEST(Solver_Certified_in_icp, ends_at_the_pose_of_gauss_newton_on_the_bunny)
{
    const std::string path = "/usr/share/glmark2/models/bunny.obj";
    if (!std::filesystem::exists(path)) GTEST_SKIP() << "the package glmark2-data is not installed";
    const auto mesh = synthetic::load_obj_mesh(path);
    SeededRandom random(5);
    for (int round = 0; round < 3; round++)
    {
        SCOPED_TRACE(round);
        const auto global = synthetic::sample_by_area(mesh, 3000, 100 + static_cast<uint64_t>(round));
        const auto local = synthetic::sample_by_area(mesh, 3000, 200 + static_cast<uint64_t>(round));
        local->changeCoordinatesReference(synthetic::random_pose({0.2, 0.2, 0.2, 0.25, 0.25, 0.25}, random));
        expect_same_pose(map_of(local), map_of(global), 1e-6, 1e-5);
    }
}

TEST(Solver_Certified_in_icp, ends_at_the_pose_of_gauss_newton_on_a_lidar_pair)
{
    const auto source = shared_data("lidar_pair/source.ply"), target = shared_data("lidar_pair/target.ply");
    MP2P_ICP_SKIP_WITHOUT(source);
    expect_same_pose(*load_map(source).map, *load_map(target).map, 1e-4, 1e-5);
}
