#include "plane_footprint.h"

#include <algorithm>
#include <cmath>

namespace mp2p_icp_filters
{
using Eigen::Vector3d;

std::pair<Vector3d, Vector3d> axes_across(const Vector3d& normal)
{
    int least = 0;
    normal.cwiseAbs().minCoeff(&least);
    const Vector3d u = Vector3d::Unit(least).cross(normal).normalized();
    return {u, normal.cross(u)};
}

namespace
{
constexpr double BESIDE_SIGMAS = 5;    // points from here on are beside it
constexpr double SHARE_BESIDE = 0.02;  // of a square's points: what noise alone puts beside a plane, and more
constexpr double MEAN_SIGMAS = 3.0;    // how far noise alone may move the mean height of a square
constexpr double UNEVENNESS = 0.25;    // and how far a surface may be from flat, over its noise

/// Squares of one side in a plane, and how many points each one has in and beside the plane.
class SquareCounts
{
 public:
    explicit SquareCounts(double pitch) : pitch_(pitch) {}

    CellIndex index_of(double u, double v) const
    {
        return {static_cast<int64_t>(std::floor(u / pitch_)), static_cast<int64_t>(std::floor(v / pitch_)),
                0};
    }
    uint32_t count(double u, double v, double height, bool in)
    {
        const uint32_t square = numbers_.number_of(index_of(u, v));
        if (square >= in_.size())
            in_.resize(square + 1, 0), beside_.resize(square + 1, 0), heights_.resize(square + 1, 0);
        (in ? in_ : beside_)[square]++;
        if (in) heights_[square] += height;
        return square;
    }
    const VoxelCells& numbers() const { return numbers_; }
    bool is_surface(uint32_t square) const { return in_[square] >= 1 && in_[square] >= beside_[square]; }
    /// Is there nothing beside the plane?
    bool is_alone(uint32_t square) const { return beside_[square] <= SHARE_BESIDE * in_[square]; }
    /// Is what is in the plane, on average, not above or below?
    bool is_level(uint32_t square, double sigma) const
    {
        if (in_[square] == 0) return true;
        const double count = in_[square], mean = heights_[square] / count;
        return std::abs(mean) <= sigma * (MEAN_SIGMAS / std::sqrt(count) + UNEVENNESS);
    }

 private:
    double pitch_;
    VoxelCells numbers_;
    std::vector<uint32_t> in_, beside_;
    std::vector<double> heights_;  // sum of those in the plane
};

class FootprintSearch
{
 public:
    FootprintSearch(const BlockedPoints& all, const FootprintQuery& query)
        : all_(all), query_(query), connecting_(query.pitch), clearing_(query.clear_pitch)
    {
        std::tie(u_, v_) = axes_across(query.normal);
        for (const auto& block : all.blocks)
        {
            const double reach =
                query.normal.cwiseAbs().dot(block.half) + BESIDE_SIGMAS * query.sigma + query.clearance;
            if (!(std::abs(height(block.centre)) <= reach)) continue;
            for (uint32_t i = block.first; i < block.last; i++)
                if (!(*query.taken)[i]) count(i);
        }
    }

    Footprint from(const std::vector<uint32_t>& starts)
    {
        flood(starts);
        std::vector<Around> around(clearing_.numbers().size());
        Footprint out;
        for (const auto& point : near_)
        {
            if (mark_[point.connecting] == NOT_REACHED) continue;
            out.claimed.push_back(point.id);
            if (mark_[point.connecting] != REACHED) continue;
            out.inside++;
            const uint32_t square = point.clearing;
            if (clearing_.is_alone(square) && !clearing_.is_level(square, query_.sigma)) out.uneven++;
            if (!around[square].known) around[square] = look_around(square);
            if (!around[square].alone) continue;
            out.surface.push_back(point.id);
            if (!around[square].level) continue;
            out.clear.push_back(point.id);
            out.clear_square.push_back(square);
        }
        return out;
    }

 private:
    enum Mark : uint8_t
    {
        NOT_REACHED,
        BORDER,
        REACHED
    };
    /// What is known of a square and those around it.
    struct Around
    {
        bool known = false, alone = false, level = false;
    };
    struct NearPoint
    {
        uint32_t id, connecting, clearing;  // itself, its squares
    };

    double height(const Vector3d& p) const { return query_.normal.dot(p - query_.centre); }

    void count(uint32_t i)
    {
        const double h = height(all_.points[i]), distance = std::abs(h);
        const bool in = distance <= NEAR_SIGMAS * query_.sigma;
        const bool beside = distance >= BESIDE_SIGMAS * query_.sigma &&
                            distance <= BESIDE_SIGMAS * query_.sigma + query_.clearance;
        if (!in && !beside) return;
        const Vector3d d = all_.points[i] - query_.centre;
        const double u = u_.dot(d), v = v_.dot(d);
        const uint32_t connecting = connecting_.count(u, v, h, in), clearing = clearing_.count(u, v, h, in);
        if (in) near_.push_back({i, connecting, clearing});
    }

    /// Is the square, and each one that touches it, free of what stands beside the plane, and level?
    Around look_around(uint32_t square) const
    {
        const CellIndex c = clearing_.numbers().cell(square);
        Around out{true, true, true};
        for (int64_t du = -1; du <= 1; du++)
            for (int64_t dv = -1; dv <= 1; dv++)
            {
                const uint32_t near = clearing_.numbers().find({c.x + du, c.y + dv, 0});
                if (near == NO_CELL) continue;
                out.alone = out.alone && clearing_.is_alone(near);
                out.level = out.level && clearing_.is_level(near, query_.sigma);
            }
        return out;
    }

    /// Marks all squares that hang together with the points.
    void flood(const std::vector<uint32_t>& starts)
    {
        mark_.assign(connecting_.numbers().size(), NOT_REACHED);
        const VoxelCells& squares = connecting_.numbers();
        std::vector<uint32_t> pending;
        const auto reach = [&](uint32_t square)
        {
            if (square == NO_CELL || mark_[square] == REACHED || !connecting_.is_surface(square)) return;
            mark_[square] = REACHED;
            pending.push_back(square);
        };
        for (const uint32_t i : starts)
        {
            const Vector3d d = all_.points[i] - query_.centre;
            if (std::abs(height(all_.points[i])) <= NEAR_SIGMAS * query_.sigma)
                reach(squares.find(connecting_.index_of(u_.dot(d), v_.dot(d))));
        }
        while (!pending.empty())
        {
            const CellIndex c = squares.cell(pending.back());
            pending.pop_back();
            for (int64_t du = -2; du <= 2; du++)
                for (int64_t dv = -2; dv <= 2; dv++)
                {
                    const uint32_t square = squares.find({c.x + du, c.y + dv, 0});
                    reach(square);
                    const bool touches = std::abs(du) <= 1 && std::abs(dv) <= 1;
                    if (square != NO_CELL && touches && mark_[square] == NOT_REACHED) mark_[square] = BORDER;
                }
        }
    }

    const BlockedPoints& all_;
    const FootprintQuery& query_;
    Vector3d u_, v_;
    SquareCounts connecting_, clearing_;
    std::vector<NearPoint> near_;
    std::vector<Mark> mark_;
};
}  // namespace

Footprint footprint(const BlockedPoints& all, const FootprintQuery& query,
                    const std::vector<uint32_t>& starts)
{
    return FootprintSearch(all, query).from(starts);
}

}  // namespace mp2p_icp_filters
