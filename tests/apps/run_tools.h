#pragma once

#include <gtest/gtest.h>
#include <mp2p_icp/load_map.h>
#include <mp2p_icp/numbers.h>
#include <mp2p_icp/se3.h>
#include <mp2p_icp/synthetic/sample_by_area.h>
#include <mp2p_icp/synthetic/scans.h>
#include <mp2p_icp/synthetic/worlds.h>
#include <mp2p_icp/yaml_tools.h>
#include <mrpt/core/bits_math.h>
#include <mrpt/maps/CSimplePointsMap.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "icp_run.h"
#include "test_data.h"

namespace mp2p_icp_test
{
using mp2p_icp::yaml;
using mrpt::poses::CPose3D;

// ---- Running ----------------------------------------------------------------------------------------------
struct Outcome
{
    int code = -1;
    std::string out, err;
};

inline Outcome run(const std::vector<std::string>& arguments)
{
    std::ostringstream out, err;
    const int code = mp2p_icp_apps::icp_run(arguments, {out, err});
    return {code, out.str(), err.str()};
}

/// Exit code 1, and one clear line with all of these words on stderr.
inline void expect_complaint(const Outcome& o, const std::vector<std::string>& words)
{
    EXPECT_EQ(o.code, 1) << o.out;
    EXPECT_EQ(o.err.rfind("icp-run: ", 0), 0u) << o.err;
    EXPECT_EQ(std::count(o.err.begin(), o.err.end(), '\n'), 1) << o.err;
    for (const auto& word : words)
        EXPECT_NE(o.err.find(word), std::string::npos) << "'" << word << "' is missing in: " << o.err;
}

inline bool contains(const std::string& text, const std::string& part)
{
    return text.find(part) != std::string::npos;
}

// ---- Files ------------------------------------------------------------------------------------------------
/// A fresh folder for the files of one test.
class Folder
{
 public:
    Folder() : path_(temp_path(""))
    {
        std::filesystem::remove_all(path_);
        std::filesystem::create_directories(path_);
    }
    ~Folder()
    {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    std::string path(const std::string& name) const { return path_ + "/" + name; }

    std::string text(const std::string& name, const std::string& content) const
    {
        std::ofstream(path(name), std::ios::binary) << content;
        return path(name);
    }
    /// One cloud layer, `raw`, in the format of the name's suffix.
    std::string cloud(const std::string& name, const mrpt::maps::CSimplePointsMap& points,
                      const mrpt::math::TPoint3D& offset = {0, 0, 0}) const
    {
        mp2p_icp::metric_map_t map;
        map.layers["raw"] = mrpt::maps::CSimplePointsMap::Create(points);
        if (offset != mrpt::math::TPoint3D(0, 0, 0)) map.set_coordinate_offset(offset);
        mp2p_icp::save_map(map, path(name));
        return path(name);
    }

 private:
    std::string path_;
};

inline std::string content_of(const std::string& path)
{
    std::ifstream in(path, std::ios::binary);
    EXPECT_TRUE(in.good()) << path;
    return {std::istreambuf_iterator<char>(in), {}};
}

/// The lines of a text that do not hold `word`.
inline std::string lines_without(const std::string& text, const std::string& word)
{
    std::istringstream in(text);
    std::string out;
    for (std::string line; std::getline(in, line);)
        if (!contains(line, word)) out += line + "\n";
    return out;
}

// ---- Clouds -----------------------------------------------------------------------------------------------
/// A room (12 x 9 x 3 m) without symmetry.
inline mp2p_icp::synthetic::TriangleMesh room()
{
    return mp2p_icp::synthetic::room_with_boxes(12, 9, 3, 10, 42);
}

/// Random points of its walls and furniture.
inline mrpt::maps::CSimplePointsMap points_of_room(size_t count)
{
    return *mp2p_icp::synthetic::sample_by_area(room(), count, 5);
}

/// A scan of it, from a place in it.
inline mrpt::maps::CSimplePointsMap scan_of_room(const CPose3D& T_world_sensor, double sigma = 0.01,
                                                 uint64_t seed = 1)
{
    using namespace mp2p_icp::synthetic;
    static const RayTracer tracer(room());
    RotatingLidar lidar;
    lidar.rings = 24, lidar.azimuth_steps = 360, lidar.lowest_deg = -35, lidar.highest_deg = 35;
    lidar.sigma = sigma, lidar.seed = seed;
    return *scan_from(tracer, T_world_sensor, lidar).points;
}

/// The same points as seen from a frame at `T_here_there`.
inline mrpt::maps::CSimplePointsMap seen_from(const mrpt::maps::CSimplePointsMap& points,
                                              const CPose3D& T_here_there)
{
    mrpt::maps::CSimplePointsMap out;
    for (size_t i = 0; i < points.size(); i++)
    {
        float x, y, z;
        points.getPoint(i, x, y, z);
        const auto p = T_here_there.inverseComposePoint({x, y, z});
        out.insertPoint(static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z));
    }
    return out;
}

inline CPose3D pose_deg(double x, double y, double z, double yaw, double pitch, double roll)
{
    using mrpt::DEG2RAD;
    return {x, y, z, DEG2RAD(yaw), DEG2RAD(pitch), DEG2RAD(roll)};
}

/// A pipeline on the points as they are, which ends exactly on the optimum.
inline const char* const EXACT_PIPELINE = R"(class_name: mp2p_icp::ICP
params:
  maxIterations: 200
  minAbsStep_trans: 1e-9
  minAbsStep_rot: 1e-9
solvers:
  - class: mp2p_icp::Solver_Horn
    params: ~
matchers:
  - class: mp2p_icp::Matcher_Points_DistanceThreshold
    params:
      threshold: 0.5
quality:
  - class: mp2p_icp::QualityEvaluator_PairedRatio
    params: ~
)";

