#include "toward_guess.h"

#include <mp2p_icp/se3.h>

#include <Eigen/Dense>

namespace mp2p_icp
{
namespace
{
using Eigen::Matrix3d;
using Eigen::Vector3d;

Vector3d rotation_vector_between(const Matrix3d& from, const Matrix3d& to)
{
    const Eigen::AngleAxisd turn(Eigen::Quaterniond(to * from.transpose()).normalized());
    return turn.angle() * turn.axis();
}

/// The least coefficients c for which the columns of A times c are nearest to v.
Eigen::VectorXd coefficients(const Eigen::Matrix<double, 3, Eigen::Dynamic>& A, const Vector3d& v)
{
    return A.completeOrthogonalDecomposition().solve(v);
}

/// A turn by `angle` about the axis of a twist, with its advance. The axis is that of the twist's own pose;
/// of a chain of small turns all are about the places where the axes were.
void turn(const FreeTwist& twist, double angle, Matrix3d& R, Vector3d& t)
{
    const Matrix3d rotation = Eigen::AngleAxisd(angle, to_eigen(twist.axis)).toRotationMatrix();
    const Vector3d centre = to_eigen(twist.through);
    t = rotation * (t - centre) + centre + twist.pitch * angle * to_eigen(twist.axis);
    R = rotation * R;
}
}  // namespace

mrpt::poses::CPose3D toward_guess(const mrpt::poses::CPose3D& pose, const mrpt::poses::CPose3D& guess,
                                  const std::vector<FreeTwist>& free)
{
    Eigen::Matrix<double, 3, Eigen::Dynamic> slides(3, 0), turns(3, 0);
    std::vector<FreeTwist> turning;
    for (const auto& twist : free)
    {
        const bool slide = twist.kind == FreeTwist::Kind::Translation;
        auto& columns = slide ? slides : turns;
        columns.conservativeResize(Eigen::NoChange, columns.cols() + 1);
        columns.rightCols<1>() = to_eigen(twist.axis);
        if (!slide) turning.push_back(twist);
    }
    Matrix3d R = rotation_of(pose);
    Vector3d t = translation_of(pose);
    const Matrix3d R_guess = rotation_of(guess);
    for (int round = 0; round < 20 && !turning.empty(); round++)
    {
        const Eigen::VectorXd back = -coefficients(turns, rotation_vector_between(R_guess, R));
        for (size_t i = 0; i < turning.size(); i++)
            turn(turning[i], back[static_cast<Eigen::Index>(i)], R, t);
        if (back.norm() < 1e-15) break;
    }
    if (slides.cols() > 0) t -= slides * coefficients(slides, t - translation_of(guess));
    return make_pose(R, t);
}

}  // namespace mp2p_icp
