#include <pcl/features/normal_3d_omp.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/registration/gicp.h>
#include <pcl/registration/icp.h>
#include <pcl/registration/transformation_estimation_point_to_plane_lls.h>

#include <cmath>

#include "peers.h"

namespace compare_peers
{
namespace
{
using pcl::PointNormal;
using pcl::PointXYZ;

template <class P>
typename pcl::PointCloud<P>::Ptr cloud_of(const Points& points)
{
    auto cloud = std::make_shared<pcl::PointCloud<P>>();
    for (const auto& p : points)
    {
        P q;
        q.getVector3fMap() = p;
        cloud->push_back(q);
    }
    return cloud;
}

template <class P>
typename pcl::PointCloud<P>::Ptr decimated(const typename pcl::PointCloud<P>::Ptr& cloud, double voxel)
{
    if (voxel <= 0) return cloud;
    pcl::VoxelGrid<P> grid;
    const auto side = static_cast<float>(voxel);
    grid.setLeafSize(side, side, side);
    grid.setInputCloud(cloud);
    auto out = std::make_shared<pcl::PointCloud<P>>();
    grid.filter(*out);
    return out;
}

/// One of PCL's registrations, with its count of iterations.
template <class Base>
struct Counting : Base
{
    int iterations() const { return this->nr_iterations_; }
    using Base::computeCovariances;
};
template <class P>
struct Counting<pcl::IterativeClosestPoint<P, P>> : pcl::IterativeClosestPoint<P, P>
{
    int iterations() const { return this->nr_iterations_; }
};

template <class P, class Base>
class PclAttempt : public Attempt
{
 public:
    PclAttempt(const Points& local, const Points& global, const Task& task)
        : local_(cloud_of<P>(local)), global_(cloud_of<P>(global)), task_(task)
    {
    }
    void prepare() override
    {
        local_ = decimated<P>(local_, task_.voxel), global_ = decimated<P>(global_, task_.voxel);
        icp_.setMaxCorrespondenceDistance(task_.max_distance);
        icp_.setMaximumIterations(task_.max_iterations);
        icp_.setTransformationEpsilon(task_.step_m * task_.step_m);
        icp_.setTransformationRotationEpsilon(std::cos(task_.step_rad));
        icp_.setInputSource(local_);
        icp_.setInputTarget(global_);
        tree_->setInputCloud(global_);
        icp_.setSearchMethodTarget(tree_, true);
    }
    void align() override
    {
        pcl::PointCloud<P> moved;
        icp_.align(moved);
        T_global_local = icp_.getFinalTransformation().template cast<double>();
        iterations = icp_.iterations();
    }

 protected:
    typename pcl::PointCloud<P>::Ptr local_, global_;
    typename pcl::search::KdTree<P>::Ptr tree_ = std::make_shared<pcl::search::KdTree<P>>();
    Counting<Base> icp_;
    Task task_;
};

using PointToPoint = PclAttempt<PointXYZ, pcl::IterativeClosestPoint<PointXYZ, PointXYZ>>;

class PointToPlane : public PclAttempt<PointNormal, pcl::IterativeClosestPoint<PointNormal, PointNormal>>
{
 public:
    using PclAttempt::PclAttempt;
    void prepare() override
    {
        PclAttempt::prepare();
        pcl::NormalEstimationOMP<PointNormal, PointNormal> normals;
        normals.setInputCloud(global_);
        normals.setSearchMethod(tree_);
        normals.setKSearch(task_.neighbors);
        normals.compute(*global_);
        icp_.setTransformationEstimation(
            std::make_shared<
                pcl::registration::TransformationEstimationPointToPlaneLLS<PointNormal, PointNormal>>());
    }
};

class Gicp : public PclAttempt<PointXYZ, pcl::GeneralizedIterativeClosestPoint<PointXYZ, PointXYZ>>
{
 public:
    using PclAttempt::PclAttempt;
    void prepare() override
    {
        PclAttempt::prepare();
        // The rotation's epsilon of GICP is an angle.
        icp_.setTransformationEpsilon(task_.step_m), icp_.setRotationEpsilon(task_.step_rad);
        icp_.setCorrespondenceRandomness(task_.neighbors);
        const auto local_tree = std::make_shared<pcl::search::KdTree<PointXYZ>>();
        local_tree->setInputCloud(local_);
        icp_.setSearchMethodSource(local_tree, true);
        icp_.setSourceCovariances(covariances(local_, local_tree));
        icp_.setTargetCovariances(covariances(global_, tree_));
    }

 private:
    using Matrices = pcl::GeneralizedIterativeClosestPoint<PointXYZ, PointXYZ>::MatricesVector;
    std::shared_ptr<Matrices> covariances(const pcl::PointCloud<PointXYZ>::Ptr& cloud,
                                          const pcl::search::KdTree<PointXYZ>::Ptr& tree)
    {
        const auto out = std::make_shared<Matrices>();
        icp_.computeCovariances<PointXYZ>(cloud, tree, *out);
        return out;
    }
};

template <class A>
Method method(const std::string& name)
{
    return {name, [](const Points& local, const Points& global, const Task& task)
            { return std::make_unique<A>(local, global, task); }};
}
}  // namespace

std::vector<Method> pcl_methods()
{
    return {method<PointToPoint>("PCL point-to-point"), method<PointToPlane>("PCL point-to-plane"),
            method<Gicp>("PCL GICP")};
}

}  // namespace compare_peers
