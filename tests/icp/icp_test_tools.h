#pragma once

#include <mp2p_icp/ICP.h>
#include <mp2p_icp/Matcher_Points_DistanceThreshold.h>
#include <mp2p_icp/Solver_Horn.h>
#include <mp2p_icp/random.h>
#include <mp2p_icp/se3.h>
#include <mrpt/core/bits_math.h>

#include <cmath>
#include <cstring>
#include <functional>

namespace mp2p_icp_test
{
using mrpt::poses::CPose3D;

/// A wavy surface of about 1 m without symmetries, sampled at random.
inline mrpt::maps::CSimplePointsMap::Ptr wavy_surface(size_t count, uint64_t seed, double noise = 0)
{
    mp2p_icp::SeededRandom random(seed);
    auto points = mrpt::maps::CSimplePointsMap::Create();
    for (size_t i = 0; i < count; i++)
    {
        const double u = random.uniform(0, 1), v = random.uniform(0, 0.8);
        const double z = 0.2 * std::sin(5 * u) * std::cos(4 * v + u) + noise * random.gaussian();
        points->insertPoint(static_cast<float>(u), static_cast<float>(v), static_cast<float>(z));
    }
    return points;
}

inline mp2p_icp::metric_map_t map_of(const mrpt::maps::CPointsMap::Ptr& points)
{
    mp2p_icp::metric_map_t map;
    map.layers[mp2p_icp::metric_map_t::PT_LAYER_RAW] = points;
    return map;
}

/// The cloud as seen from a sensor at `pose`.
inline mrpt::maps::CSimplePointsMap::Ptr seen_from(const CPose3D& pose,
                                                   const mrpt::maps::CSimplePointsMap& points)
{
    auto moved = mrpt::maps::CSimplePointsMap::Create(points);
    moved->changeCoordinatesReference(-pose);
    return moved;
}

inline CPose3D pose_deg(double x, double y, double z, double yaw, double pitch, double roll)
{
    return CPose3D(x, y, z, mrpt::DEG2RAD(yaw), mrpt::DEG2RAD(pitch), mrpt::DEG2RAD(roll));
}

inline double translation_error(const CPose3D& a, const CPose3D& b)
{
    return (mp2p_icp::translation_of(a) - mp2p_icp::translation_of(b)).norm();
}
inline double rotation_error(const CPose3D& a, const CPose3D& b)
{
    return mp2p_icp::rotation_angle(mp2p_icp::rotation_of(a - b));
}

/// Are all numbers of the two poses the same to the bit?
inline bool same_bits(const CPose3D& a, const CPose3D& b)
{
    const auto A = a.getHomogeneousMatrixVal<mrpt::math::CMatrixDouble44>(),
               B = b.getHomogeneousMatrixVal<mrpt::math::CMatrixDouble44>();
    for (int r = 0; r < 4; r++)
        for (int c = 0; c < 4; c++)
            if (std::memcmp(&A(r, c), &B(r, c), sizeof(double)) != 0) return false;
    return true;
}

/// A solver that does what a test says.
class ScriptedSolver : public mp2p_icp::Solver_Horn
{
 public:
    using Script = std::function<bool(const mp2p_icp::Pairings&, mp2p_icp::OptimalTF_Result&,
                                      const mp2p_icp::SolverContext&)>;
    Script script;

 protected:
    bool impl_optimal_pose(const mp2p_icp::Pairings& pairings, mp2p_icp::OptimalTF_Result& out,
                           const mp2p_icp::SolverContext& context) const override
    {
        return script ? script(pairings, out, context)
                      : Solver_Horn::impl_optimal_pose(pairings, out, context);
    }
};

/// Horn's solver on all pairs closer than a distance, and strict convergence.
struct Bench
{
    mp2p_icp::ICP icp;
    mp2p_icp::Parameters parameters;
    std::shared_ptr<mp2p_icp::Matcher_Points_DistanceThreshold> matcher;
    std::shared_ptr<ScriptedSolver> solver = std::make_shared<ScriptedSolver>();

    explicit Bench(double threshold = 0.3)
        : matcher(std::make_shared<mp2p_icp::Matcher_Points_DistanceThreshold>(threshold))
    {
        matcher->allowMatchAlreadyMatchedGlobalPoints_ = true;
        icp.matchers().push_back(matcher);
        icp.solvers().push_back(solver);
        parameters.maxIterations = 200;
        parameters.minAbsStep_trans = 1e-9;
        parameters.minAbsStep_rot = 1e-9;
    }

    mp2p_icp::Results align(const mp2p_icp::metric_map_t& local, const mp2p_icp::metric_map_t& global,
                            const CPose3D& guess = CPose3D()) const
    {
        mp2p_icp::Results result;
        icp.align(local, global, guess.asTPose(), parameters, result);
        return result;
    }
};

}  // namespace mp2p_icp_test
