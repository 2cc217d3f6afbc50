// Aligns a cloud with a moved copy of itself through the installed library; fails unless the known pose comes
// out.
#include <mp2p_icp/ICP.h>

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
    // The clouds are exact copies but for the rounding of float coordinates.
    return result.trusted() && (result.optimal_tf.mean - truth).norm() < 1e-5 ? 0 : 1;
}
