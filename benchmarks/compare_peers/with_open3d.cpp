#include <open3d/geometry/PointCloud.h>
#include <open3d/pipelines/registration/GeneralizedICP.h>
#include <open3d/pipelines/registration/Registration.h>

#include "peers.h"

namespace compare_peers
{
namespace
{
using open3d::geometry::KDTreeSearchParamKNN;
using open3d::geometry::PointCloud;
namespace registration = open3d::pipelines::registration;

/// A step of the estimation, counted.
template <class Base>
struct Counting : Base
{
    mutable int calls = 0;
    Eigen::Matrix4d ComputeTransformation(const PointCloud& source, const PointCloud& target,
                                          const registration::CorrespondenceSet& pairs) const override
    {
        calls++;
        return Base::ComputeTransformation(source, target, pairs);
    }
};

class Open3dAttempt : public Attempt
{
 public:
    Open3dAttempt(const Points& local, const Points& global, const Task& task, bool generalized)
        : local_(cloud_of(local)), global_(cloud_of(global)), task_(task), generalized_(generalized)
    {
    }
    void prepare() override
    {
        if (task_.voxel > 0)
            local_ = local_->VoxelDownSample(task_.voxel), global_ = global_->VoxelDownSample(task_.voxel);
        global_->EstimateNormals(KDTreeSearchParamKNN(task_.neighbors));
        if (generalized_) local_->EstimateNormals(KDTreeSearchParamKNN(task_.neighbors));
    }
    /// It ends when fitness and rmse change by less than 1e-6 of themselves: it knows no other rule.
    void align() override
    {
        const registration::ICPConvergenceCriteria criteria(1e-6, 1e-6, task_.max_iterations);
        const Eigen::Matrix4d start = Eigen::Matrix4d::Identity();
        if (generalized_)
        {
            const Counting<registration::TransformationEstimationForGeneralizedICP> step;
            T_global_local = registration::RegistrationGeneralizedICP(*local_, *global_, task_.max_distance,
                                                                      start, step, criteria)
                                 .transformation_;
            iterations = step.calls;
        }
        else
        {
            const Counting<registration::TransformationEstimationPointToPlane> step;
            T_global_local =
                registration::RegistrationICP(*local_, *global_, task_.max_distance, start, step, criteria)
                    .transformation_;
            iterations = step.calls;
        }
    }

 private:
    static std::shared_ptr<PointCloud> cloud_of(const Points& points)
    {
        auto cloud = std::make_shared<PointCloud>();
        for (const auto& p : points) cloud->points_.push_back(p.cast<double>());
        return cloud;
    }
    std::shared_ptr<PointCloud> local_, global_;
    Task task_;
    bool generalized_;
};

Method method(const std::string& name, bool generalized)
{
    return {name, [generalized](const Points& local, const Points& global, const Task& task)
            { return std::make_unique<Open3dAttempt>(local, global, task, generalized); }};
}
}  // namespace

std::vector<Method> open3d_methods()
{
    return {method("Open3D point-to-plane", false), method("Open3D GICP", true)};
}

}  // namespace compare_peers
