#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace mp2p_icp_certify
{
enum class PairingKind : int
{
    pt2pt,
    pt2ln,
    pt2pl,
    ln2ln,
    pl2pl
};
constexpr size_t NUMBER_OF_KINDS = 5;
constexpr std::array<const char*, NUMBER_OF_KINDS> KIND_NAMES = {"pt2pt", "pt2ln", "pt2pl", "ln2ln", "pl2pl"};

/// One pairing, as it was written. Directions have any length but zero.
struct Pairing
{
    PairingKind kind = PairingKind::pt2pt;
    bool oriented = false;                ///< ln2ln, pl2pl: a direction has a side
    double weight = 0;                    ///< of the position's squared residual
    double direction_weight = 0;          ///< ln2ln, pl2pl
    Eigen::Vector3d global, local;        ///< a point of each primitive
    Eigen::Vector3d global_dir{0, 0, 0};  ///< of a line, or a plane's normal: all but pt2pt
    Eigen::Vector3d local_dir{0, 0, 0};   ///< ln2ln, pl2pl
};

/** Reads one pairing a line; docs/formats.md has their form.
 * \param file_name, first_line for messages: where `text` stands; lines count from 1
 * \exception mp2p_icp::DataError names the file, the line, what was expected and what was found.
 */
std::vector<Pairing> pairings_from_lines(std::string_view text, const std::string& file_name,
                                         size_t first_line);

}  // namespace mp2p_icp_certify
