#include <mp2p_icp/errorTerms.h>
#include <mp2p_icp/se3.h>

#include "residual_terms.h"

namespace mp2p_icp
{
namespace
{
using mrpt::poses::CPose3D;
enum class Part : uint8_t
{
    Position,
    Direction
};

/// Writes A (R b + t - q), or A (R b - q) for a direction, and its Jacobian to the rows from `first` on.
template <int ROWS, int ALL>
void put(const Eigen::Matrix<double, ROWS, 3>& A, const ResidualTerm& term, const CPose3D& pose, Part part,
         int first, mrpt::math::CVectorFixedDouble<ALL>& error,
         mrpt::optional_ref<ErrorTermJacobian<ALL>>& jacobian)
{
    const double position = part == Part::Position ? 1 : 0;
    const Eigen::Matrix<double, ROWS, 1> value =
        A * (rotation_of(pose) * term.b + position * translation_of(pose) - term.q);
    for (int r = 0; r < ROWS; r++)
    {
        error[first + r] = value(r);
        if (!jacobian) continue;
        for (int c = 0; c < 9; c++) jacobian->get()(first + r, c) = A(r, c % 3) * term.b(c / 3);
        for (int c = 0; c < 3; c++) jacobian->get()(first + r, 9 + c) = position * A(r, c);
    }
}

mrpt::math::CVectorFixedDouble<3> whole(const ResidualTerm& term, const CPose3D& pose, Part part,
                                        mrpt::optional_ref<ErrorTermJacobian<3>> jacobian)
{
    mrpt::math::CVectorFixedDouble<3> error;
    put<3, 3>(term.C, term, pose, part, 0, error, jacobian);
    return error;
}
}  // namespace

mrpt::math::CVectorFixedDouble<3> error_point2point(const mrpt::tfest::TMatchingPair_d& pairing,
                                                    const CPose3D& relativePose,
                                                    mrpt::optional_ref<ErrorTermJacobian<3>> jacobian)
{
    return whole(position_term(pairing), relativePose, Part::Position, jacobian);
}

mrpt::math::CVectorFixedDouble<3> error_point2line(const point_line_pair_t& pairing,
                                                   const CPose3D& relativePose,
                                                   mrpt::optional_ref<ErrorTermJacobian<3>> jacobian)
{
    return whole(position_term(pairing), relativePose, Part::Position, jacobian);
}

mrpt::math::CVectorFixedDouble<3> error_point2plane(const point_plane_pair_t& pairing,
                                                    const CPose3D& relativePose,
                                                    mrpt::optional_ref<ErrorTermJacobian<3>> jacobian)
{
    return whole(position_term(pairing), relativePose, Part::Position, jacobian);
}

mrpt::math::CVectorFixedDouble<4> error_line2line(const matched_line_t& pairing, const CPose3D& relativePose,
                                                  mrpt::optional_ref<ErrorTermJacobian<4>> jacobian)
{
    const Eigen::Vector3d global = to_eigen(pairing.ln_global.director),
                          local = to_eigen(pairing.ln_local.director);
    const double sign = global.dot(rotation_of(relativePose) * local) < 0 ? -1 : 1;
    const Eigen::Vector3d u = global / global.stableNorm(), e1 = u.unitOrthogonal();
    Eigen::Matrix<double, 2, 3> basis;
    basis << e1.transpose(), u.cross(e1).transpose();
    mrpt::math::CVectorFixedDouble<4> error;
    put<2, 4>(sign * basis, direction_term(directions_of(pairing), DirectionSign::Free), relativePose,
              Part::Direction, 0, error, jacobian);
    put<2, 4>(basis, position_term(pairing), relativePose, Part::Position, 2, error, jacobian);
    return error;
}

mrpt::math::CVectorFixedDouble<3> error_plane2plane(const matched_plane_t& pairing,
                                                    const CPose3D& relativePose,
                                                    mrpt::optional_ref<ErrorTermJacobian<3>> jacobian)
{
    return whole(direction_term(directions_of(pairing), DirectionSign::Oriented), relativePose,
                 Part::Direction, jacobian);
}

}  // namespace mp2p_icp
