#pragma once

#include <mp2p_icp/Pairings.h>

#include <array>
#include <vector>

#include "compact_layers.h"

/** \file compact_surfaces.h
 * Pairs of a local point with a global plane or line. In a run all local points are of one layer: u8 that
 * layer, u64 number of pairs, and the pairs as a string. A pair is: the difference of the point's index in
 * its layer to that of the pair before, or the coordinates (3 doubles) of a point of no layer; the difference
 * of the number of its plane (line) to one more than that of the pair before. Planes of a log are numbered as
 * they come; the numbers of one that comes for the first time (7 doubles, of a line 6) follow at once.
 */
namespace mp2p_icp
{
/// The numbers of a plane.
struct CompactPlane
{
    using Pair = point_plane_pair_t;
    using Values = std::array<double, 7>;
    static Values of(const Pair& pair);
    static Pair pair(const Values& v, const mrpt::math::TPoint3D& local);
};
/// Of a line.
struct CompactLine
{
    using Pair = point_line_pair_t;
    using Values = std::array<double, 6>;
    static Values of(const Pair& pair);
    static Pair pair(const Values& v, const mrpt::math::TPoint3D& local);
};

/// Writes the lists of one kind of a log, one after the other.
template <class Kind>
class CompactSurfaceWriter
{
 public:
    explicit CompactSurfaceWriter(const CompactLayers& local) : local_(local), starts_(local.size() + 1) {}
    void write(mrpt::serialization::CArchive& out, const std::vector<typename Kind::Pair>& pairs);

 private:
    using Values = typename Kind::Values;
    struct Point
    {
        uint8_t layer = 0;
        uint32_t index = 0;
    };
    Point find(const mrpt::math::TPoint3D& p, uint8_t layer_before);
    bool find_in(uint8_t layer, const mrpt::math::TPoint3D& p, Point& found);
    void append_surface(const Values& values, uint32_t before, std::string& bytes, uint32_t& number);
    uint32_t& slot_of(const Values& values);
    void grow();

    const CompactLayers& local_;
    std::vector<uint32_t> starts_;  ///< by layer: where to look for the next point
    size_t steps_left_ = 0;         ///< that looking for points may still take
    std::vector<Values> known_;
    std::vector<uint32_t> slots_ = std::vector<uint32_t>(64);  ///< number + 1, by hash; 0: free
};

/// Reads what it wrote. \exception std::runtime_error for bytes that nobody has written.
template <class Kind>
class CompactSurfaceReader
{
 public:
    explicit CompactSurfaceReader(const CompactLayers& local) : local_(local) {}
    void read(mrpt::serialization::CArchive& in, std::vector<typename Kind::Pair>& pairs);

 private:
    typename Kind::Pair take_pair(std::string_view& bytes, uint8_t layer);

    const CompactLayers& local_;
    uint32_t index_ = 0, next_ = 0;  ///< of the pair before, and the number after that of its surface
    std::vector<typename Kind::Values> known_;
};

}  // namespace mp2p_icp
