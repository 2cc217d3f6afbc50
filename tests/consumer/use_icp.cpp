// Aligns a cloud with a moved copy of itself through the installed library; fails unless the known pose comes
// out.
#include <mp2p_icp/ICP.h>

#include <algorithm>
#include <cmath>
#include <iostream>

int main()
{
    mrpt::maps::CSimplePointsMap global, local;
    for (int i = 0; i < 2000; i++)  // a wavy surface without symmetries
    {
        const float u = 0.02f * static_cast<float>(i % 50), v = 0.02f * static_cast<float>(i / 50);
        global.insertPoint(u, v, 0.2f * std::sin(5 * u) * std::cos(4 * v + u));
    }
    const mrpt::poses::CPose3D truth(0.02, -0.01, 0.03, 0.05, -0.04, 0.03);
    local.insertAnotherMap(&global, -truth);

    const mp2p_icp::Results result = mp2p_icp::align(local, global);
    result.print(std::cout);
    // The start is off by 0.037 m and 4 degrees; coordinates are good to 1e-7 m, and the last step is as
    // small.
    const mrpt::poses::CPose3D error = result.optimal_tf.mean - truth;
    mrpt::math::CQuaternionDouble q;
    error.getAsQuaternion(q);
    const double angle = 2 * std::acos(std::min(1.0, std::abs(q.r())));
    return result.trusted() && error.norm() < 1e-5 && angle < 1e-5 ? 0 : 1;
}
