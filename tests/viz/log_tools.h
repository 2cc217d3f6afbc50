#pragma once

#include <gtest/gtest.h>
#include <mp2p_icp/log_snapshot.h>
#include <mrpt/core/bits_math.h>
#include <mrpt/maps/CSimplePointsMap.h>

#include <cmath>
#include <vector>

#include "picture_checks.h"

namespace mp2p_icp_test
{
using mrpt::math::TPoint3D;
using mrpt::poses::CPose3D;

inline mp2p_icp::metric_map_t::Ptr shared_map(const std::vector<TPoint3D>& points,
                                              const TPoint3D& offset = {0, 0, 0})
{
    auto cloud = mrpt::maps::CSimplePointsMap::Create();
    for (const auto& p : points)
        cloud->insertPoint(static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z));
    auto map = std::make_shared<mp2p_icp::metric_map_t>();
    map->layers[mp2p_icp::metric_map_t::PT_LAYER_RAW] = cloud;
    if (!(offset == TPoint3D(0, 0, 0))) map->set_coordinate_offset(offset);
    return map;
}

/// Far enough from each other to be told apart in a small picture, from any side.
inline const std::vector<TPoint3D> CORNERS = {{0, 0, 0}, {4, 0, 0}, {0, 3, 0}, {0, 0, 2}, {4, 3, 1}};

/// A run that goes from a guess to the identity, a third of the rest at each of three iterations.
inline std::shared_ptr<mp2p_icp::LogRecord> log_of(const mp2p_icp::metric_map_t::Ptr& global,
                                                   const mp2p_icp::metric_map_t::Ptr& local,
                                                   const CPose3D& guess = CPose3D(1.5, -1.2, 0.9, 0.5, 0, 0))
{
    auto log = std::make_shared<mp2p_icp::LogRecord>();
    log->pcGlobal = global, log->pcLocal = local;
    log->initialGuessLocalWrtGlobal = guess.asTPose();
    log->iterationsDetails.emplace();
    for (size_t i = 0; i < 3; i++)
    {
        const double left = std::pow(2.0 / 3, static_cast<double>(i + 1));
        (*log->iterationsDetails)[i].optimalPose =
            CPose3D(left * guess.x(), left * guess.y(), left * guess.z(), left * guess.yaw(), 0, 0);
    }
    log->icpResult.optimal_tf.mean = CPose3D();
    log->icpResult.optimal_tf.cov.setDiagonal(1e-4);
    log->icpResult.verdict = mp2p_icp::Verdict::aligned;
    log->icpResult.nIterations = 3;
    return log;
}
inline std::shared_ptr<mp2p_icp::LogRecord> log_of_corners()
{
    return log_of(shared_map(CORNERS), shared_map(CORNERS));
}

inline mp2p_icp::LogMoment after(size_t iteration)
{
    return {mp2p_icp::LogMoment::Kind::Iteration, iteration};
}
const mp2p_icp::LogMoment GUESS_MOMENT{mp2p_icp::LogMoment::Kind::Guess, 0},
    REJECTED_MOMENT{mp2p_icp::LogMoment::Kind::Rejected, 0},
    FINAL_MOMENT{mp2p_icp::LogMoment::Kind::Final, 0};

inline mp2p_icp::LogSnapshotOptions small_picture()
{
    mp2p_icp::LogSnapshotOptions options;
    options.width = 480, options.height = 360;
    return options;
}

/// Sum over all pixels and channels.
inline double difference(const mrpt::img::CImage& a, const mrpt::img::CImage& b)
{
    EXPECT_EQ(a.getWidth(), b.getWidth());
    EXPECT_EQ(a.getHeight(), b.getHeight());
    double sum = 0;
    for (int y = 0; y < static_cast<int>(a.getHeight()); y++)
        for (int x = 0; x < static_cast<int>(a.getWidth()); x++)
        {
            const auto p = color_at(a, x, y), q = color_at(b, x, y);
            sum += std::abs(p.R - q.R) + std::abs(p.G - q.G) + std::abs(p.B - q.B);
        }
    return sum;
}
}  // namespace mp2p_icp_test
