#include <mp2p_icp/Matcher_Point2Plane.h>
#include <mp2p_icp/Matcher_Points_DistanceThreshold.h>
#include <mp2p_icp/icp_pipeline_from_yaml.h>
#include <mp2p_icp_filters/FilterDecimateVoxels.h>

#include <filesystem>

#include "peers.h"

namespace compare_peers
{
namespace
{
using namespace mp2p_icp;

/// A shipped pipeline, with the voxel size, the distance and the steps of the task. What is kept beside a
/// layer (index, planes) is made in prepare().
class OurAttempt : public Attempt
{
 public:
    OurAttempt(const std::string& pipeline, const Points& local, const Points& global, const Task& task)
        : local_(map_of(local)),
          global_(map_of(global)),
          pipeline_(std::filesystem::exists(pipeline)
                        ? pipeline_from_yaml_file(pipeline)
                        : pipeline_from_yaml(yaml_from_text(shipped_pipeline(pipeline))))
    {
        for (const auto& filter : pipeline_.filters.at("filters"))
            if (const auto f = std::dynamic_pointer_cast<mp2p_icp_filters::FilterDecimateVoxels>(filter))
                f->voxel_filter_resolution = task.voxel;
        for (const auto& matcher : pipeline_.icp->matchers())
        {
            if (const auto m = std::dynamic_pointer_cast<Matcher_Points_DistanceThreshold>(matcher))
                m->threshold = task.max_distance;
            if (const auto m = std::dynamic_pointer_cast<Matcher_Point2Plane>(matcher))
                m->distanceThreshold = task.max_distance;
        }
        pipeline_.parameters.maxIterations = static_cast<uint32_t>(task.max_iterations);
        pipeline_.parameters.minAbsStep_trans = task.step_m;
        pipeline_.parameters.minAbsStep_rot = task.step_rad;
    }
    void prepare() override
    {
        for (auto* map : {&local_, &global_})
            mp2p_icp_filters::apply_filter_pipeline(pipeline_.filters.at("filters"), *map);
        for (const auto& matcher : pipeline_.icp->matchers())
        {
            const auto* points = dynamic_cast<const Matcher_Points_Base*>(matcher.get());
            if (!points) continue;
            for (const auto& pair : points->layer_pairs(global_, local_)) prepare_layers(*points, pair);
        }
    }
    void align() override
    {
        Results result;
        pipeline_.icp->align(local_, global_, {}, pipeline_.parameters, result);
        T_global_local =
            result.optimal_tf.mean.getHomogeneousMatrixVal<mrpt::math::CMatrixDouble44>().asEigen();
        iterations = static_cast<int>(result.nIterations);
    }

 private:
    static metric_map_t map_of(const Points& points)
    {
        auto cloud = mrpt::maps::CSimplePointsMap::Create();
        cloud->reserve(points.size());
        for (const auto& p : points) cloud->insertPointFast(p.x(), p.y(), p.z());
        metric_map_t map;
        map.layers[metric_map_t::PT_LAYER_RAW] = cloud;
        return map;
    }
    void prepare_layers(const Matcher_Points_Base& matcher, const Matcher_Points_Base::LayerPair& layers)
    {
        global_.nn_index(layers.global);
        const auto* planes = dynamic_cast<const Matcher_Point2Plane*>(&matcher);
        if (!planes) return;
        const LocalSurfaceOptions options{planes->knn, planes->searchRadius};
        global_.local_surfaces(layers.global, options);
        if (planes->localPointMustFitPlaneToo) local_.local_surfaces(layers.local, options);
    }

    metric_map_t local_, global_;
    Pipeline pipeline_;
};

Method method(const std::string& pipeline)
{
    return {pipeline,
            [pipeline](const Points& local, const Points& global, const Task& task)
            { return std::make_unique<OurAttempt>(pipeline, local, global, task); },
            true};
}
}  // namespace

std::vector<Method> our_methods(const std::vector<std::string>& pipelines)
{
    std::vector<Method> methods;
    for (const auto& name : pipelines) methods.push_back(method(name));
    return methods;
}

}  // namespace compare_peers
