#pragma once

#include <mp2p_icp/se3.h>

#include <optional>

#include "peers.h"

namespace compare_peers
{
struct Measurement
{
    double prepare_ms = 0, align_ms = 0;
    double peak_mb = 0;  ///< above what the process held with the inputs loaded
    int iterations = 0;
    double T_global_local[16] = {};  ///< by columns

    double total_ms() const { return prepare_ms + align_ms; }
    mrpt::poses::CPose3D mrpt_pose() const
    {
        const Eigen::Map<const Eigen::Matrix4d> T(T_global_local);
        return mp2p_icp::make_pose(T.topLeftCorner<3, 3>(), T.topRightCorner<3, 1>());
    }
};

struct Clouds
{
    Points local, global;
};

/** Runs a method in a child process, so that all methods start alike, and memory is its own. `load` is called
 * in the child, too: this process must not have started threads. \return nothing if the child did not end
 * well.
 */
std::optional<Measurement> measured_run(const Method& method, const std::function<Clouds()>& load,
                                        const Task& task, int threads);

}  // namespace compare_peers
