#pragma once

#include <Eigen/Dense>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace compare_peers
{
using Points = std::vector<Eigen::Vector3f>;

/// What all methods get alike.
struct Task
{
    double voxel = 0.25;        ///< m; 0: undecimated
    int neighbors = 10;         ///< for normals and covariances of the peers
    double max_distance = 1.0;  ///< of pairings, m
    int max_iterations = 100;
    double step_m = 1e-4, step_rad = 5e-4;  ///< to end at, where a method can be told so
};

/// One method on one pair of clouds: made with the clouds in its own type, asked to prepare() (decimation,
/// index, normals) and to align() from the identity once.
class Attempt
{
 public:
    virtual ~Attempt() = default;
    virtual void prepare() = 0;
    virtual void align() = 0;

    Eigen::Matrix4d T_global_local = Eigen::Matrix4d::Identity();
    int iterations = 0;
};

struct Method
{
    std::string name;
    std::function<std::unique_ptr<Attempt>(const Points& local, const Points& global, const Task&)> make;
    bool ours = false;
};

std::vector<Method> pcl_methods();
std::vector<Method> open3d_methods();
/// Names of shipped pipelines, or files, of three-dimensional points.
std::vector<Method> our_methods(const std::vector<std::string>& pipelines);

}  // namespace compare_peers
