#include "pairings_file.h"

#include <mp2p_icp/errors.h>
#include <mp2p_icp/se3.h>

#include <cmath>
#include <optional>

#include "certificate_file.h"

namespace mp2p_icp_apps
{
namespace
{
using mp2p_icp::DataError;
using mp2p_icp::to_mrpt;
using mp2p_icp_certify::Pairing;
using Kind = mp2p_icp_certify::PairingKind;

mrpt::math::TLine3D line(const Eigen::Vector3d& base, const Eigen::Vector3d& direction)
{
    mrpt::math::TLine3D out;
    out.pBase = to_mrpt(base), out.director = to_mrpt(direction);
    return out;
}
mp2p_icp::plane_patch_t patch(const Eigen::Vector3d& centroid, const Eigen::Vector3d& normal)
{
    mp2p_icp::plane_patch_t out;
    for (int i = 0; i < 3; i++) out.plane.coefs[i] = normal(i);
    out.plane.coefs[3] = -normal.dot(centroid), out.centroid = to_mrpt(centroid);
    return out;
}

/// What all pairings of a kind with directions must share.
class CommonRule
{
 public:
    void add(const Pairing& p)
    {
        // Weights of positions are the pairings' own; where these are all zero, those of directions are.
        const double ratio =
            p.weight > 0 ? p.direction_weight / p.weight : std::numeric_limits<double>::infinity();
        const bool same = !ratio_ || (p.oriented == oriented_ &&
                                      (ratio == *ratio_ || std::abs(ratio - *ratio_) < 1e-12 * ratio));
        if (!same)
            throw DataError(
                "pairings",
                "all pairings of a kind must share one sign rule and one ratio of direction weight to "
                "position weight");
        ratio_ = ratio, oriented_ = p.oriented;
    }
    void set(double& position, std::optional<double>& direction, mp2p_icp::DirectionSign& sign) const
    {
        if (!ratio_) return;
        sign = oriented_ ? mp2p_icp::DirectionSign::Oriented : mp2p_icp::DirectionSign::Free;
        position = std::isfinite(*ratio_) ? 1 : 0, direction = std::isfinite(*ratio_) ? *ratio_ : 1;
    }
    static double own_weight(const Pairing& p) { return p.weight > 0 ? p.weight : p.direction_weight; }

 private:
    std::optional<double> ratio_;
    bool oriented_ = false;
};

void add(const Pairing& p, mp2p_icp::Pairings& out)
{
    const auto weigh = [](mp2p_icp::WeightRuns& runs, double w) { runs.emplace_back(1, w); };
    switch (p.kind)
    {
        case Kind::pt2pt:
        {
            const auto index = static_cast<uint32_t>(out.paired_pt2pt.size());
            out.paired_pt2pt.push_back(
                mrpt::tfest::TMatchingPair_d(index, index, to_mrpt(p.global), to_mrpt(p.local)));
            return weigh(out.point_weights, p.weight);
        }
        case Kind::pt2ln:
            out.paired_pt2ln.push_back({line(p.global, p.global_dir), to_mrpt(p.local)});
            return weigh(out.pt2ln_weights, p.weight);
        case Kind::pt2pl:
            out.paired_pt2pl.push_back({patch(p.global, p.global_dir), to_mrpt(p.local)});
            return weigh(out.pt2pl_weights, p.weight);
        case Kind::ln2ln:
            out.paired_ln2ln.push_back({line(p.global, p.global_dir), line(p.local, p.local_dir)});
            return weigh(out.ln2ln_weights, CommonRule::own_weight(p));
        default:
            out.paired_pl2pl.push_back({patch(p.global, p.global_dir), patch(p.local, p.local_dir)});
            return weigh(out.pl2pl_weights, CommonRule::own_weight(p));
    }
}
}  // namespace

PairingsFile load_pairings(const std::string& file_name)
{
    PairingsFile out;
    CommonRule lines, planes;
    for (const Pairing& p : mp2p_icp_certify::read_pairings(file_name))
    {
        if (p.kind == Kind::ln2ln) lines.add(p);
        if (p.kind == Kind::pl2pl) planes.add(p);
        add(p, out.pairings);
    }
    lines.set(out.weights.ln2ln, out.weights.ln2ln_direction, out.weights.ln2ln_sign);
    planes.set(out.weights.pl2pl, out.weights.pl2pl_direction, out.weights.pl2pl_sign);
    return out;
}

}  // namespace mp2p_icp_apps
