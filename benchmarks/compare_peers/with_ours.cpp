#include <mp2p_icp/Matcher_Point2Plane.h>
#include <mp2p_icp/Matcher_Points_DistanceThreshold.h>
#include <mp2p_icp/icp_pipeline_from_yaml.h>
#include <mp2p_icp/parallel.h>
#include <mp2p_icp_filters/FilterDecimateVoxels.h>

#include <filesystem>

#include "peers.h"

namespace compare_peers
{
namespace
{
using namespace mp2p_icp;

using mp2p_icp_filters::FilterDecimateVoxels;

constexpr double SHIPPED_VOXEL = 0.25;  ///< m, that the pipelines are written for

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
                        : pipeline_from_yaml(yaml_from_text(shipped_pipeline(pipeline)))),
          undecimated_(task.voxel <= 0)
    {
        const double scale = task.voxel > 0 ? task.voxel / SHIPPED_VOXEL : 1;
        for (const auto& filter : pipeline_.filters.at("filters"))
            if (const auto f = std::dynamic_pointer_cast<FilterDecimateVoxels>(filter))
                f->voxel_filter_resolution = scale * f->voxel_filter_resolution.value();
        for (const auto& matcher : pipeline_.icp->matchers())
        {
            if (const auto m = std::dynamic_pointer_cast<Matcher_Points_DistanceThreshold>(matcher))
                m->threshold = task.max_distance;
            if (const auto m = std::dynamic_pointer_cast<Matcher_Point2Plane>(matcher))
                m->distanceThreshold = task.max_distance, m->surfaceVoxelSize *= scale;
        }
        pipeline_.parameters.maxIterations = static_cast<uint32_t>(task.max_iterations);
        pipeline_.parameters.minAbsStep_trans = task.step_m;
        pipeline_.parameters.minAbsStep_rot = task.step_rad;
    }
    void prepare() override
    {
        const auto filter_map = [this](metric_map_t& map)
        {
            for (const auto& filter : pipeline_.filters.at("filters")) apply(filter, map);
        };
        run_all({[&]() { filter_map(local_); }, [&]() { filter_map(global_); }});
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
    /// Undecimated, a decimated layer is what it would be made of.
    void apply(const mp2p_icp_filters::FilterBase::Ptr& filter, metric_map_t& map) const
    {
        const auto decimate = std::dynamic_pointer_cast<FilterDecimateVoxels>(filter);
        if (decimate && undecimated_)
            map.layers[decimate->output_pointcloud_layer] =
                map.layers.at(decimate->input_pointcloud_layer.at(0));
        else
            mp2p_icp_filters::apply_filter_pipeline({filter}, map);
    }
    void prepare_layers(const Matcher_Points_Base& matcher, const Matcher_Points_Base::LayerPair& layers)
    {
        const auto* planes = dynamic_cast<const Matcher_Point2Plane*>(&matcher);
        run_all({[&]() { global_.nn_index(layers.global); },
                 [&]()
                 {
                     if (planes) global_.local_surfaces(layers.global, planes->surface_options());
                 },
                 [&]()
                 {
                     if (planes && planes->localPointMustFitPlaneToo)
                         local_.local_surfaces(layers.local, planes->surface_options());
                 }});
    }

    metric_map_t local_, global_;
    Pipeline pipeline_;
    bool undecimated_;
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
