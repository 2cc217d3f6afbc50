#include <mp2p_icp/icp_pipeline_from_yaml.h>
#include <mp2p_icp/offscreen_render.h>

#include <limits>

#include "icp_run.h"
#include "run_tools.h"

using namespace mp2p_icp_test;
using mrpt::maps::CSimplePointsMap;

namespace
{
/// A cloud, and itself as seen from a moved frame: the truth is exact up to float.
struct MovedCloud
{
    CPose3D truth = pose_deg(0.15, -0.10, 0.05, 2, -1, 1.5);
    CSimplePointsMap global = points_of_room(8000), local = seen_from(global, truth);
};
// Coordinates up to 8 m in float are rounded by at most 2.4e-7 m; the mean over thousands of points is far
// below that.
constexpr double EXACT_M = 1e-6, EXACT_DEG = 1e-5;

std::vector<std::string> operator+(std::vector<std::string> a, const std::vector<std::string>& b)
{
    a.insert(a.end(), b.begin(), b.end());
    return a;
}
}  // namespace

// ---- Alignments -------------------------------------------------------------------------------------------

TEST(icp_run, aligns_two_scans_with_a_pipeline_of_its_choice)
{
    const Folder folder;
    const auto T1 = pose_deg(0, 0, 1.2, 0, 0, 0), T2 = pose_deg(0.4, 0.2, 1.25, 4, 0.5, 0);
    const auto o =
        run({"--input-local", folder.cloud("l.ply", scan_of_room(T2, 0.01, 2)), "--input-global",
             folder.cloud("g.ply", scan_of_room(T1, 0.01, 1)), "--output-result", folder.path("r.yaml")});
    ASSERT_EQ(o.code, 0) << o.out << o.err;
    EXPECT_EQ(o.err, "");
    EXPECT_TRUE(contains(o.out, "icp-3d-point-to-plane")) << o.out;
    EXPECT_TRUE(contains(o.out, "ICP result: aligned: ")) << o.out;
    // The scans share no point: rings on the floor and walls pull point-to-point by some cm; 0.5 m and 4 deg
    // were to be found.
    expect_near(pose_at(read_result(folder.path("r.yaml")), "pose"), T2 - T1, 0.08, 0.6);
}

TEST(icp_run, finds_the_same_bits_from_every_format)
{
    const MovedCloud c;
    const Folder folder;
    const auto config = folder.text("p.yaml", EXACT_PIPELINE);
    std::string first;
    for (const char* suffix : {"ply", "pcd", "xyz", "txt", "csv", "bin", "mm", "ply.gz", "xyz.gz"})
    {
        const auto local = folder.cloud(std::string("l.") + suffix, c.local),
                   global = folder.cloud(std::string("g.") + suffix, c.global);
        const auto o = run({"--input-local", local, "--input-global", global, "-c", config, "--output-result",
                            folder.path("r.yaml")});
        ASSERT_EQ(o.code, 0) << suffix << o.out << o.err;
        const auto text = lines_without(content_of(folder.path("r.yaml")), "time_s");
        if (first.empty()) first = text;
        EXPECT_EQ(text, first) << suffix;
        expect_near(pose_at(read_result(folder.path("r.yaml")), "pose"), c.truth, EXACT_M, EXACT_DEG);
    }
}

