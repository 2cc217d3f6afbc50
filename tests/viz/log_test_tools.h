#pragma once

#include <mp2p_icp/ICP.h>
#include <mp2p_icp/LogRecord.h>
#include <mp2p_icp/Matcher_Points_DistanceThreshold.h>
#include <mp2p_icp/Solver_Horn.h>
#include <mp2p_icp/random.h>
#include <mrpt/maps/CSimplePointsMap.h>

#include <cmath>
#include <vector>

namespace mp2p_icp_test
{
inline mp2p_icp::metric_map_t map_of(const std::vector<mrpt::math::TPoint3D>& points)
{
    auto cloud = mrpt::maps::CSimplePointsMap::Create();
    for (const auto& p : points)
        cloud->insertPoint(static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z));
    mp2p_icp::metric_map_t map;
    map.layers[mp2p_icp::metric_map_t::PT_LAYER_RAW] = cloud;
    return map;
}

/// Points on a wavy surface of 4 x 4 m: they determine all six degrees of freedom.
inline std::vector<mrpt::math::TPoint3D> wavy_points(size_t count, uint64_t seed)
{
    mp2p_icp::SeededRandom random(seed);
    std::vector<mrpt::math::TPoint3D> points;
    for (size_t i = 0; i < count; i++)
    {
        const double x = random.uniform(-2, 2), y = random.uniform(-2, 2);
        points.emplace_back(x, y, 0.4 * std::sin(2 * x) * std::cos(1.5 * y));
    }
    return points;
}

/// A run of ICP on two maps, each of its iterations logged.
inline mp2p_icp::LogRecord logged_run(const mp2p_icp::metric_map_t& global,
                                      const mp2p_icp::metric_map_t& local, const mrpt::math::TPose3D& guess,
                                      double threshold = 0.5)
{
    mp2p_icp::ICP icp;
    icp.matchers().push_back(std::make_shared<mp2p_icp::Matcher_Points_DistanceThreshold>(threshold));
    icp.solvers().push_back(std::make_shared<mp2p_icp::Solver_Horn>());
    mp2p_icp::Parameters parameters;
    parameters.maxIterations = 100;
    parameters.saveIterationDetails = true;
    parameters.decimationIterationDetails = 1;
    mp2p_icp::Results result;
    mp2p_icp::LogRecord log;
    icp.align(local, global, guess, parameters, result, std::nullopt, log);
    return log;
}
}  // namespace mp2p_icp_test
