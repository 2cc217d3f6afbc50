#include <mp2p_icp/se3.h>
#include <mp2p_icp_filters/intersect_planes.h>
#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "plane_footprint.h"

namespace mp2p_icp_filters
{
using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Matrix4d;
using Eigen::Vector3d;
using Matrix23 = Eigen::Matrix<double, 2, 3>;
using mp2p_icp::fitted_line_t;
using mp2p_icp::fitted_plane_t;
using mp2p_icp::line_fit_t;
using mp2p_icp::plane_fit_t;
using mp2p_icp::Range;
using mp2p_icp::to_eigen;
using mp2p_icp::to_mrpt;

void IntersectionParameters::declare_parameters(mp2p_icp::ParameterDeclaration& declare)
{
    declare.number("intersection_minimum_angle_deg", minimum_angle_deg, "deg", Range::between(1, 89),
                   "Planes that meet at a smaller angle (or one nearer to 180 degrees) make no line.");
    declare.number("intersection_touch_distance", touch_distance, "m", Range::positive(),
                   "How near to the line both planes must have points.");
    declare.number("intersection_minimum_length", minimum_length, "m", Range::not_negative(),
                   "Lines along which the planes touch on less than this are dropped.");
}

namespace
{
constexpr double PIECE = 0.25;  // m; the line is looked at in pieces of this length
constexpr double BLOCK = 2;     // m; of points that are skipped together

/// The line, based near both centroids; nothing if the planes are too nearly parallel.
std::optional<fitted_line_t> infinite_line(const fitted_plane_t& a, const fitted_plane_t& b,
                                           double minimum_angle)
{
    const Vector3d n_a = a.normal(), n_b = b.normal(), cross = n_a.cross(n_b);
    if (!(cross.norm() >= std::sin(minimum_angle))) return {};
    Vector3d director = cross.normalized();
    int largest = 0;
    director.cwiseAbs().maxCoeff(&largest);
    if (director(largest) < 0) director = -director;
    const Vector3d c_a = to_eigen(a.centroid), c_b = to_eigen(b.centroid);
    Matrix3d equations;
    equations << n_a.transpose(), n_b.transpose(), director.transpose();
    const Vector3d right(n_a.dot(c_a), n_b.dot(c_b), director.dot((c_a + c_b) / 2));
    fitted_line_t line;
    line.pBase = to_mrpt(Vector3d(equations.partialPivLu().solve(right)));
    line.director = to_mrpt(director);
    return line;
}

bool is_in(const fitted_plane_t& plane, const Vector3d& p)
{
    constexpr double MARGIN = 0.5;  // m, around the box
    const plane_fit_t& fit = *plane.fit;
    const Vector3d d = p - to_eigen(plane.centroid), n = plane.normal();
    const double u = fit.axis_u.dot(d), v = n.cross(fit.axis_u).dot(d);
    return std::abs(n.dot(d)) <= NEAR_SIGMAS * std::max(fit.sigma, 1e-6) && u >= fit.u_min - MARGIN &&
           u <= fit.u_max + MARGIN && v >= fit.v_min - MARGIN && v <= fit.v_max + MARGIN;
}

/// What was seen of a line.
struct Seen
{
    double begin = 0, end = 0;  ///< from the base point, m
    double length = 0;          ///< of the pieces in between that were seen, m
    size_t points = 0;
};

/// The pieces of the line where both planes have points.
class Touch
{
 public:
    Touch(const fitted_plane_t& a, const fitted_plane_t& b, const fitted_line_t& line, double distance)
        : a_(a), b_(b), base_(to_eigen(line.pBase)), director_(to_eigen(line.director)), distance_(distance)
    {
    }

    void look_at(const BlockedPoints& all)
    {
        for (const auto& block : all.blocks)
        {
            const Vector3d d = block.centre - base_;
            if ((d - director_ * director_.dot(d)).norm() > block.half.norm() + distance_) continue;
            for (uint32_t k = block.first; k < block.last; k++) look_at(all.points[k]);
        }
    }

    Seen seen() const
    {
        Seen out;
        for (const auto& [index, piece] : pieces_)
        {
            if (piece.a == 0 || piece.b == 0) continue;
            if (out.points == 0) out.begin = static_cast<double>(index) * PIECE;
            out.end = static_cast<double>(index + 1) * PIECE;
            out.length += PIECE;
            out.points += piece.a + piece.b;
        }
        return out;
    }

 private:
    struct Piece
    {
        size_t a = 0, b = 0;  // how many points lie in the one plane only
    };

