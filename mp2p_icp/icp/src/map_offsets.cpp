#include <mp2p_icp/map_offsets.h>
#include <mp2p_icp/se3.h>

namespace mp2p_icp
{
using mrpt::poses::CPose3D;

CPose3D MapOffsets::to_stored(const CPose3D& original) const
{
    if (none()) return original;
    const Eigen::Matrix3d R = rotation_of(original);
    return make_pose(R, translation_of(original) - to_eigen(global_) + R * to_eigen(local_));
}

CPose3D MapOffsets::to_original(const CPose3D& stored) const
{
    if (none()) return stored;
    const Eigen::Matrix3d R = rotation_of(stored);
    return make_pose(R, translation_of(stored) + to_eigen(global_) - R * to_eigen(local_));
}

mrpt::poses::CPose3DPDFGaussianInf MapOffsets::to_stored(
    const mrpt::poses::CPose3DPDFGaussianInf& original) const
{
    if (none()) return original;
    mrpt::poses::CPose3DPDFGaussianInf stored = original;
    stored.mean = to_stored(original.mean);
    // t_original = t_stored + offset_global - R(angles) offset_local: central differences of the smooth part
    // suffice.
    mrpt::math::CMatrixDouble66 J = mrpt::math::CMatrixDouble66::Identity();
    for (int k = 3; k < 6; k++)
    {
        const double h = 1e-6;
        const auto lever = [&](double delta)
        {
            double ypr[3] = {original.mean.yaw(), original.mean.pitch(), original.mean.roll()};
            ypr[k - 3] += delta;
            return Eigen::Vector3d(rotation_of(CPose3D(0, 0, 0, ypr[0], ypr[1], ypr[2])) * to_eigen(local_));
        };
        const Eigen::Vector3d derivative = -(lever(h) - lever(-h)) / (2 * h);
        for (int r = 0; r < 3; r++) J(r, k) = derivative(r);
    }
    stored.cov_inv =
        mrpt::math::CMatrixDouble66(J.asEigen().transpose() * original.cov_inv.asEigen() * J.asEigen());
    return stored;
}

Pairings MapOffsets::to_original(Pairings stored) const
{
    return none() ? stored : shifted(std::move(stored), local_, global_);
}

Pairings MapOffsets::to_stored(Pairings original) const
{
    return none() ? original : shifted(std::move(original), -local_, -global_);
}

Pairings shifted(Pairings p, const mrpt::math::TVector3D& local, const mrpt::math::TVector3D& global)
{
    const CPose3D by_local(local), by_global(global);
    for (auto& x : p.paired_pt2pt) x.local += local, x.global += global;
    for (auto& x : p.paired_pt2ln) x.pt_local += local, x.ln_global = compose(by_global, x.ln_global);
    for (auto& x : p.paired_pt2pl) x.pt_local += local, x.pl_global = compose(by_global, x.pl_global);
    for (auto& x : p.paired_ln2ln)
        x.ln_local = compose(by_local, x.ln_local), x.ln_global = compose(by_global, x.ln_global);
    for (auto& x : p.paired_pl2pl)
        x.p_local = compose(by_local, x.p_local), x.p_global = compose(by_global, x.p_global);
    return p;
}

}  // namespace mp2p_icp
