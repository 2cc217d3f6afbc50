#include "report_pairings.h"

#include <mp2p_icp/map_offsets.h>
#include <mp2p_icp/random.h>
#include <mp2p_icp/se3.h>
#include <mrpt/opengl/CSetOfLines.h>

#include <cmath>

namespace mp2p_icp
{
namespace
{
/// Appends a random subset.
template <class List>
void append_some(List& out, const List& all, double share)
{
    constexpr uint64_t SEED = 1;
    const auto wanted = static_cast<size_t>(std::ceil(share * static_cast<double>(all.size())));
    for (const size_t i : random_subset(all.size(), wanted, SEED)) out.push_back(all[i]);
}

Pairings some_of(const Pairings& all, size_t max_pairings)
{
    const double share = all.size() <= max_pairings
                             ? 1.0
                             : static_cast<double>(max_pairings) / static_cast<double>(all.size());
    Pairings out;
    append_some(out.paired_pt2pt, all.paired_pt2pt, share);
    append_some(out.paired_pt2ln, all.paired_pt2ln, share);
    append_some(out.paired_pt2pl, all.paired_pt2pl, share);
    append_some(out.paired_ln2ln, all.paired_ln2ln, share);
    append_some(out.paired_pl2pl, all.paired_pl2pl, share);
    return out;
}

pairings_render_params_t sizes_for(double picture_height)
{
    pairings_render_params_t p;
    const double size = 0.03 * picture_height;
    p.pt2ln.lineLength = p.ln2ln.lineLength = size;
    p.pt2pl.planePatchSize = p.pl2pl.planePatchSize = size;
    p.pl2pl.normalLength = 0.5 * size;
    return p;
}

void append(PackedPoints& out, const mrpt::opengl::CSetOfLines& lines)
{
    for (size_t i = 0; i < lines.getLineCount(); i++)
    {
        mrpt::math::TPoint3D from, to;
        lines.getLineByIndex(i, from.x, from.y, from.z, to.x, to.y, to.z);
        out.add(to_eigen(from), to_eigen(to));
    }
}
}  // namespace

PerPairingKind<DrawnPairings> drawn_pairings(const Pairings& pairings,
                                             const mrpt::poses::CPose3D& localWrtGlobal,
                                             const Eigen::Vector3d& centre, size_t max_pairings,
                                             double picture_height)
{
    const Pairings some = shifted(some_of(pairings, max_pairings), {0, 0, 0}, to_mrpt(-centre));
    const auto pose = make_pose(rotation_of(localWrtGlobal), translation_of(localWrtGlobal) - centre);
    const auto scene = some.get_visualization(pose, sizes_for(picture_height));

    PerPairingKind<DrawnPairings> out;
    for (size_t kind = 0; kind < PAIRING_KIND_COUNT; kind++)
    {
        const auto set = std::dynamic_pointer_cast<mrpt::opengl::CSetOfObjects>(
            scene->getByName(PAIRING_KIND_NAMES[kind]));
        if (!set) continue;
        for (const auto& object : *set)
            if (const auto lines = std::dynamic_pointer_cast<mrpt::opengl::CSetOfLines>(object); lines)
                append(lines->getName() == "residuals" ? out[kind].residuals : out[kind].primitives, *lines);
    }
    return out;
}

}  // namespace mp2p_icp