    void look_at(const Vector3d& p)
    {
        const Vector3d d = p - base_;
        const double along = director_.dot(d);
        if (!((d - director_ * along).squaredNorm() <= distance_ * distance_)) return;
        const bool in_a = is_in(a_, p), in_b = is_in(b_, p);
        if (in_a == in_b) return;
        Piece& piece = pieces_[static_cast<int64_t>(std::floor(along / PIECE))];
        (in_a ? piece.a : piece.b)++;
    }

    const fitted_plane_t &a_, &b_;
    Vector3d base_, director_;
    double distance_;
    std::map<int64_t, Piece> pieces_;
};

/// Height of the true plane above the fitted one at `p`, and its slope along `direction`, by (a, b, h).
Matrix23 height_and_slope(const fitted_plane_t& plane, const Vector3d& p, const Vector3d& direction)
{
    const Vector3d d = p - to_eigen(plane.centroid), u = plane.fit->axis_u, v = plane.normal().cross(u);
    Matrix23 out;
    out << u.dot(d), v.dot(d), 1, u.dot(direction), v.dot(direction), 0;
    return out;
}

Matrix4d line_covariance(const fitted_plane_t& a, const fitted_plane_t& b, const Vector3d& base,
                         const Vector3d& director, const Vector3d& axis_a, const Vector3d& axis_b)
{
    const Vector3d n_a = a.normal(), n_b = b.normal();
    Matrix2d climbs;
    climbs << n_a.dot(axis_a), n_a.dot(axis_b), n_b.dot(axis_a), n_b.dot(axis_b);
    const Matrix2d solve = climbs.inverse();
    const Matrix23 of_a = height_and_slope(a, base, director), of_b = height_and_slope(b, base, director);
    Eigen::Matrix<double, 4, 3> by_a, by_b;
    for (int row = 0; row < 2; row++)  // displacement, turn
    {
        by_a.block<2, 3>(2 * row, 0) = solve.col(0) * of_a.row(row);
        by_b.block<2, 3>(2 * row, 0) = solve.col(1) * of_b.row(row);
    }
    const Matrix4d sum =
        by_a * a.fit->covariance * by_a.transpose() + by_b * b.fit->covariance * by_b.transpose();
    return (sum + sum.transpose()) / 2;  // to the bit, as files hold one half
}

/// Puts the base point into the middle of what was seen, and adds the fit.
void describe(const fitted_plane_t& a, const fitted_plane_t& b, const Seen& seen, fitted_line_t& line)
{
    const Vector3d director = to_eigen(line.director);
    const double middle = (seen.begin + seen.end) / 2;
    const Vector3d base = to_eigen(line.pBase) + middle * director;
    line.pBase = to_mrpt(base);
    line_fit_t& fit = line.fit.emplace();
    fit.begin = seen.begin - middle, fit.end = seen.end - middle;
    fit.inliers = seen.points, fit.sigma = (a.fit->sigma + b.fit->sigma) / 2;
    fit.axis_a = a.normal().cross(director);
    fit.covariance = line_covariance(a, b, base, director, fit.axis_a, director.cross(fit.axis_a));
}

void check(bool rule, const char* text)
{
    if (!rule) throw std::invalid_argument(std::string("intersect_planes: ") + text);
}
}  // namespace

std::vector<fitted_line_t> intersect_planes(const mrpt::maps::CPointsMap& cloud,
                                            const std::vector<fitted_plane_t>& planes,
                                            const IntersectionParameters& parameters)
{
    check(parameters.minimum_angle_deg >= 1 && parameters.minimum_angle_deg <= 89,
          "minimum_angle_deg must be in [1, 89]");
    check(parameters.touch_distance > 0, "touch_distance must be above zero");
    check(parameters.minimum_length >= 0, "minimum_length must not be negative");
    std::vector<fitted_line_t> out;
    const BlockedPoints all(cloud, BLOCK);
    const auto is_fit = [](const fitted_plane_t& p) { return p.fit && p.fit->is_sound(); };
    for (size_t i = 0; i < planes.size(); i++)
        for (size_t j = i + 1; j < planes.size(); j++)
        {
            if (!is_fit(planes[i]) || !is_fit(planes[j])) continue;
            auto line = infinite_line(planes[i], planes[j], mrpt::DEG2RAD(parameters.minimum_angle_deg));
            if (!line) continue;
            Touch touch(planes[i], planes[j], *line, parameters.touch_distance);
            touch.look_at(all);
            const Seen seen = touch.seen();
            if (seen.points == 0 || seen.length < parameters.minimum_length) continue;
            describe(planes[i], planes[j], seen, *line);
            out.push_back(*line);
        }
    return out;
}

}  // namespace mp2p_icp_filters
