#include <mp2p_icp/numbers.h>
#include <mp2p_icp/se3.h>
#include <mp2p_icp/write_certificate.h>

#include <sstream>
#include <stdexcept>

#include "certified_pairings.h"
#include "pairing_sums.h"
#include "pose_prior.h"

namespace mp2p_icp
{
namespace
{
using mrpt::math::TPoint3D;

template <class Numbers>
std::string row(const Numbers& numbers)
{
    std::string out = "[";
    for (const double x : numbers) out += (out.size() > 1 ? ", " : "") + to_text(x);
    return out + "]";
}
template <class Matrix>
std::string row_major(const Matrix& M)
{
    std::vector<double> numbers;
    for (Eigen::Index r = 0; r < M.rows(); r++)
        for (Eigen::Index c = 0; c < M.cols(); c++) numbers.push_back(M(r, c));
    return row(numbers);
}
std::string rotation(const mrpt::poses::CPose3D& pose)
{
    return row_major(rotation_of(pose));
}
std::string translation(const mrpt::poses::CPose3D& pose)
{
    return row_major(translation_of(pose));
}

std::string comma(const TPoint3D& p)
{
    return ", " + to_text(p.x) + "," + to_text(p.y) + "," + to_text(p.z);
}
std::string comma(const plane_patch_t& p)
{
    return comma(p.centroid) + comma(TPoint3D(p.plane.coefs[0], p.plane.coefs[1], p.plane.coefs[2]));
}
std::string comma(const mrpt::math::TLine3D& l)
{
    return comma(l.pBase) + comma(TPoint3D(l.director.x, l.director.y, l.director.z));
}

/// One line of the form that docs/formats.md describes.
std::string line_of(const PreparedPairings& in, const PairingId& id, double L)
{
    const Pairings& p = in.pairings();
    const std::string w = to_text(in.weight(id));
    const auto direction = [&](DirectionSign sign)
    {
        return w + "," + to_text(in.direction_weight(id, L)) +
               (sign == DirectionSign::Free ? ",free" : ",oriented");
    };
    switch (id.kind)
    {
        case PairingKind::Point2Point:
        {
            const auto& x = p.paired_pt2pt[id.index];
            return "pt2pt," + w + comma(TPoint3D(x.global)) + comma(TPoint3D(x.local));
        }
        case PairingKind::Point2Line:
        {
            const auto& x = p.paired_pt2ln[id.index];
            return "pt2ln," + w + comma(x.ln_global) + comma(x.pt_local);
        }
        case PairingKind::Point2Plane:
        {
            const auto& x = p.paired_pt2pl[id.index];
            return "pt2pl," + w + comma(x.pl_global) + comma(x.pt_local);
        }
        case PairingKind::Line2Line:
        {
            const auto& x = p.paired_ln2ln[id.index];
            return "ln2ln," + direction(in.kinds().ln2ln_sign) + comma(x.ln_global) + comma(x.ln_local);
        }
        default:
        {
            const auto& x = p.paired_pl2pl[id.index];
            return "pl2pl," + direction(in.kinds().pl2pl_sign) + comma(x.p_global) + comma(x.p_local);
        }
    }
}

void write_prior(std::ostream& out, const mrpt::poses::CPose3DPDFGaussianInf& prior)
{
    out << "prior:\n  rotation: " << rotation(prior.mean) << "\n  translation: " << translation(prior.mean)
        << "\n  information: " << row_major(twist_information(prior)) << "\n";
}

void write_pairings(std::ostream& out, const PreparedPairings& in)
{
    PreparedPairings summed = in;
    const double L = pairing_sums(summed).L();
    out << "pairings: |\n";
    for (size_t i = 0; i < in.size(); i++)
        if (const PairingId id = pairing_id(in.pairings(), i); in.in_use(id))
            out << "  " << line_of(in, id, L) << "\n";
}
}  // namespace

CertifiedResult write_certificate(std::ostream& out, const Pairings& pairings,
                                  const CertifiedParameters& parameters)
{
    CertifiedResult result;
    std::optional<PreparedPairings> certified;
    if (!solve_certified(pairings, result, parameters, certified))
        throw std::invalid_argument("write_certificate: no pairing has a positive weight and finite numbers");
    out << "# Weighted least squares over pairings of points, lines and planes: the best pose, and why none "
           "is better.\n"
        << "# Check it with: icp-certify FILE\n"
        << "mp2p_icp_certificate: 1\nverdict: " << to_string(result.verdict)
        << "\ntolerance: " << to_text(parameters.tolerance) << "\ncost: " << to_text(result.cost)
        << "\nscale: " << to_text(result.scale) << "\ngap: " << to_text(result.gap)
        << "\nmargin: " << to_text(result.margin) << "\nrotation: " << rotation(result.optimalPose)
        << "\ntranslation: " << translation(result.optimalPose) << "\nG: " << row_major(result.G)
        << "\nminima:\n";
    for (const auto& m : result.minima)
        out << "  - {rotation: " << rotation(m.pose) << ", translation: " << translation(m.pose)
            << ", cost: " << to_text(m.cost) << "}\n";
    if (parameters.prior) write_prior(out, *parameters.prior);
    write_pairings(out, *certified);
    return result;
}

}  // namespace mp2p_icp
