#include "stored_run.h"

#include <memory>

namespace mp2p_icp
{
namespace
{
metric_map_t::ConstPtr or_empty(const metric_map_t::ConstPtr& map)
{
    return map ? map : std::make_shared<metric_map_t>();
}
}  // namespace

StoredRun::StoredRun(const LogRecord& log)
    : global(or_empty(log.pcGlobal)),
      local(or_empty(log.pcLocal)),
      offsets(*local, *global),
      guess(offsets.to_stored(mrpt::poses::CPose3D(log.initialGuessLocalWrtGlobal))),
      end(offsets.to_stored(log.icpResult.rejected_pose.value_or(log.icpResult.optimal_tf.mean)))
{
}

}  // namespace mp2p_icp
