#include "overlap.h"

#include <mp2p_icp/Matcher_Points_Base.h>

#include <algorithm>
#include <stdexcept>

namespace mp2p_icp_bench
{
using namespace mp2p_icp;

double overlap(const CloudLayer& local, const CloudLayer& global, const mrpt::poses::CPose3D& pose,
               double metres)
{
    const auto points = local.map.point_layer(local.name);
    PointArrays asked;
    asked.resize(points->size());
    for (size_t i = 0; i < points->size(); i++)
    {
        mrpt::math::TPoint3D p;
        points->getPoint(i, p.x, p.y, p.z);
        p = pose.composePoint(p);
        asked.x[i] = static_cast<float>(p.x), asked.y[i] = static_cast<float>(p.y),
        asked.z[i] = static_cast<float>(p.z);
    }
    const auto limit_sq = static_cast<float>(metres * metres);
    const std::vector<float> limit(asked.size(), limit_sq);
    std::vector<uint32_t> ids(asked.size());
    std::vector<float> dist_sq(asked.size());
    global.map.nn_index(global.name)
        ->nearest(asked, 0, asked.size(), 1, limit.data(), ids.data(), dist_sq.data());
    const auto near = std::count_if(dist_sq.begin(), dist_sq.end(), [&](float d) { return d < limit_sq; });
    return static_cast<double>(near) / static_cast<double>(std::max<size_t>(1, asked.size()));
}

double overlap_at_first(const Pipeline& pipeline, const metric_map_t& local, const metric_map_t& global,
                        const mrpt::poses::CPose3D& guess)
{
    MatchContext context;
    context.variables["ICP_ITERATION"] = 0;
    for (const auto& matcher : pipeline.icp->matchers())
        if (const auto points = std::dynamic_pointer_cast<Matcher_Points_Base>(matcher))
        {
            const auto gate = points->gate(context);
            if (!gate) continue;
            const auto layers = points->layer_pairs(global, local).at(0);
            return overlap({local, layers.local}, {global, layers.global}, guess, *gate);
        }
    throw std::invalid_argument("the pipeline has no matcher of points with a largest distance");
}
}  // namespace mp2p_icp_bench
