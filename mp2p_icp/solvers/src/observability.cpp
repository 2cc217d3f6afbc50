#include <mp2p_icp/parallel.h>
#include <mp2p_icp/se3.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "euler_rates.h"
#include "observability_analysis.h"
#include "pairing_sums.h"
#include "pose_prior.h"
#include "pose_quadratic.h"

namespace mp2p_icp
{
namespace
{
using Eigen::Matrix3d;
using Eigen::Vector3d;
using mrpt::poses::CPose3D;
constexpr double INF = std::numeric_limits<double>::infinity();

/// What the i-th pairing says at a pose: its rows, relative to the pose's frame.
struct Seen
{
    double w = 0, direction_w = 0;
    Vector3d p = Vector3d::Zero();  ///< the local position as seen from the global frame
    ResidualTerm position;
    std::optional<ResidualTerm> direction;
};

struct Motion
{
    Matrix3d R;
    Vector3d t;
    explicit Motion(const CPose3D& pose) : R(rotation_of(pose)), t(translation_of(pose)) {}
};

Seen seen(const PreparedPairings& in, size_t i, const Motion& motion, double L)
{
    const PairingId id = pairing_id(in.pairings(), i);
    const PairingTerms terms = in.terms(id);
    Seen out;
    out.w = in.weight(id), out.position = terms.position, out.direction = terms.direction;
    if (terms.direction) out.direction_w = in.direction_weight(id, L);
    out.p = motion.R * terms.position.b + motion.t;
    return out;
}

struct Spread
{
    Vector3d mean = Vector3d::Zero();
    double L = 1;         ///< rms distance from the mean, m; 1 if that is not resolved
    double largest = 0;   ///< largest |coordinate|
    double rounding = 0;  ///< of coordinates, m
};

Spread spread_of(const PreparedPairings& in, const CPose3D& pose, const AnalysisOptions& options)
{
    Spread s;
    const Motion motion(pose);
    std::vector<Vector3d> positions;
    positions.reserve(in.size());
    for (size_t i = 0; i < in.size(); i++)
    {
        const Seen x = seen(in, i, motion, 1);
        if (!(x.w > 0 || x.direction_w > 0)) continue;
        positions.push_back(x.p), s.mean += x.p;
        s.largest = std::max({s.largest, x.p.cwiseAbs().maxCoeff(), x.position.q.cwiseAbs().maxCoeff()});
    }
    if (positions.empty()) return s;
    const double n = static_cast<double>(positions.size());
    s.mean /= n;
    double squares = 0;
    for (const Vector3d& p : positions) squares += (p - s.mean).squaredNorm();
    // Of rounding: one unit in the last place / sqrt(12).
    s.rounding = options.coordinate_rounding.value_or(s.largest * options.epsilon / std::sqrt(12.0));
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
    double residual_rms() const
    {
        return positions ? std::sqrt(position_squares / static_cast<double>(positions)) : 0.0;
    }
    void add_position(const Seen& x)
    {
        if (!(x.w > 0)) return;
        position_squares += (x.position.C * (x.p - x.position.q)).squaredNorm(), positions++;
    }
    /// J is (1, -S) for a position, and (0, -S) for a direction: what both have in common. \return w C S
    Matrix3d add(double weight, const ResidualTerm& t, const Matrix3d& S, const Vector3d& difference)
    {
        const Matrix3d wCS = weight * t.C * S;
        H.bottomRightCorner<3, 3>().noalias() += S.transpose() * wCS;
        squares += weight * (t.C * difference).squaredNorm();
        rows += static_cast<size_t>(t.rows);
        return wCS;
    }
    /// The rest for a position. Fills the upper blocks only.
    void add_translation(double weight, const ResidualTerm& t, const Matrix3d& wCS)
    {
        H.topLeftCorner<3, 3>() += weight * t.C;
        H.topRightCorner<3, 3>() -= wCS;
    }
};

Normal normal_matrix(const PreparedPairings& in, const CPose3D& pose, const Spread& s, double direction_L)
{
    const Motion motion(pose);
    const auto sum = [&](size_t from, size_t to)
    {
        Normal n;
        for (size_t i = from; i < to; i++)
        {
            const Seen x = seen(in, i, motion, direction_L);
            if (x.w > 0)
            {
                const Matrix3d S = skew((x.p - s.mean) / s.L);
                n.add_translation(x.w, x.position, n.add(x.w, x.position, S, x.p - x.position.q));
                n.add_position(x);
            }
            if (!(x.direction_w > 0)) continue;
            const Vector3d rotated = motion.R * x.direction->b;
            n.add(x.direction_w, *x.direction, skew(rotated / s.L), rotated - x.direction->q);
        }
        return n;
    };
    Normal out = block_sum<Normal>(in.size(), sum);
    out.H.bottomLeftCorner<3, 3>() = out.H.topRightCorner<3, 3>().transpose();
    return out;
}

/// What a motion's information must exceed, relative to the largest, to be more than rounding: of the sums,
/// and, where it rotates, of the coordinates.
double relative_limit(const Vector6& direction, const Spread& s)
{
    return std::max(1e-10, std::pow(10 * s.rounding / s.L, 2) * direction.tail<3>().squaredNorm());
}

/** The information less what noise of the points can feign: their lever arms about an axis on which they all
 * lie, say, are noise alone. That is two thirds of the residuals' squares; three times as much is taken off.
 */
Matrix6 without_noise(const Matrix6& H, double noise_squares, const Spread& s)
{
    Matrix6 out = H;
    out.diagonal().tail<3>().array() -= 2 * noise_squares / (s.L * s.L);
    return out;
}

/// The information of the prior in (v of the mean, omega L).
Matrix6 prior_information(const CPose3D& pose, const Spread& s, const AnalysisOptions& options)
{
    if (!options.prior) return Matrix6::Zero();
    Matrix6 J = PosePrior::jacobian(pose, rotation_of(pose).transpose() * (s.mean - translation_of(pose)));
    J.rightCols<3>() /= s.L;
    return J.transpose() * PosePrior(*options.prior).information() * J;
}

/// Some of the six principal motions (orthonormal columns), as two sets.
struct Motions
{
    Eigen::Matrix<double, 6, Eigen::Dynamic> free{6, 0}, determined{6, 0};

