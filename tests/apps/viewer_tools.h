#pragma once

#include "icp_log_viewer.h"
#include "run_tools.h"

namespace mp2p_icp_test
{
inline Outcome view(const std::vector<std::string>& arguments)
{
    std::ostringstream out, err;
    const int code = mp2p_icp_apps::icp_log_viewer(arguments, out, err);
    return {code, out.str(), err.str()};
}

/// A real run of 0.2 m and 2 degrees, from a guess so far off, logged with all iterations as NAME.icplog.
inline std::string logged_run(const Folder& folder, const std::string& name,
                              const std::string& guess = "[0 0 0 0 0 0]")
{
    const auto global = points_of_room(600);
    const auto g = folder.cloud("g.ply", global),
               l = folder.cloud("l.ply", seen_from(global, pose_deg(0.2, 0.1, 0, 2, 0, 0)));
    const std::string log = folder.path(name + ".icplog");
    std::string pipeline = EXACT_PIPELINE;
    pipeline.replace(pipeline.find("params:\n"), 8,
                     "params:\n  generateDebugFiles: true\n  saveIterationDetails: true\n"
                     "  decimationIterationDetails: 1\n  debugFileNameFormat: '" +
                         log + "'\n");
    run({"--input-local", l, "--input-global", g, "--guess", guess, "-c",
         folder.text(name + ".yaml", pipeline)});
    EXPECT_TRUE(std::filesystem::exists(log));
    return log;
}
}  // namespace mp2p_icp_test
