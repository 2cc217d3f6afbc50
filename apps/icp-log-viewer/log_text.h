#pragma once

#include <mp2p_icp/log_moments.h>

#include <string>
#include <vector>

namespace mp2p_icp_apps
{
/** \file log_text.h
 * What the window says of a log, as short lines.
 */
using TextLines = std::vector<std::string>;

/// Verdict, pose, change from the guess, standard deviations, condition numbers, free motions.
TextLines summary_lines(const mp2p_icp::LogRecord& log);
/// The variables that formulas saw; at most so many.
TextLines variable_lines(const mp2p_icp::LogRecord& log, size_t at_most = 100);
/// What was paired at a moment, by kind.
TextLines pairing_lines(const mp2p_icp::LogRecord& log, const mp2p_icp::LogMoment& moment);
/// `x y z` in metres, and yaw, pitch and roll in degrees, in two lines.
TextLines pose_lines(const mrpt::poses::CPose3D& pose);

}  // namespace mp2p_icp_apps