    void add(const Vector6& motion, bool is_free)
    {
        auto& columns = is_free ? free : determined;
        columns.conservativeResize(Eigen::NoChange, columns.cols() + 1);
        columns.rightCols<1>() = motion;
    }
};

/// Takes those of the free motions as determined that a prior knows to within a deviation (m).
Motions with_prior(const Motions& without, const Matrix6& prior, double deviation)
{
    Motions out{{6, 0}, without.determined};
    if (without.free.cols() == 0) return out;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(without.free.transpose() * prior *
                                                               without.free);
    for (Eigen::Index i = 0; i < without.free.cols(); i++)
        out.add(without.free * eigen.eigenvectors().col(i),
                !(eigen.eigenvalues()(i) * deviation * deviation > 1));
    return out;
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

/** How much of a motion may be rotation (or, of a screw, advance) for it to be told as a pure translation
 * (rotation): noise mixes motions, where it is not that of rounding alone.
 */
double mixing(const AnalysisOptions& options)
{
    return options.feigned ? 0.1 : 1e-3;
}

/// A readable basis of the free motions (orthonormal columns): the pure translations among them first, then
/// what rotates.
std::vector<Vector6> readable_motions(const Eigen::Matrix<double, 6, Eigen::Dynamic>& free, double mixing)
{
    if (free.cols() == 0) return {};
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(free.bottomRows<3>(), Eigen::ComputeFullV);
    const auto rotations = (svd.singularValues().array() > mixing).count();
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

FreeTwist as_twist(const Vector6& direction, double deviation, double information_ratio, double mixing,
                   const Spread& s)
{
    static const char* const translations[3] = {"x", "y", "z"};
    static const char* const rotations[3] = {"roll", "pitch", "yaw"};
    const Vector3d v = direction.head<3>(), omega = direction.tail<3>() / s.L;
    FreeTwist out;
    out.information_ratio = information_ratio;
    if (direction.tail<3>().norm() < mixing)
    {
        const Vector3d axis = v.normalized();
        out.axis = to_mrpt(axis), out.sigma = deviation, out.name = axis_name(axis, translations);
        return out;
    }
    const Vector3d axis = omega.normalized();
    const double pitch = axis.dot(v) / omega.norm();
    out.kind = std::abs(pitch) < mixing * s.L ? FreeTwist::Kind::Rotation : FreeTwist::Kind::Screw;
    if (out.kind == FreeTwist::Kind::Screw) out.pitch = pitch;
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

/// From (v of the mean, omega L) to (dt, omega): the translation's change and the rotation vector.
Matrix6 origin_twist_from_twist(const CPose3D& pose, const Spread& s)
{
    Matrix6 M = Matrix6::Identity();
    M.topRightCorner<3, 3>() = skew(s.mean - translation_of(pose)) / s.L;
    M.bottomRightCorner<3, 3>() /= s.L;
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

/// The 6x6 matrices of the result, from the information H and the covariance in (v of the mean, omega L).
void set_matrices(const CPose3D& pose, const Spread& s, const Matrix6& H, const Matrix6& twist_covariance,
                  const std::vector<Vector6>& free, Observability& out)
{
    const bool known = std::isfinite(out.sigma);
    const auto symmetric = [](const Matrix6& M) -> Matrix6 { return 0.5 * (M + M.transpose()); };
    const auto transformed = [&](const Matrix6& to, bool angles_singular)
    {
        Matrix6 covariance = symmetric(to * twist_covariance * to.transpose());
        set_infinite(covariance, to, free);
        for (int i = 0; i < 6; i++)
            if (!known || (angles_singular && (i == 3 || i == 5)))
                covariance.row(i).setZero(), covariance.col(i).setZero(), covariance(i, i) = INF;
        return covariance;
    };
    set(out.covariance,
        transformed(coordinates_from_twist_at(pose, s), std::abs(std::cos(pose.pitch())) < 1e-6));
    set(out.covariance_twist, transformed(origin_twist_from_twist(pose, s), false));
    const Matrix6 M = twist_from_coordinates(pose, s);
    const double scale = known && out.sigma > 0 ? 1 / (out.sigma * out.sigma) : 0.0;
    set(out.information, scale > 0 ? Matrix6(M.transpose() * H * M * scale) : Matrix6(Matrix6::Zero()));
}
}  // namespace

std::string to_string(FreeTwist::Kind kind)
{
    switch (kind)
    {
        case FreeTwist::Kind::Translation:
            return "translation";
        case FreeTwist::Kind::Rotation:
            return "rotation";
        case FreeTwist::Kind::Screw:
            return "screw";
    }
    return "";
}

namespace
{
/// All that the pairings say at the pose, judged. \param feigned information that their errors make up
Observability judge(const Normal& n, const Matrix6& feigned, const Spread& s, const CPose3D& pose,
                    const AnalysisOptions& options)
{
    Observability out;
    out.residual_rms = n.residual_rms();

    const Eigen::SelfAdjointEigenSolver<Matrix6> all(n.H);
    const double largest = all.eigenvalues()(5);
    const auto exceeds = [&](double information, const Vector6& direction)
    { return information > 0 && information > relative_limit(direction, s) * largest; };
    for (int i = 0; i < 6; i++) out.rank += exceeds(all.eigenvalues()(i), all.eigenvectors().col(i)) ? 1 : 0;

    const auto ratio_of = [largest](double information)
    { return largest > 0 ? std::max(0.0, information / largest) : 0.0; };

    const double rows = static_cast<double>(n.rows), spare_rows = rows - out.rank;
    const double estimate = spare_rows > 0 ? std::sqrt(n.squares / spare_rows) : INF;
    out.sigma = options.sigma.value_or(std::max(estimate, s.rounding));
    const double sigma_sq = std::isfinite(out.sigma) ? out.sigma * out.sigma : 0.0;

    // Nor is a rotation determined that noise leaves too uncertain.
    const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(
        without_noise(n.H, spare_rows > 0 && rows > 6 ? n.squares * rows / spare_rows : 0.0, s) - feigned);
    const auto deviation = [&](const Vector6& u)
    {
        const double information = u.dot(n.H * u);
        return information > 0 ? out.sigma / std::sqrt(information) : INF;
    };
    const auto is_free = [&](int i)
    {
        const Vector6 u = eigen.eigenvectors().col(i);
        const double omega = u.tail<3>().norm() / s.L;
        return !exceeds(eigen.eigenvalues()(i), u) || (omega > 1e-3 / s.L && std::isfinite(out.sigma) &&
                                                       deviation(u) * omega > options.largest_deviation);
    };
    Motions motions;
    for (int i = 0; i < 6; i++) motions.add(eigen.eigenvectors().col(i), is_free(i));
    const Matrix6 prior = prior_information(pose, s, options);
    if (options.prior) motions = with_prior(motions, prior, options.prior_deviation);
    const auto& determined = motions.determined;
    out.rank = static_cast<int>(determined.cols());
    const Matrix6 H = n.H + sigma_sq * prior;
    Matrix6 twist_covariance = Matrix6::Zero();
    if (out.rank > 0)
        twist_covariance =
            sigma_sq * determined *
            (determined.transpose() * H * determined).ldlt().solve(Eigen::MatrixXd(determined.transpose()));
    const auto basis = readable_motions(motions.free, mixing(options));
    for (const auto& u : basis)
    {
        const double certain = u.dot(eigen.eigenvectors() * eigen.eigenvalues().asDiagonal() *
                                     eigen.eigenvectors().transpose() * u);
        out.free.push_back(as_twist(u, exceeds(certain, u) ? deviation(u) : INF, ratio_of(u.dot(n.H * u)),
                                    mixing(options), s));
    }
    for (int i = 0; i < 6; i++)
    {
        const Vector6 u = all.eigenvectors().col(i);
        const double certain = exceeds(all.eigenvalues()(i), u) ? deviation(u) : INF;
        out.motions.push_back(as_twist(u, certain, ratio_of(all.eigenvalues()(i)), mixing({}), s));
    }
    set_matrices(pose, s, H, twist_covariance, basis, out);
    return out;
}

/// Of sums alone, the largest coordinate is known but for the size of the scene.
Spread spread_of(const PoseQuadratic& q, const OriginPose& pose, const AnalysisOptions& options)
{
    Spread s;
    s.mean = q.a_centre + pose.c;
    s.largest = std::max(q.a_centre.cwiseAbs().maxCoeff(), s.mean.cwiseAbs().maxCoeff()) + q.radius;
    s.rounding = options.coordinate_rounding.value_or(s.largest * options.epsilon / std::sqrt(12.0));
    s.L = q.L();
    return s;
}
}  // namespace

namespace
{
/// The length that turns rad into m, for the weights of directions, if there are any.
double rad_in_metres(const PreparedPairings& in)
{
    if (in.pairings().paired_ln2ln.empty() && in.pairings().paired_pl2pl.empty()) return 1;
    PreparedPairings summed = in;
    return pairing_sums(summed).L();
}
}  // namespace

Observability analyse(const PreparedPairings& in, const CPose3D& pose, const AnalysisOptions& options)
{
    const Spread s = spread_of(in, pose, options);
    Matrix6 feigned = Matrix6::Zero();
    if (options.feigned)
    {
        const PairWeights as_they_are;
        PreparedPairings errors(*options.feigned, as_they_are);
        if (!errors.all_usable()) errors.drop_unusable();
        feigned = options.feigned_factor * normal_matrix(errors, pose, s, 1).H;
    }
    return judge(normal_matrix(in, pose, s, rad_in_metres(in)), feigned, s, pose, options);
}

Observability analyse(const PoseQuadratic& q, const CPose3D& pose, const AnalysisOptions& options)
{
    const OriginPose at = q.relative(pose);
    Normal n;
    n.H = q.information(at.R), n.squares = q.cost(at), n.rows = q.rows;
    if (q.position_weight > 0) n.positions = 1, n.position_squares = n.squares / q.position_weight;
    return judge(n, Matrix6::Zero(), spread_of(q, at, options), pose, options);
}

Observability observability(const Pairings& pairings, const mrpt::poses::CPose3D& pose,
                            const ObservabilityParameters& parameters)
{
    PreparedPairings in(pairings, parameters.pair_weights);
    if (!in.all_usable()) in.drop_unusable();
    AnalysisOptions options;
    options.sigma = parameters.sigma, options.coordinate_rounding = parameters.coordinate_rounding;
    options.largest_deviation = parameters.largest_deviation;
    options.feigned = parameters.feigned, options.feigned_factor = parameters.feigned_factor;
    options.prior = parameters.prior, options.prior_deviation = parameters.prior_deviation;
    return analyse(in, pose, options);
}

Observability observability(const PoseQuadratic& sums, const mrpt::poses::CPose3D& pose,
                            const ObservabilityParameters& parameters)
{
    AnalysisOptions options;
    options.sigma = parameters.sigma;
    options.coordinate_rounding = parameters.coordinate_rounding;
    options.largest_deviation = parameters.largest_deviation;
    options.prior = parameters.prior, options.prior_deviation = parameters.prior_deviation;
    return analyse(sums, pose, options);
}

double residual_rms(const Pairings& pairings, const mrpt::poses::CPose3D& pose,
                    const PairWeights& pair_weights)
{
    PreparedPairings in(pairings, pair_weights);
    if (!in.all_usable()) in.drop_unusable();
    const Motion motion(pose);
    const Normal n = block_sum<Normal>(in.size(),
                                       [&](size_t from, size_t to)
                                       {
                                           Normal part;
                                           for (size_t i = from; i < to; i++)
                                               part.add_position(seen(in, i, motion, 1));
                                           return part;
                                       });
    return n.residual_rms();
}

mrpt::math::CMatrixDouble66 covariance(const Pairings& pairings, const mrpt::poses::CPose3D& pose,
                                       const ObservabilityParameters& parameters)
{
    return observability(pairings, pose, parameters).covariance;
}

}  // namespace mp2p_icp
