#include "pairing_objects.h"

#include <mrpt/opengl/CPointCloudColoured.h>
#include <mrpt/opengl/CSetOfLines.h>

#include <algorithm>
#include <cmath>

namespace mp2p_icp
{
using mrpt::math::TPoint3D;
using mrpt::opengl::CSetOfObjects;
using mrpt::poses::CPose3D;

namespace
{
constexpr double RED_ABOVE = 0.95;  // the share of the residuals that are not drawn in the last red

/// An evenly spaced choice of at most so many.
template <class List>
List some_of(const List& all, size_t at_most)
{
    List some;
    const size_t step = all.size() <= at_most ? 1 : (all.size() + at_most - 1) / std::max<size_t>(1, at_most);
    for (size_t i = 0; i < all.size(); i += step) some.push_back(all[i]);
    return some;
}

/// Those that are drawn, their global sides moved.
Pairings drawn_pairings(const Pairings& all, const TPoint3D& shift, size_t at_most)
{
    const CPose3D move(shift);
    Pairings out;
    out.paired_pt2pt = some_of(all.paired_pt2pt, at_most);
    out.paired_pt2ln = some_of(all.paired_pt2ln, at_most);
    out.paired_pt2pl = some_of(all.paired_pt2pl, at_most);
    out.paired_ln2ln = some_of(all.paired_ln2ln, at_most);
    out.paired_pl2pl = some_of(all.paired_pl2pl, at_most);
    for (auto& pair : out.paired_pt2pt) pair.global += shift;
    for (auto& pair : out.paired_pt2ln) pair.ln_global = compose(move, pair.ln_global);
    for (auto& pair : out.paired_pt2pl) pair.pl_global = compose(move, pair.pl_global);
    for (auto& pair : out.paired_ln2ln) pair.ln_global = compose(move, pair.ln_global);
    for (auto& pair : out.paired_pl2pl) pair.p_global = compose(move, pair.p_global);
    return out;
}

pairings_render_params_t render_params(const PairingKinds& kinds, double unit)
{
    pairings_render_params_t p;
    p.pt2pt.visible = kinds.pt2pt, p.pt2ln.visible = kinds.pt2ln, p.pt2pl.visible = kinds.pt2pl;
    p.ln2ln.visible = kinds.ln2ln, p.pl2pl.visible = kinds.pl2pl;
    const double size = unit / 50;
    p.pt2ln.lineLength = p.ln2ln.lineLength = 2 * size;
    p.pt2pl.planePatchSize = 0.5 * size;
    p.pl2pl.planePatchSize = 4 * size, p.pl2pl.normalLength = 2 * size;
    return p;
}

struct Residual
{
    TPoint3D local_end;
    double length = 0;
};

/// From the segments that Pairings draws: they go from the global side to the local one.
std::vector<Residual> residuals_of(const CSetOfObjects& drawing)
{
    std::vector<Residual> residuals;
    for (const auto& kind : drawing)
    {
        const auto* set = dynamic_cast<const CSetOfObjects*>(kind.get());
        const auto lines = set ? std::dynamic_pointer_cast<mrpt::opengl::CSetOfLines>(
                                     const_cast<CSetOfObjects*>(set)->getByName("residuals"))
                               : nullptr;
        if (!lines) continue;
        for (const auto& segment : *lines) residuals.push_back({segment.point2, segment.length()});
    }
    return residuals;
}

double scale_of(const std::vector<Residual>& residuals)
{
    std::vector<double> lengths;
    for (const auto& r : residuals) lengths.push_back(r.length);
    if (lengths.empty()) return 0;
    const auto at =
        static_cast<std::ptrdiff_t>(std::ceil(RED_ABOVE * static_cast<double>(lengths.size() - 1)));
    std::nth_element(lengths.begin(), lengths.begin() + at, lengths.end());
    return lengths[static_cast<size_t>(at)];
}

CSetOfObjects::Ptr residual_cloud(const std::vector<Residual>& residuals, double scale, double unit,
                                  float point_size_px)
{
    auto cloud = mrpt::opengl::CPointCloudColoured::Create();
    cloud->setPointSize(1.6f * point_size_px);
    cloud->enableVariablePointSize(false);
    for (const auto& r : residuals)
    {
        const auto share = static_cast<float>(scale > 0 ? std::min(1.0, r.length / scale) : 0);
        const mrpt::img::TColorf c(mrpt::img::colormap(mrpt::img::cmJET, share));
        const auto p = (r.local_end * (1 / unit)).cast<float>();
        cloud->push_back(p.x, p.y, p.z, c.R, c.G, c.B);
    }
    auto set = CSetOfObjects::Create();
    set->setName("residual points");
    set->insert(cloud);
    return set;
}
}  // namespace

PairingObjects make_pairing_objects(const Pairings& pairings, const TPoint3D& global_shift,
                                    const CPose3D& T_origin_local, double unit,
                                    const LogSceneOptions& options)
{
    PairingObjects out;
    out.objects = CSetOfObjects::Create();
    const auto shown = drawn_pairings(pairings, global_shift, options.max_pairings);
    const auto drawing = shown.get_visualization(T_origin_local, render_params(options.pairings, unit));
    drawing->setScale(static_cast<float>(1 / unit));
    if (options.color_by_residual)
    {
        const auto residuals = residuals_of(*drawing);
        out.residual_scale = scale_of(residuals);
        out.objects->insert(residual_cloud(residuals, out.residual_scale, unit, options.local.point_size_px));
    }
    if (options.draw_pairings) out.objects->insert(drawing);
    return out;
}

}  // namespace mp2p_icp
