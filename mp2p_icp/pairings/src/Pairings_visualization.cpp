#include <mp2p_icp/Pairings.h>
#include <mp2p_icp/numbers.h>
#include <mp2p_icp/se3.h>
#include <mrpt/opengl/CSetOfLines.h>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace mp2p_icp
{
namespace
{
using Eigen::Vector3d;
using mrpt::img::TColor;
using mrpt::opengl::CSetOfObjects;
using mrpt::poses::CPose3D;

struct Segment
{
    Vector3d from, to;
};
using Segments = std::vector<Segment>;

/// What is drawn of one pairing, or of all of a kind: the primitives of both sides and what joins them.
struct Drawing
{
    Segments global, local, residuals;
};

struct Colors
{
    TColor global, local, residuals;
};

/// local -> global
Eigen::Isometry3d motion_of(const CPose3D& pose)
{
    Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
    motion.linear() = rotation_of(pose), motion.translation() = translation_of(pose);
    return motion;
}

// ---- Pieces of geometry. What is degenerate becomes NaN; is_drawable() drops it in the end ----------------

Vector3d unit(const Vector3d& v)
{
    return v / v.stableNorm();
}

Vector3d normal_of(const plane_patch_t& patch)
{
    const auto& c = patch.plane.coefs;
    // Nothing drawn depends on the distance, but a plane without one is damaged.
    if (!std::isfinite(c[3])) return Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
    return unit({c[0], c[1], c[2]});
}

Vector3d foot_on(const mrpt::math::TLine3D& line, const Vector3d& p)
{
    const Vector3d base = to_eigen(line.pBase), u = unit(to_eigen(line.director));
    return base + u * u.dot(p - base);
}

/// The plane is the one through the centroid, as it is for the solvers.
Vector3d foot_on(const plane_patch_t& patch, const Vector3d& p)
{
    const Vector3d n = normal_of(patch);
    return p - n * n.dot(p - to_eigen(patch.centroid));
}

Segment piece_of_line(const Vector3d& centre, const mrpt::math::TLine3D& line, double length)
{
    const Vector3d half = unit(to_eigen(line.director)) * (0.5 * length);
    return {centre - half, centre + half};
}

Segments border_of(const plane_patch_t& patch, double size)
{
    const Vector3d n = normal_of(patch), c = to_eigen(patch.centroid);
    const Vector3d u = n.unitOrthogonal() * (0.5 * size), v = n.cross(u);
    const Vector3d corners[] = {c + u + v, c - u + v, c - u - v, c + u - v};
    Segments border;
    for (int i = 0; i < 4; i++) border.push_back({corners[i], corners[(i + 1) % 4]});
    return border;
}

Segments border_and_normal_of(const plane_patch_t& patch, const render_params_pairings_pl2pl_t& p)
{
    Segments segments = border_of(patch, p.planePatchSize);
    const Vector3d c = to_eigen(patch.centroid);
    segments.push_back({c, c + normal_of(patch) * p.normalLength});
    return segments;
}

Segments moved(const Eigen::Isometry3d& motion, Segments segments)
{
    for (auto& s : segments) s = {motion * s.from, motion * s.to};
    return segments;
}

// ---- One pairing of each kind. Residuals go from the global side to the local one -------------------------

Drawing drawing_of(const mrpt::tfest::TMatchingPair_d& pair, const Eigen::Isometry3d& motion,
                   const render_params_pairings_pt2pt_t&)
{
    return {{}, {}, {{to_eigen(pair.global), motion * to_eigen(pair.local)}}};
}

Drawing drawing_of(const point_line_pair_t& pair, const Eigen::Isometry3d& motion,
                   const render_params_pairings_pt2ln_t& p)
{
    const Vector3d point = motion * to_eigen(pair.pt_local), foot = foot_on(pair.ln_global, point);
    return {{piece_of_line(foot, pair.ln_global, p.lineLength)}, {}, {{foot, point}}};
}

Drawing drawing_of(const point_plane_pair_t& pair, const Eigen::Isometry3d& motion,
                   const render_params_pairings_pt2pl_t& p)
{
    const Vector3d point = motion * to_eigen(pair.pt_local);
    return {border_of(pair.pl_global, p.planePatchSize), {}, {{foot_on(pair.pl_global, point), point}}};
}

Drawing drawing_of(const matched_line_t& pair, const Eigen::Isometry3d& motion,
                   const render_params_pairings_ln2ln_t& p)
{
    const Vector3d base = to_eigen(pair.ln_local.pBase), foot = foot_on(pair.ln_global, motion * base);
    return {{piece_of_line(foot, pair.ln_global, p.lineLength)},
            moved(motion, {piece_of_line(base, pair.ln_local, p.lineLength)}),
            {{foot, motion * base}}};
}

Drawing drawing_of(const matched_plane_t& pair, const Eigen::Isometry3d& motion,
                   const render_params_pairings_pl2pl_t& p)
{
    return {border_and_normal_of(pair.p_global, p),
            moved(motion, border_and_normal_of(pair.p_local, p)),
            {{to_eigen(pair.p_global.centroid), motion * to_eigen(pair.p_local.centroid)}}};
}

// ---- All pairings of a kind -------------------------------------------------------------------------------

/// OpenGL draws in float: what is beyond its range is as good as infinite.
bool is_drawable(const Vector3d& p)
{
    return (p.array().abs() <= static_cast<double>(std::numeric_limits<float>::max())).all();
}
bool is_drawable(const Segments& segments)
{
    for (const auto& s : segments)
        if (!is_drawable(s.from) || !is_drawable(s.to)) return false;
    return true;
}
bool is_drawable(const Drawing& d)
{
    return is_drawable(d.global) && is_drawable(d.local) && is_drawable(d.residuals);
}

void append(Segments& to, const Segments& from)
{
    to.insert(to.end(), from.begin(), from.end());
}

template <class List, class Params>
Drawing drawing_of_all(const List& pairs, const CPose3D& localWrtGlobal, const Params& p)
{
    const Eigen::Isometry3d motion = motion_of(localWrtGlobal);
    Drawing all;
    for (const auto& pair : pairs)
    {
        const Drawing one = drawing_of(pair, motion, p);
        if (!is_drawable(one)) continue;
        append(all.global, one.global), append(all.local, one.local), append(all.residuals, one.residuals);
    }
    return all;
}

void insert_lines(CSetOfObjects& scene, const char* name, const Segments& segments, const TColor& color)
{
    if (segments.empty()) return;
    auto lines = mrpt::opengl::CSetOfLines::Create();
    lines->setName(name);
    lines->setColor_u8(color);
    lines->reserve(segments.size());
    for (const auto& s : segments) lines->appendLine(to_mrpt(s.from), to_mrpt(s.to));
    scene.insert(lines);
}

template <class List, class Params>
CSetOfObjects::Ptr scene_of(const char* kind, const List& pairs, const CPose3D& localWrtGlobal,
                            const Params& p, const Colors& colors)
{
    auto scene = CSetOfObjects::Create();
    scene->setName(kind);
    if (!p.visible) return scene;
    const Drawing all = drawing_of_all(pairs, localWrtGlobal, p);
    insert_lines(*scene, "global", all.global, colors.global);
    insert_lines(*scene, "local", all.local, colors.local);
    insert_lines(*scene, "residuals", all.residuals, colors.residuals);
    return scene;
}

void require_size(const char* name, double size)
{
    if (std::isfinite(size) && size >= 0) return;
    throw std::invalid_argument("Pairings::get_visualization: " + std::string(name) +
                                " must be finite and not negative, not " + to_text(size));
}
}  // namespace

CSetOfObjects::Ptr Pairings::get_visualization(const CPose3D& localWrtGlobal,
                                               const pairings_render_params_t& p) const
{
    auto scene = CSetOfObjects::Create();
    for (const auto& kind :
         {get_visualization_pt2pt(localWrtGlobal, p.pt2pt), get_visualization_pt2ln(localWrtGlobal, p.pt2ln),
          get_visualization_pt2pl(localWrtGlobal, p.pt2pl), get_visualization_ln2ln(localWrtGlobal, p.ln2ln),
          get_visualization_pl2pl(localWrtGlobal, p.pl2pl)})
        if (!kind->empty()) scene->insert(kind);
    return scene;
}

CSetOfObjects::Ptr Pairings::get_visualization_pt2pt(const CPose3D& localWrtGlobal,
                                                     const render_params_pairings_pt2pt_t& p) const
{
    return scene_of("pt2pt", paired_pt2pt, localWrtGlobal, p, {p.color, p.color, p.color});
}

CSetOfObjects::Ptr Pairings::get_visualization_pt2ln(const CPose3D& localWrtGlobal,
                                                     const render_params_pairings_pt2ln_t& p) const
{
    require_size("pt2ln.lineLength", p.lineLength);
    return scene_of("pt2ln", paired_pt2ln, localWrtGlobal, p, {p.color, p.color, p.segmentColor});
}

CSetOfObjects::Ptr Pairings::get_visualization_pt2pl(const CPose3D& localWrtGlobal,
                                                     const render_params_pairings_pt2pl_t& p) const
{
    require_size("pt2pl.planePatchSize", p.planePatchSize);
    return scene_of("pt2pl", paired_pt2pl, localWrtGlobal, p, {p.color, p.color, p.segmentColor});
}

CSetOfObjects::Ptr Pairings::get_visualization_ln2ln(const CPose3D& localWrtGlobal,
                                                     const render_params_pairings_ln2ln_t& p) const
{
    require_size("ln2ln.lineLength", p.lineLength);
    return scene_of("ln2ln", paired_ln2ln, localWrtGlobal, p, {p.color, p.localColor, p.segmentColor});
}

CSetOfObjects::Ptr Pairings::get_visualization_pl2pl(const CPose3D& localWrtGlobal,
                                                     const render_params_pairings_pl2pl_t& p) const
{
    require_size("pl2pl.planePatchSize", p.planePatchSize);
    require_size("pl2pl.normalLength", p.normalLength);
    return scene_of("pl2pl", paired_pl2pl, localWrtGlobal, p, {p.color, p.localColor, p.segmentColor});
}

}  // namespace mp2p_icp
