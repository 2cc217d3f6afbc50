#include "point_moments.h"

#include <mp2p_icp/parallel.h>
#include <mp2p_icp/se3.h>

namespace mp2p_icp
{
namespace
{
struct FirstMoments
{
    double w = 0;
    Eigen::Vector3d a = Eigen::Vector3d::Zero(), b = Eigen::Vector3d::Zero();
    FirstMoments& operator+=(const FirstMoments& o)
    {
        w += o.w, a += o.a, b += o.b;
        return *this;
    }
};

struct SecondMoments
{
    Eigen::Matrix3d B = Eigen::Matrix3d::Zero(), bb = Eigen::Matrix3d::Zero();
    double aa = 0;
    SecondMoments& operator+=(const SecondMoments& o)
    {
        B += o.B, bb += o.bb, aa += o.aa;
        return *this;
    }
};
}  // namespace

PointMoments point_moments(const MatchedPointList& pairs, const std::vector<double>& weights)
{
    const auto first = block_sum<FirstMoments>(pairs.size(),
                                               [&](size_t from, size_t to)
                                               {
                                                   FirstMoments m;
                                                   for (size_t i = from; i < to; i++)
                                                   {
                                                       if (weights[i] == 0) continue;
                                                       m.w += weights[i];
                                                       m.a += weights[i] * to_eigen(pairs[i].global);
                                                       m.b += weights[i] * to_eigen(pairs[i].local);
                                                   }
                                                   return m;
                                               });
    PointMoments out;
    out.weight = first.w;
    if (!(first.w > 0)) return out;
    out.a_mean = first.a / first.w, out.b_mean = first.b / first.w;
    const auto second =
        block_sum<SecondMoments>(pairs.size(),
                                 [&](size_t from, size_t to)
                                 {
                                     SecondMoments m;
                                     for (size_t i = from; i < to; i++)
                                     {
                                         if (weights[i] == 0) continue;
                                         const Eigen::Vector3d a = to_eigen(pairs[i].global) - out.a_mean,
                                                               b = to_eigen(pairs[i].local) - out.b_mean;
                                         m.B += weights[i] * a * b.transpose();
                                         m.bb += weights[i] * b * b.transpose();
                                         m.aa += weights[i] * a.squaredNorm();
                                     }
                                     return m;
                                 });
    out.B = second.B, out.bb = second.bb, out.aa = second.aa;
    return out;
}

}  // namespace mp2p_icp
