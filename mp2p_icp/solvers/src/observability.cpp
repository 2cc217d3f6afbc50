#include <mp2p_icp/observability.h>
#include <mp2p_icp/parallel.h>
#include <mp2p_icp/se3.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "euler_rates.h"

namespace mp2p_icp
{
namespace
{
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Eigen::Matrix3d;
using Eigen::Vector3d;
constexpr double INF = std::numeric_limits<double>::infinity();

/** One residual C (p - q) with C a projection: p a local point as seen from the global frame, q where it
 * should be; or, for directions (`is_direction`), p the rotated local direction.
 */
struct Residual
{
    Vector3d p = Vector3d::Zero(), q = Vector3d::Zero();
    Matrix3d C = Matrix3d::Identity();
    int rows = 3;
    double weight = 1;
    bool is_direction = false;

    bool finite() const { return p.allFinite() && q.allFinite() && C.allFinite() && std::isfinite(weight); }
    Vector3d value() const { return C * (p - q); }
};

Matrix3d across(const Vector3d& u)
{
    return Matrix3d::Identity() - u * u.transpose();
}
Vector3d normal_of(const plane_patch_t& p)
{
    return Vector3d(p.plane.coefs[0], p.plane.coefs[1], p.plane.coefs[2]).normalized();
}
Vector3d direction_of(const mrpt::math::TLine3D& l)
{
    return to_eigen(l.director).normalized();
}

/// All pairings as residuals, in the order of their lists.
std::vector<Residual> residuals_of(const Pairings& in, const mrpt::poses::CPose3D& pose)
{
    const Matrix3d R = rotation_of(pose);
    const Vector3d t = translation_of(pose);
    std::vector<Residual> all;
    all.reserve(in.size() + in.paired_ln2ln.size() + in.paired_pl2pl.size());
    const auto weights = in.expanded_point_weights();
    for (size_t i = 0; i < in.paired_pt2pt.size(); i++)
        all.push_back({R * to_eigen(in.paired_pt2pt[i].local) + t, to_eigen(in.paired_pt2pt[i].global),
                       Matrix3d::Identity(), 3, weights[i], false});
    for (const auto& p : in.paired_pt2ln)
        all.push_back({R * to_eigen(p.pt_local) + t, to_eigen(p.ln_global.pBase),
                       across(direction_of(p.ln_global)), 2, 1, false});
    const auto on_plane = [&](const mrpt::math::TPoint3D& local, const plane_patch_t& global)
    {
        const Vector3d n = normal_of(global);
        return Residual{R * to_eigen(local) + t, to_eigen(global.centroid), n * n.transpose(), 1, 1, false};
    };
    for (const auto& p : in.paired_pt2pl) all.push_back(on_plane(p.pt_local, p.pl_global));
    // Directions: seen from the global one, signs are free.
    const auto along = [&](const Vector3d& global, const Vector3d& local)
    {
        const Vector3d rotated = R * local;
        return Residual{
            rotated.dot(global) < 0 ? Vector3d(-rotated) : rotated, global, across(global), 2, 1, true};
    };
    const auto add_both = [&all](const Residual& position, const Residual& direction)
    {
        if (position.finite() && direction.finite()) all.insert(all.end(), {position, direction});
    };
    for (const auto& p : in.paired_ln2ln)
    {
        const Vector3d u = direction_of(p.ln_global);
        add_both({R * to_eigen(p.ln_local.pBase) + t, to_eigen(p.ln_global.pBase), across(u), 2, 1, false},
                 along(u, direction_of(p.ln_local)));
    }
    for (const auto& p : in.paired_pl2pl)
        add_both(on_plane(p.p_local.centroid, p.p_global),
                 along(normal_of(p.p_global), normal_of(p.p_local)));
    all.erase(std::remove_if(all.begin(), all.end(),
                             [](const Residual& r) { return !r.finite() || !(r.weight > 0); }),
              all.end());
    return all;
}

struct Spread
{
    Vector3d mean = Vector3d::Zero();
    double L = 1;         ///< rms distance from the mean, m; 1 if that is not resolved
    double largest = 0;   ///< largest |coordinate|
    double rounding = 0;  ///< of coordinates, m
};

/// Rounding of coordinates to float, as a standard deviation: one unit in the last place / sqrt(12).
double float_rounding(double largest)
{
    return largest * 0x1p-23 / std::sqrt(12.0);
}

Spread spread_of(const std::vector<Residual>& all, const std::optional<double>& coordinate_rounding)
{
    Spread s;
    double n = 0, squares = 0;
    for (const auto& r : all)
        if (!r.is_direction)
            s.mean += r.p, n += 1,
                s.largest = std::max({s.largest, r.p.cwiseAbs().maxCoeff(), r.q.cwiseAbs().maxCoeff()});
    if (n == 0) return s;
    s.mean /= n;
    for (const auto& r : all)
        if (!r.is_direction) squares += (r.p - s.mean).squaredNorm();
    s.rounding = coordinate_rounding.value_or(float_rounding(s.largest));
    const double rms = std::sqrt(squares / n), resolved = std::max(10 * s.rounding, 1e-12 * s.largest);
    if (n >= 2 && rms > resolved) s.L = rms;
    return s;
}

struct Normal
{
    Matrix6 H = Matrix6::Zero();  ///< in (v, omega L): rotation about spread.mean, scaled to metres
    double squares = 0, position_squares = 0;
    size_t rows = 0, positions = 0;
    Normal& operator+=(const Normal& o)
    {
        H += o.H, squares += o.squares, position_squares += o.position_squares, rows += o.rows,
            positions += o.positions;
        return *this;
    }
};

Normal normal_matrix(const std::vector<Residual>& all, const Spread& s)
{
    return block_sum<Normal>(
        all.size(),
        [&](size_t from, size_t to)
        {
            Normal n;
            for (size_t i = from; i < to; i++)
            {
                const Residual& r = all[i];
                Eigen::Matrix<double, 3, 6> J;
                if (r.is_direction)  // d(R u) = -[R u]x omega; L per rad, and omega is in units of 1/L
                    J << Matrix3d::Zero(), -skew(r.p);
                else
                    J << Matrix3d::Identity(), -skew(r.p - s.mean) / s.L;
                n.H += r.weight * J.transpose() * r.C * J;
                const double square = r.weight * r.value().squaredNorm() * (r.is_direction ? s.L * s.L : 1.0);
                n.squares += square, n.rows += static_cast<size_t>(r.rows);
                if (!r.is_direction) n.position_squares += r.value().squaredNorm(), n.positions++;
            }
            return n;
        });
}

/// What a motion's information must exceed, relative to the largest, to be more than rounding: of the sums,
/// and, where it rotates, of the coordinates.
double relative_limit(const Vector6& direction, const Spread& s)
{
    return std::max(1e-10, std::pow(10 * s.rounding / s.L * direction.tail<3>().norm(), 2));
}

/** An orthonormal basis of the null space whose vectors lie along coordinate axes where that is possible, so
 * that a free x and a free yaw are told as such and not as two mixtures.
 */
std::vector<Vector6> readable_basis(Matrix6 projector, int dimension)
{
    std::vector<Vector6> basis;
    for (int k = 0; k < dimension; k++)
    {
        int best = 0;
        for (int i = 1; i < 6; i++)
            if (projector(i, i) > projector(best, best) + 1e-9) best = i;
        const Vector6 v = projector.col(best).normalized();
        basis.push_back(v);
        projector -= v * (v.transpose() * projector).eval();
        projector = (0.5 * (projector + projector.transpose())).eval();
    }
    return basis;
}

/// A readable basis of the free motions (orthonormal columns): the pure translations among them first, then
/// what rotates.
std::vector<Vector6> readable_motions(const Eigen::Matrix<double, 6, Eigen::Dynamic>& free)
{
    if (free.cols() == 0) return {};
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(free.bottomRows<3>(), Eigen::ComputeFullV);
    const auto rotations = (svd.singularValues().array() > 1e-3).count();
    const auto projector = [](const auto& columns) { return Matrix6(columns * columns.transpose()); };
    const Eigen::MatrixXd rotating = free * svd.matrixV().leftCols(rotations);
    const Eigen::MatrixXd sliding = free * svd.matrixV().rightCols(free.cols() - rotations);
    auto basis = readable_basis(projector(sliding), static_cast<int>(sliding.cols()));
    const auto rest = readable_basis(projector(rotating), static_cast<int>(rotating.cols()));
    basis.insert(basis.end(), rest.begin(), rest.end());
    return basis;
}

std::string axis_name(const Vector3d& axis, const char* const names[3])
{
    for (int i = 0; i < 3; i++)
        if (std::abs(axis(i)) > std::cos(5.0 * M_PI / 180.0)) return names[i];
    return "";
}

FreeTwist as_twist(const Vector6& direction, double deviation, const Spread& s)
{
    static const char* const translations[3] = {"x", "y", "z"};
    static const char* const rotations[3] = {"roll", "pitch", "yaw"};
    const Vector3d v = direction.head<3>(), omega = direction.tail<3>() / s.L;
    FreeTwist out;
    if (direction.tail<3>().norm() < 1e-3)
    {
        const Vector3d axis = v.normalized();
        out.axis = to_mrpt(axis), out.sigma = deviation, out.name = axis_name(axis, translations);
        return out;
    }
    const Vector3d axis = omega.normalized();
    const double pitch = axis.dot(v) / omega.norm();  // metres of advance per rad
    out.kind = std::abs(pitch) < 1e-3 * s.L ? FreeTwist::Kind::Rotation : FreeTwist::Kind::Screw;
    out.axis = to_mrpt(axis);
    out.through = to_mrpt(s.mean + omega.cross(v) / omega.squaredNorm());
    out.sigma = deviation * omega.norm();
    out.name = out.kind == FreeTwist::Kind::Rotation ? axis_name(axis, rotations) : "";
    return out;
}

/// d(v, omega L) / d(x y z yaw pitch roll) at the pose, v being the motion of the mean point.
Matrix6 twist_from_coordinates(const mrpt::poses::CPose3D& pose, const Spread& s)
{
    const Matrix3d E = euler_rates(pose);
    Matrix6 M = Matrix6::Zero();
    M.topLeftCorner<3, 3>().setIdentity();
    M.topRightCorner<3, 3>() = -skew(s.mean - translation_of(pose)) * E;
    M.bottomRightCorner<3, 3>() = s.L * E;
    return M;
}

/// Its inverse; where the angles are singular, the least change of them that makes the rotation.
Matrix6 coordinates_from_twist_at(const mrpt::poses::CPose3D& pose, const Spread& s)
{
    Matrix6 M = Matrix6::Zero();
    M.topLeftCorner<3, 3>().setIdentity();
    M.topRightCorner<3, 3>() = skew(s.mean - translation_of(pose)) / s.L;
    M.bottomRightCorner<3, 3>() = euler_rates(pose).completeOrthogonalDecomposition().pseudoInverse() / s.L;
    return M;
}

void set(mrpt::math::CMatrixDouble66& to, const Matrix6& from)
{
    for (int r = 0; r < 6; r++)
        for (int c = 0; c < 6; c++) to(r, c) = from(r, c);
}

/// Infinite on the diagonal, and zero beside it, for coordinates with a part along a free motion.
void set_infinite(Matrix6& covariance, const Matrix6& coordinates_from_twist,
                  const std::vector<Vector6>& free)
{
    for (const auto& direction : free)
    {
        Vector6 c = coordinates_from_twist * direction;
        for (int i = 0; i < 6; i++)
        {
            const double scale = coordinates_from_twist.row(i).norm();
            if (std::abs(c(i)) <= 1e-6 * scale && scale < 1e12) continue;
            covariance.row(i).setZero(), covariance.col(i).setZero();
            covariance(i, i) = INF;
        }
    }
}
}  // namespace

std::string to_string(FreeTwist::Kind kind)
{
    return kind == FreeTwist::Kind::Translation ? "translation"
           : kind == FreeTwist::Kind::Rotation  ? "rotation"
                                                : "screw";
}

Observability observability(const Pairings& pairings, const mrpt::poses::CPose3D& pose,
                            const std::optional<double>& given_sigma,
                            const std::optional<double>& coordinate_rounding)
{
    const auto all = residuals_of(pairings, pose);
    const Spread s = spread_of(all, coordinate_rounding);
    const Normal n = normal_matrix(all, s);
    Observability out;
    out.residual_rms = n.positions ? std::sqrt(n.position_squares / static_cast<double>(n.positions)) : 0.0;

    const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(n.H);
    const Vector6 values = eigen.eigenvalues().cwiseMax(0.0);
    const auto determined = [&](int i)
    { return values(i) > relative_limit(eigen.eigenvectors().col(i), s) * values(5) && values(i) > 0; };
    for (int i = 0; i < 6; i++) out.rank += determined(i) ? 1 : 0;

    const bool estimable = n.rows > static_cast<size_t>(out.rank);
    const double estimate =
        estimable ? std::sqrt(n.squares / static_cast<double>(n.rows - static_cast<size_t>(out.rank))) : INF;
    out.sigma = given_sigma.value_or(std::max(estimate, s.rounding));

    // A rotation that noise leaves uncertain by more than half a radian is not determined either.
    const auto deviation = [&](int i) { return values(i) > 0 ? out.sigma / std::sqrt(values(i)) : INF; };
    const auto is_free = [&](int i)
    {
        const double omega = eigen.eigenvectors().col(i).tail<3>().norm() / s.L;
        return !determined(i) ||
               (omega > 1e-3 / s.L && std::isfinite(out.sigma) && deviation(i) * omega > 0.5);
    };
    Eigen::Matrix<double, 6, Eigen::Dynamic> free(6, 0);
    Matrix6 twist_covariance = Matrix6::Zero();
    out.rank = 0;
    for (int i = 0; i < 6; i++)
    {
        const Vector6 u = eigen.eigenvectors().col(i);
        if (is_free(i))
            free.conservativeResize(Eigen::NoChange, free.cols() + 1), free.rightCols<1>() = u;
        else
            out.rank++,
                twist_covariance +=
                u * u.transpose() * (std::isfinite(out.sigma) ? out.sigma * out.sigma / values(i) : 0.0);
    }
    const auto basis = readable_motions(free);
    for (const auto& direction : basis)
    {
        const double information = direction.dot(n.H * direction);
        out.free.push_back(as_twist(
            direction,
            information > relative_limit(direction, s) * values(5) ? out.sigma / std::sqrt(information) : INF,
            s));
    }

    const Matrix6 M = twist_from_coordinates(pose, s);
    const Matrix6 coordinates_from_twist = coordinates_from_twist_at(pose, s);
    const bool angles_singular = std::abs(std::cos(pose.pitch())) < 1e-6;
    Matrix6 covariance = coordinates_from_twist * twist_covariance * coordinates_from_twist.transpose();
    covariance =
        (0.5 * (covariance + covariance.transpose())).eval();  // rounding aside it is symmetric: exactly so
    set_infinite(covariance, coordinates_from_twist, basis);
    for (int i = 0; i < 6; i++)
        if (!std::isfinite(out.sigma) || (angles_singular && (i == 3 || i == 5)))
            covariance.row(i).setZero(), covariance.col(i).setZero(), covariance(i, i) = INF;
    set(out.covariance, covariance);
    set(out.information, std::isfinite(out.sigma) && out.sigma > 0
                             ? Matrix6(M.transpose() * n.H * M / (out.sigma * out.sigma))
                             : Matrix6(Matrix6::Zero()));
    return out;
}

mrpt::math::CMatrixDouble66 covariance(const Pairings& pairings, const mrpt::poses::CPose3D& pose)
{
    return observability(pairings, pose).covariance;
}

}  // namespace mp2p_icp
