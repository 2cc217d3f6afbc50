#pragma once

#include <string>
#include <vector>

#include "peers.h"

namespace compare_peers
{
/// A pair of clouds from files.
struct FilePair
{
    std::string local, global;
    std::string truth;  ///< 4x4 pose of the local one in the global one; may be empty
};

/** Prints for each voxel size a table of times, iterations, errors and memory: medians over interleaved
 * rounds, in each of which every method runs once at every voxel size with one and with two threads.
 */
void compare_on_files(const FilePair& files, const std::vector<Method>& methods,
                      const std::vector<double>& voxels, const Task& task, int rounds);

/** Ray-traced pairs of LiDAR scans (64 rings, 2 cm of noise, 0.5 to 2 m and 1 to 10 degrees apart), whose
 * truth is exact. Prints for each voxel size the errors of all methods, and the difference of ours to each
 * peer's, pair by pair, with its 95 % interval.
 */
void compare_on_synthetic(uint64_t pairs, uint64_t seed, const std::vector<Method>& methods,
                          const std::vector<double>& voxels, const Task& task);

/// 0: as the points are.
std::string voxel_name(double voxel);
double median(std::vector<double> values);
}  // namespace compare_peers