TEST(icp_run, result_file_is_consistent)
{
    const MovedCloud c;
    const Folder folder;
    const auto o = run({"--input-local", folder.cloud("l.ply", c.local), "--input-global",
                        folder.cloud("g.ply", c.global), "-c", folder.text("p.yaml", EXACT_PIPELINE),
                        "--output-result", folder.path("r.yaml")});
    ASSERT_EQ(o.code, 0) << o.out << o.err;
    const auto y = read_result(folder.path("r.yaml"));
    EXPECT_EQ(text_at(y, "verdict"), "aligned");
    const Eigen::Matrix4d T = matrix_at(y, "T_global_local");
    const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
    EXPECT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-14);
    EXPECT_NEAR(R.determinant(), 1, 1e-14);
    EXPECT_LT(
        (T - pose_at(y, "pose").getHomogeneousMatrixVal<mrpt::math::CMatrixDouble44>().asEigen()).norm(),
        1e-14);
    const Eigen::MatrixXd covariance = matrix_at(y, "covariance");
    ASSERT_EQ(covariance.rows(), 6);
    EXPECT_LT((covariance - covariance.transpose()).norm(), 1e-12 * covariance.norm());
    EXPECT_GT(covariance.diagonal().minCoeff(), 0);
    EXPECT_GT(number_at(y, "quality"), 0.99);
    EXPECT_GT(number_at(y, "iterations"), 1);
    EXPECT_EQ(text_at(y, "termination"), "Stalled");
    EXPECT_EQ(number_at(part(y, "pairings"), "pt2pt"), static_cast<double>(c.local.size()));
    EXPECT_LT(number_at(y, "residual_rms"), 1e-6);
    for (const char* side : {"local", "global"})
    {
        EXPECT_EQ(number_at(part(part(y, "points"), side), "read"), static_cast<double>(c.local.size()));
        EXPECT_EQ(number_at(part(part(y, "points"), side), "used"), static_cast<double>(c.local.size()));
        EXPECT_EQ(number_at(part(part(y, "points"), side), "dropped_nonfinite"), 0);
    }
    const auto times = part(y, "time_s");
    EXPECT_GT(number_at(times, "align"), 0);
    EXPECT_GE(number_at(times, "total"), number_at(times, "align") + number_at(times, "load"));
    EXPECT_FALSE(y.has("error"));
    EXPECT_FALSE(y.has("rejected_pose"));
}