// ---- Results ----------------------------------------------------------------------------------------------
inline double number_at(const yaml::node_t& node)
{
    const auto value = mp2p_icp::to_number(mp2p_icp::scalar_text(node, {}));
    EXPECT_TRUE(value.has_value());
    return value.value_or(std::nan(""));
}

/// A copy: yaml's operator[] points into its map, which is often a temporary here.
inline yaml part(const yaml& map, const std::string& key)
{
    return yaml(map.asMap().at(key));
}

inline double number_at(const yaml& map, const std::string& key)
{
    return number_at(map.asMap().at(key));
}

inline Eigen::MatrixXd matrix_at(const yaml& map, const std::string& key)
{
    const auto& rows = map.asMap().at(key).asSequence();
    Eigen::MatrixXd m(rows.size(), rows.at(0).asSequence().size());
    for (int r = 0; r < m.rows(); r++)
        for (int c = 0; c < m.cols(); c++)
            m(r, c) = number_at(rows[static_cast<size_t>(r)].asSequence().at(static_cast<size_t>(c)));
    return m;
}

/// From x, y, z and the angles in degrees.
inline CPose3D pose_at(const yaml& map, const std::string& key)
{
    const yaml p(map.asMap().at(key));
    return pose_deg(number_at(p, "x"), number_at(p, "y"), number_at(p, "z"), number_at(p, "yaw_deg"),
                    number_at(p, "pitch_deg"), number_at(p, "roll_deg"));
}

inline yaml read_result(const std::string& path)
{
    return mp2p_icp::yaml_from_file(path);
}

inline std::string text_at(const yaml& map, const std::string& key)
{
    return mp2p_icp::scalar_text(map.asMap().at(key), {});
}

inline void expect_near(const CPose3D& found, const CPose3D& truth, double metres, double degrees)
{
    EXPECT_LT((mp2p_icp::translation_of(found) - mp2p_icp::translation_of(truth)).norm(), metres)
        << found << " instead of " << truth;
    const double angle =
        mp2p_icp::rotation_angle(mp2p_icp::rotation_of(truth).transpose() * mp2p_icp::rotation_of(found));
    EXPECT_LT(mrpt::RAD2DEG(angle), degrees) << found << " instead of " << truth;
}

}  // namespace mp2p_icp_test