TEST(icp_run, tells_the_error_against_a_ground_truth)
{
    const MovedCloud c;
    const Folder folder;
    const std::vector<std::string> arguments = {"--input-local",
                                                folder.cloud("l.ply", c.local),
                                                "--input-global",
                                                folder.cloud("g.ply", c.global),
                                                "-c",
                                                folder.text("p.yaml", EXACT_PIPELINE),
                                                "--output-result",
                                                folder.path("r.yaml"),
                                                "--ground-truth"};
    // 0.05 m and 1 deg off, on purpose.
    const auto o = run(arguments + std::vector<std::string>{"[0.18 -0.14 0.05 3 -1 1.5]"});
    ASSERT_EQ(o.code, 0) << o.out << o.err;
    EXPECT_NEAR(number_at(part(read_result(folder.path("r.yaml")), "error"), "translation_m"), 0.05, EXACT_M);
    EXPECT_NEAR(number_at(part(read_result(folder.path("r.yaml")), "error"), "rotation_deg"), 1, EXACT_DEG);
    EXPECT_TRUE(contains(o.out, "0.05 m, 1 deg")) << o.out;
    // As a matrix: the identity.
    const auto file = folder.text("T.txt", "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
    ASSERT_EQ(run(arguments + std::vector<std::string>{file}).code, 0);
    EXPECT_NEAR(number_at(part(read_result(folder.path("r.yaml")), "error"), "translation_m"),
                std::sqrt(0.15 * 0.15 + 0.1 * 0.1 + 0.05 * 0.05), EXACT_M);
}

TEST(icp_run, uses_the_guess)
{
    const MovedCloud c;
    const Folder folder;
    const CPose3D far(3, 4, 0, mrpt::DEG2RAD(120.0), 0, 0);  // far beyond the matching distance
    const std::vector<std::string> arguments = {"--input-local",
                                                folder.cloud("l.ply", c.local),
                                                "--input-global",
                                                folder.cloud("g.ply", seen_from(c.global, far)),
                                                "-c",
                                                folder.text("p.yaml", EXACT_PIPELINE),
                                                "--output-result",
                                                folder.path("r.yaml"),
                                                "--guess"};
    const auto truth = (CPose3D() - far) + c.truth;
    std::ostringstream guess;
    guess << "[" << truth.x() + 0.05 << " " << truth.y() - 0.05 << " " << truth.z() << " "
          << mrpt::RAD2DEG(truth.yaw()) + 1 << " " << mrpt::RAD2DEG(truth.pitch()) << " "
          << mrpt::RAD2DEG(truth.roll()) << "]";
    const auto o = run(arguments + std::vector<std::string>{guess.str()});
    ASSERT_EQ(o.code, 0) << o.out << o.err;
    expect_near(pose_at(read_result(folder.path("r.yaml")), "pose"), truth, EXACT_M, EXACT_DEG);
}

// ---- Results that are not to be trusted -------------------------------------------------------------------

TEST(icp_run, without_overlap_gives_code_2_and_the_guess_bit_by_bit)
{
    const MovedCloud c;
    const Folder folder;
    const auto o = run({"--input-local", folder.cloud("l.ply", c.local), "--input-global",
                        folder.cloud("g.ply", c.global), "--guess", "[1000.1 -0.3 0.7 10 -5.3 3.1]",
                        "--output-result", folder.path("r.yaml"), "--output-aligned", folder.path("a.ply")});
    EXPECT_EQ(o.code, 2) << o.out << o.err;
    EXPECT_EQ(o.err, "");
    EXPECT_TRUE(contains(o.out, "ICP result: no_overlap: ")) << o.out;
    EXPECT_TRUE(contains(o.out, "(the guess)")) << o.out;
    const auto y = read_result(folder.path("r.yaml"));
    EXPECT_EQ(text_at(y, "verdict"), "no_overlap");
    EXPECT_EQ(text_at(y, "termination"), "NoPairings");
    EXPECT_EQ(number_at(y, "quality"), 0);
    const yaml pose = part(y, "pose");
    EXPECT_EQ(number_at(pose, "x"), 1000.1);
    EXPECT_EQ(number_at(pose, "y"), -0.3);
    EXPECT_EQ(number_at(pose, "z"), 0.7);
    EXPECT_EQ(number_at(pose, "yaw_deg"), 10);
    EXPECT_EQ(number_at(pose, "pitch_deg"), -5.3);
    EXPECT_EQ(number_at(pose, "roll_deg"), 3.1);
    const auto guess = pose_deg(1000.1, -0.3, 0.7, 10, -5.3, 3.1);
    EXPECT_EQ(matrix_at(y, "T_global_local"),
              guess.getHomogeneousMatrixVal<mrpt::math::CMatrixDouble44>().asEigen());
    EXPECT_TRUE(matrix_at(y, "covariance").diagonal().array().isInf().all());
    EXPECT_GT(std::filesystem::file_size(folder.path("a.ply")), 1000u);  // written all the same
}

TEST(icp_run, a_straight_line_is_under_constrained_and_says_along_and_about_which_axes)
{
    CSimplePointsMap line;
    for (int i = 0; i < 50; i++) line.insertPoint(0.1f * static_cast<float>(i), 0, 0);
    const Folder folder;
    const auto file = folder.cloud("line.xyz", line);
    const auto o = run({"--input-local", file, "--input-global", file, "-c",
                        folder.text("p.yaml", EXACT_PIPELINE), "--output-result", folder.path("r.yaml")});
    EXPECT_EQ(o.code, 2) << o.out << o.err;
    EXPECT_TRUE(contains(o.out, "free motion:  translation x")) << o.out;
    EXPECT_TRUE(contains(o.out, "free motion:  rotation roll")) << o.out;
    const auto y = read_result(folder.path("r.yaml"));
    EXPECT_EQ(text_at(y, "verdict"), "under_constrained");
    const auto& free = y.asMap().at("unobservable").asSequence();
    ASSERT_EQ(free.size(), 2u);
    EXPECT_EQ(text_at(yaml(free[0]), "kind"), "translation");
    EXPECT_EQ(text_at(yaml(free[0]), "name"), "x");
    EXPECT_EQ(text_at(yaml(free[1]), "kind"), "rotation");
    EXPECT_EQ(text_at(yaml(free[1]), "name"), "roll");
    for (const auto& motion : free)
        EXPECT_NEAR(std::abs(number_at(part(yaml(motion), "axis").asSequence().at(0))), 1, 1e-6);
    const auto covariance = matrix_at(y, "covariance");
    EXPECT_TRUE(std::isinf(covariance(5, 5)));
    EXPECT_TRUE(std::isinf(covariance(0, 0)));
    EXPECT_TRUE(std::isfinite(covariance(1, 1)));
}

// ---- Bad points -------------------------------------------------------------------------------------------

TEST(icp_run, drops_and_counts_points_that_are_not_finite)
{
    const MovedCloud c;
    const Folder folder;
    auto text = content_of(folder.cloud("l.xyz", c.local));
    text = "nan 1 2\n" + text + "1 inf 2\n3 4 -inf\n";
    const auto o =
        run({"--input-local", folder.text("bad.xyz", text), "--input-global", folder.cloud("g.xyz", c.global),
             "-c", folder.text("p.yaml", EXACT_PIPELINE), "--output-result", folder.path("r.yaml")});
    ASSERT_EQ(o.code, 0) << o.out << o.err;
    EXPECT_TRUE(contains(o.out, "3 of them dropped")) << o.out;
    const auto y = read_result(folder.path("r.yaml"));
    EXPECT_EQ(number_at(part(part(y, "points"), "local"), "dropped_nonfinite"), 3);
    EXPECT_EQ(number_at(part(part(y, "points"), "local"), "read"), static_cast<double>(c.local.size() + 3));
    EXPECT_EQ(number_at(part(part(y, "points"), "local"), "used"), static_cast<double>(c.local.size()));
    expect_near(pose_at(y, "pose"), c.truth, EXACT_M, EXACT_DEG);
}

// ---- Wrong input ------------------------------------------------------------------------------------------

TEST(icp_run, wrong_inputs_give_code_1_and_one_line)
{
    const MovedCloud c;
    const Folder folder;
    const auto good = folder.cloud("good.ply", c.global);
    const auto local = [&](const std::string& path) {
        return run({"--input-local", path, "--input-global", good});
    };
    const auto whole = content_of(good);
    expect_complaint(local(folder.path("missing.ply")), {"missing.ply"});
    expect_complaint(local(std::filesystem::temp_directory_path().string()),
                     {std::filesystem::temp_directory_path().string()});
    expect_complaint(local(folder.text("cut.ply", whole.substr(0, whole.size() / 2))),
                     {"cut.ply", "expected", "found"});
    expect_complaint(local(folder.text("empty.ply", "")), {"empty.ply"});
    expect_complaint(local(folder.text("noise.dat", std::string("\x01\x02\xff\xfe\x00\x07 noise", 12))),
                     {"noise.dat"});
    expect_complaint(local(folder.text("nan.xyz", "nan nan nan\nnan 1 2\n")), {"nan.xyz"});
    expect_complaint(local(folder.path("missing.rawlog:3")), {"missing.rawlog"});
    // The global side is told, too.
    expect_complaint(run({"--input-local", good, "--input-global", folder.path("gone.ply")}), {"gone.ply"});
}

TEST(icp_run, wrong_arguments_give_code_1_and_one_line)
{
    const MovedCloud c;
    const Folder folder;
    const auto good = folder.cloud("good.ply", c.global);
    const std::vector<std::string> inputs = {"--input-local", good, "--input-global", good};
    using Arguments = std::vector<std::string>;
    expect_complaint(run(inputs + Arguments{"--guess", "[1 2 3]"}), {"--guess", "found 3"});
    expect_complaint(run(inputs + Arguments{"--guess", "[1 2 3 4 5 x]"}), {"--guess", "'x'"});
    expect_complaint(run(inputs + Arguments{"--ground-truth", "T.txt"}), {"--ground-truth", "T.txt"});
    expect_complaint(run(inputs + Arguments{"-c", "icp-3d-lidra"}),
                     {"icp-3d-lidra", "did you mean 'icp-3d-lidar'"});
    expect_complaint(run(inputs + Arguments{"-c", folder.path("")}), {"cannot be read"});
    expect_complaint(run(inputs + Arguments{"--output-result", folder.path("no/such/r.yaml")}),
                     {"--output-result", "no/such"});
    expect_complaint(run(inputs + Arguments{"--snapshot", folder.path("")}), {"--snapshot"});
    expect_complaint(run(inputs + Arguments{"--output-aligned", folder.path("a.unknown")}),
                     {"a.unknown", ".ply"});
    expect_complaint(run(inputs + Arguments{"--entry-name-filters-local", "mine"}),
                     {"--entry-name-filters-local", "'mine'", "filters"});
    expect_complaint(run(inputs + Arguments{"--config-filters-global", folder.path("none.yaml")}),
                     {"none.yaml"});
    expect_complaint(run(inputs + Arguments{"--config-generators", folder.path("none.yaml")}), {"none.yaml"});
}

TEST(icp_run, mistakes_in_yaml_are_told_with_file_line_and_the_nearest_name)
{
    const MovedCloud c;
    const Folder folder;
    const auto good = folder.cloud("good.ply", c.global);
    const auto with = [&](const std::string& from, const std::string& to)
    {
        std::string text = EXACT_PIPELINE;
        const auto at = text.find(from);
        EXPECT_NE(at, std::string::npos) << from;
        text.replace(at, from.size(), to);
        return run({"--input-local", good, "--input-global", good, "-c", folder.text("p.yaml", text)});
    };
    expect_complaint(with("threshold:", "threshhold:"),
                     {"p.yaml:12", "matchers[0].params.threshhold", "did you mean 'threshold'"});
    expect_complaint(with("maxIterations", "maxIteration"), {"p.yaml:3", "did you mean 'maxIterations'"});
    expect_complaint(with("Solver_Horn", "Solver_Hron"),
                     {"p.yaml:7", "did you mean 'mp2p_icp::Solver_Horn'"});
    expect_complaint(with("threshold: 0.5", "threshold: -1"), {"p.yaml:12", "threshold"});
    expect_complaint(with("threshold: 0.5", "threshold: LOCAL_EXTEND"), {"LOCAL_EXTEND"});
    expect_complaint(with("matchers:", "matchers: ["), {"p.yaml:"});
    expect_complaint(
        with("threshold: 0.5", "threshold: 0.5\n      pointLayerMatches: [{global: raw, local: decimated}]"),
        {"'decimated'", "raw"});
}

TEST(icp_run, maps_without_a_common_layer_are_an_error_that_names_the_layers)
{
    const MovedCloud c;
    const Folder folder;
    mp2p_icp::metric_map_t map;
    map.layers["lidar"] = CSimplePointsMap::Create(c.global);
    mp2p_icp::save_map(map, folder.path("g.mm"));
    expect_complaint(run({"--input-local", folder.cloud("l.ply", c.local), "--input-global",
                          folder.path("g.mm"), "-c", folder.text("p.yaml", EXACT_PIPELINE)}),
                     {"local: raw", "global: lidar", "pointLayerMatches"});
}

// ---- Determinism ------------------------------------------------------------------------------------------

TEST(icp_run, gives_the_same_bits_again_and_on_any_number_of_threads)
{
    const Folder folder;
    const auto local = folder.cloud("l.ply", scan_of_room(pose_deg(0.3, 0.1, 1.2, 3, 0, 0), 0.01, 2));
    const auto global = folder.cloud("g.ply", scan_of_room(pose_deg(0, 0, 1.2, 0, 0, 0), 0.01, 1));
    const std::vector<std::string> arguments = {"--input-local",    local,
                                                "--input-global",   global,
                                                "--output-result",  folder.path("r.yaml"),
                                                "--output-aligned", folder.path("a.ply")};
    std::string first;
    for (const auto& threads : std::vector<std::vector<std::string>>{
             {}, {}, {"--threads", "1"}, {"--threads", "2"}, {"--threads", "8"}})
    {
        const auto o = run(arguments + threads);
        ASSERT_EQ(o.code, 0) << o.out << o.err;
        const auto all = lines_without(content_of(folder.path("r.yaml")), "time_s") +
                         content_of(folder.path("a.ply")) + lines_without(o.out, "  time:");
        if (first.empty()) first = all;
        EXPECT_EQ(all, first) << (threads.empty() ? "default" : threads[1]);
    }
}

// ---- Large coordinates ------------------------------------------------------------------------------------

TEST(icp_run, aligns_clouds_in_utm_coordinates_as_at_the_origin)
{
    const Folder folder;
    const mrpt::math::TPoint3D utm(500000, 4600000, 300);
    const auto T_local = pose_deg(0.3, 0.1, 1.2, 3, 1, 0);
    const auto local = scan_of_room(T_local, 0.01, 2),
               global = scan_of_room(pose_deg(0, 0, 1.2, 0, 0, 0), 0.01, 1);
    const auto config = folder.text("p.yaml", EXACT_PIPELINE);
    const auto aligned = [&](const mrpt::math::TPoint3D& offset, const std::string& name)
    {
        const auto o = run({"--input-local", folder.cloud(name + "_l.ply", local, offset), "--input-global",
                            folder.cloud(name + "_g.ply", global, offset), "-c", config, "--output-result",
                            folder.path(name + ".yaml"), "--output-aligned", folder.path(name + "_a.ply")});
        EXPECT_EQ(o.code, 0) << o.out << o.err;
        return Eigen::Matrix4d(matrix_at(read_result(folder.path(name + ".yaml")), "T_global_local"));
    };
    const Eigen::Matrix4d at_origin = aligned({0, 0, 0}, "origin"), at_utm = aligned(utm, "utm");
    const Eigen::Vector4d shift(utm.x, utm.y, utm.z, 0);
    for (const Eigen::Vector4d& p : {Eigen::Vector4d(0, 0, 0, 1), Eigen::Vector4d(5, -4, 2, 1)})
        EXPECT_LT((at_utm * (p + shift) - (at_origin * p + shift)).norm(), 1e-6) << p.transpose();
    EXPECT_GT((at_origin * Eigen::Vector4d(5, -4, 2, 1) - Eigen::Vector4d(5, -4, 2, 1)).norm(),
              0.1);  // something was to be found

    // The aligned clouds are the same, too, in the coordinates of their inputs.
    const auto a = mp2p_icp::load_map(folder.path("origin_a.ply")),
               b = mp2p_icp::load_map(folder.path("utm_a.ply"));
    const auto pa = a.map->point_layer("raw"), pb = b.map->point_layer("raw");
    ASSERT_EQ(pa->size(), local.size());
    ASSERT_EQ(pb->size(), local.size());
    for (size_t i = 0; i < pa->size(); i += 97)
    {
        mrpt::math::TPoint3D x, y;
        pa->getPoint(i, x), pb->getPoint(i, y);
        EXPECT_LT(((y + b.map->coordinate_offset() - utm) - x).norm(),
                  3e-6);  // several roundings of floats up to 8 m
    }
}

TEST(icp_run, ground_truth_in_utm_is_compared_at_the_cloud)
{
    const MovedCloud c;
    const Folder folder;
    const mrpt::math::TPoint3D utm(500000, 4600000, 0);
    const CPose3D truth = CPose3D(utm) + c.truth + CPose3D(-utm.x, -utm.y, -utm.z, 0, 0, 0);
    std::ostringstream matrix;
    matrix.precision(17);
    const auto T = truth.getHomogeneousMatrixVal<mrpt::math::CMatrixDouble44>();
    for (int i = 0; i < 16; i++) matrix << T(i / 4, i % 4) << " ";
    const auto o =
        run({"--input-local", folder.cloud("l.ply", c.local, utm), "--input-global",
             folder.cloud("g.ply", c.global, utm), "-c", folder.text("p.yaml", EXACT_PIPELINE),
             "--ground-truth", folder.text("T.txt", matrix.str()), "--output-result", folder.path("r.yaml")});
    ASSERT_EQ(o.code, 0) << o.out << o.err;
    EXPECT_LT(number_at(part(read_result(folder.path("r.yaml")), "error"), "translation_m"), EXACT_M);
    EXPECT_LT(number_at(part(read_result(folder.path("r.yaml")), "error"), "rotation_deg"), EXACT_DEG);
}

// ---- Outputs ----------------------------------------------------------------------------------------------

TEST(icp_run, aligned_cloud_falls_on_the_global_one)
{
    const MovedCloud c;
    const Folder folder;
    const auto o = run({"--input-local", folder.cloud("l.ply", c.local), "--input-global",
                        folder.cloud("g.ply", c.global), "-c", folder.text("p.yaml", EXACT_PIPELINE),
                        "--output-aligned", folder.path("a.ply")});
    ASSERT_EQ(o.code, 0) << o.out << o.err;
    const auto aligned = mp2p_icp::load_map(folder.path("a.ply")).map->point_layer("raw");
    ASSERT_EQ(aligned->size(), c.global.size());
    double worst = 0;
    for (size_t i = 0; i < aligned->size(); i++)
    {
        mrpt::math::TPoint3D a, g;
        aligned->getPoint(i, a), c.global.getPoint(i, g);
        worst = std::max(worst, (a - g).norm());
    }
    EXPECT_LT(worst, 3e-6);
}

TEST(icp_run, snapshot_is_a_png)
{
    try
    {
        mrpt::opengl::COpenGLScene scene;
        mp2p_icp::render_offscreen(scene, 16, 16);
    }
    catch (const std::runtime_error& e)
    {
        GTEST_SKIP() << "this machine cannot render off-screen: " << e.what();
    }
    const MovedCloud c;
    const Folder folder;
    const auto o = run({"--input-local", folder.cloud("l.ply", c.local), "--input-global",
                        folder.cloud("g.ply", c.global), "--snapshot", folder.path("s.png")});
    ASSERT_EQ(o.code, 0) << o.out << o.err;
    EXPECT_TRUE(contains(o.out, "Written: " + folder.path("s.png"))) << o.out;
    const auto png = content_of(folder.path("s.png"));
    EXPECT_EQ(png.substr(0, 8), "\x89PNG\r\n\x1a\n");
    EXPECT_GT(png.size(), 10000u);  // an empty white picture would be smaller
}

TEST(icp_run, writes_a_debug_log_and_profiles_when_asked)
{
    const MovedCloud c;
    const Folder folder;
    std::string config = EXACT_PIPELINE;
    config.replace(config.find("  maxIterations"), 0,
                   "  debugFileNameFormat: " + folder.path("story-$UNIQUE_ID.icplog") + "\n");
    const std::vector<std::string> arguments = {"--input-local",
                                                folder.cloud("l.ply", c.local),
                                                "--input-global",
                                                folder.cloud("g.ply", c.global),
                                                "-c",
                                                folder.text("p.yaml", config)};
    const auto logs = [&]
    {
        size_t count = 0;
        for (const auto& entry : std::filesystem::directory_iterator(folder.path("")))
            count += entry.path().extension() == ".icplog" && entry.file_size() > 1000;
        return count;
    };
    const auto plain = run(arguments);
    ASSERT_EQ(plain.code, 0) << plain.out << plain.err;
    EXPECT_EQ(logs(), 0u);
    EXPECT_FALSE(contains(plain.out, "align.iteration") || contains(plain.out, "CTimeLogger"));
    const auto o = run(arguments + std::vector<std::string>{"-d", "--profiler"});
    ASSERT_EQ(o.code, 0) << o.out << o.err;
    EXPECT_EQ(logs(), 1u);
    EXPECT_TRUE(contains(o.out, "CTimeLogger report")) << o.out;
}

// ---- Filters and generators -------------------------------------------------------------------------------

TEST(icp_run, filters_each_side_with_its_own_list)
{
    const MovedCloud c;
    const Folder folder;
    const auto decimate = [](const char* cell)
    {
        return std::string(
                   "  - class_name: mp2p_icp_filters::FilterDecimateVoxels\n    params: "
                   "{input_pointcloud_layer: raw, "
                   "output_pointcloud_layer: few, voxel_filter_resolution: ") +
               cell + ", decimate_method: FirstPoint}\n";
    };
    const auto config = folder.text("p.yaml", std::string(EXACT_PIPELINE) + "of_local:\n" + decimate("0.3") +
                                                  "of_global:\n" + decimate("0.1"));
    const std::vector<std::string> arguments = {"--input-local",
                                                folder.cloud("l.ply", c.local),
                                                "--input-global",
                                                folder.cloud("g.ply", c.global),
                                                "-c",
                                                config,
                                                "--output-result",
                                                folder.path("r.yaml")};
    const auto used = [&](const char* side)
    { return number_at(part(part(read_result(folder.path("r.yaml")), "points"), side), "used"); };
    const double all = static_cast<double>(c.local.size());

    auto o = run(arguments + std::vector<std::string>{"--entry-name-filters-local", "of_local",
                                                      "--entry-name-filters-global", "of_global"});
    ASSERT_EQ(o.code, 0) << o.out << o.err;
    EXPECT_TRUE(contains(o.out, "Filtered local: ") && contains(o.out, "Filtered global: ")) << o.out;
    const double few_local = used("local") - all,
                 few_global = used("global") - all;  // both layers match: raw and few
    EXPECT_GT(few_local, 100);
    EXPECT_GT(few_global, few_local);

    const auto file =
        folder.text("f.yaml", "filters:\n" + decimate("LOCAL_EXTENT / 10") + "of_local:\n" + decimate("0.1"));
    o = run(arguments + std::vector<std::string>{"--config-filters-local", file, "--config-filters-global",
                                                 file, "--entry-name-filters-global", "of_local"});
    ASSERT_EQ(o.code, 0) << o.out << o.err;
    EXPECT_LT(used("local") - all, few_local);    // cells of more than a metre, from a formula
    EXPECT_EQ(used("global") - all, few_global);  // the same cells of 0.1 m
    EXPECT_EQ(run(arguments).code, 0);
    EXPECT_EQ(used("local"), all);
}

TEST(icp_run, aligns_two_laser_scans_of_a_rawlog_there_and_back)
{
    const auto rawlog = mrpt_dataset("2006-01ENE-21-SENA_Telecom Faculty_one_loop_only.rawlog");
    MP2P_ICP_SKIP_WITHOUT(rawlog);
    const Folder folder;
    const auto pose_of = [&](const std::string& local, const std::string& global)
    {
        const auto o = run({"--input-local", rawlog + ":" + local, "--input-global", rawlog + ":" + global,
                            "--output-result", folder.path("r.yaml")});
        EXPECT_EQ(o.code, 0) << o.out << o.err;
        EXPECT_TRUE(contains(o.out, "icp-2d-laser") && contains(o.out, "entry " + local)) << o.out;
        const auto y = read_result(folder.path("r.yaml"));
        EXPECT_GT(number_at(part(part(y, "points"), "local"), "read"), 200);
        EXPECT_LT(number_at(part(part(y, "points"), "local"), "read"),
                  362);  // the rays of the scanner, not what was filled in between them
        return pose_at(y, "pose");
    };
    const auto forward = pose_of("202", "200"), backward = pose_of("200", "202");
    EXPECT_GT(forward.x(), 0.2);  // the robot drove
    expect_near(forward + backward, CPose3D(), 0.02, 0.3);
    expect_complaint(run({"--input-local", rawlog + ":201", "--input-global", rawlog + ":200"}),
                     {"entry 201", "entry 200", "entry 202"});
}

TEST(icp_run, makes_layers_of_observations_with_the_generators_of_a_file)
{
    const auto rawlog = mrpt_dataset("2006-01ENE-21-SENA_Telecom Faculty_one_loop_only.rawlog");
    MP2P_ICP_SKIP_WITHOUT(rawlog);
    const Folder folder;
    const auto with = [&](const std::string& params)
    {
        const auto file =
            folder.text("g.yaml", "generators:\n  - class_name: mp2p_icp_filters::Generator\n    params: {" +
                                      params + "}\n");
        return run({"--input-local", rawlog + ":202", "--input-global", rawlog + ":200", "-c",
                    "icp-2d-points", "--config-generators", file});
    };
    const auto o = with("target_layer: scan");
    EXPECT_EQ(o.code, 0) << o.out << o.err;
    EXPECT_TRUE(contains(o.out, "points in \"scan\"")) << o.out;
    // With no -c, a pipeline is chosen that can do with what these generators make.
    const auto chosen =
        run({"--input-local", rawlog + ":202", "--input-global", rawlog + ":200", "--config-generators",
             folder.text("default.yaml",
                         "generators: [{class_name: mp2p_icp_filters::Generator, params: ~}]\n")});
    EXPECT_EQ(chosen.code, 0) << chosen.out << chosen.err;
    EXPECT_TRUE(contains(chosen.out, "icp-2d-points")) << chosen.out;
    expect_complaint(with("process_sensor_labels_regex: nobody"), {"202", "made no point"});
    expect_complaint(with("target_lair: scan"), {"g.yaml:3", "did you mean 'target_layer'"});
}

// ---- Real clouds ------------------------------------------------------------------------------------------

TEST(icp_run, aligns_a_real_pair_of_lidar_scans)
{
    const auto source = shared_data("lidar_pair/source.ply");
    MP2P_ICP_SKIP_WITHOUT(source);
    const Folder folder;
    const auto o = run({"--input-local", source, "--input-global", shared_data("lidar_pair/target.ply"),
                        "--ground-truth", shared_data("lidar_pair/T_target_source.txt"), "--output-result",
                        folder.path("r.yaml")});
    ASSERT_EQ(o.code, 0) << o.out << o.err;
    const auto error = part(read_result(folder.path("r.yaml")), "error");
    EXPECT_LT(number_at(error, "translation_m"), 0.06);  // the limits that were asked for
    EXPECT_LT(number_at(error, "rotation_deg"), 0.45);
}

TEST(icp_run, aligns_the_maps_of_the_original)
{
    const auto local = shared_data("maps_2d/local_001.mm");
    MP2P_ICP_SKIP_WITHOUT(local);
    const auto global = shared_data("maps_2d/global_001.mm");
    const Folder folder;
    const auto pose_of = [&](const std::string& a, const std::string& b)
    {
        const auto o =
            run({"--input-local", a, "--input-global", b, "--output-result", folder.path("r.yaml")});
        EXPECT_EQ(o.code, 0) << o.out << o.err;
        return pose_at(read_result(folder.path("r.yaml")), "pose");
    };
    const auto forward = pose_of(local, global), backward = pose_of(global, local);
    EXPECT_GT(std::abs(mrpt::RAD2DEG(forward.yaw())), 3);   // not the identity
    expect_near(forward + backward, CPose3D(), 0.03, 0.3);  // points of 0.1 m spacing, matched point to point
}
