#include <mp2p_icp/errors.h>
#include <mp2p_icp/log_scene.h>
#include <mp2p_icp/se3.h>

#include <algorithm>
#include <stdexcept>

#include "decorations.h"
#include "map_objects.h"
#include "pairing_objects.h"
#include "view_scene.h"

namespace mp2p_icp
{
using mrpt::math::TPoint3D;
using mrpt::opengl::CSetOfObjects;
using mrpt::poses::CPose3D;

/// Three coordinates of the data, in which the vertices are relative to some point and in the same unit.
struct LogScene::Frames
{
    SceneFrame original;       ///< of the global map; this is the scene
    SceneFrame stored_global;  ///< the same place
    SceneFrame stored_local;   ///< the middle of the local map
    TPoint3D global_offset{0, 0, 0}, local_offset{0, 0, 0};

    TPoint3D local_middle() const { return stored_local.origin + local_offset; }  ///< original coordinates
};

namespace
{
/// All that a view must show, in the original coordinates of the global map.
std::vector<PointSet> extents(const LogRecord* log, const metric_map_t& global)
{
    std::vector<PointSet> sets{extent_points(global, global.coordinate_offset())};
    if (!log) return sets;
    const PointSet local = extent_points(*log->pcLocal, log->pcLocal->coordinate_offset());
    for (const auto kind : {LogMoment::Kind::Guess, LogMoment::Kind::Final})
    {
        const CPose3D pose = pose_at(*log, {kind, 0});
        if (!is_finite(pose)) throw DataError("ICP log", "the " + to_string({kind, 0}) + " is not finite");
        auto& set = sets.emplace_back();
        set.reserve(local.size());
        for (const auto& p : local) set.push_back(pose.composePoint(p));
    }
    return sets;
}

void require_something(const std::vector<PointSet>& sets, const char* what)
{
    for (const auto& set : sets)
        if (!set.empty()) return;
    throw DataError(what, "nothing to draw: there is no finite point, plane or line");
}

metric_map_t::ConstPtr checked_global(const LogRecord::ConstPtr& log)
{
    if (!log) throw std::invalid_argument("LogScene: `log` must not be null");
    if (!log->pcGlobal || !log->pcLocal) throw DataError("ICP log", "it holds no maps");
    return log->pcGlobal;
}

size_t count_points(const CSetOfObjects& objects)
{
    size_t count = 0;
    for (const auto& object : objects)
        if (const auto* cloud = dynamic_cast<const CloudObject*>(object.get()); cloud) count += cloud->size();
    return count;
}
}  // namespace

LogScene::LogScene(LogRecord::ConstPtr log) : log_(std::move(log)), global_(checked_global(log_))
{
    make_frames();
    make_maps();
    show({LogMoment::Kind::Final, 0});
}

LogScene::LogScene(metric_map_t::ConstPtr map) : global_(std::move(map))
{
    if (!global_) throw std::invalid_argument("LogScene: `map` must not be null");
    options_.global.part_colors = distinct_colors(*global_);
    make_frames();
    make_maps();
    make_decorations();
}

LogScene::~LogScene() = default;

void LogScene::make_frames()
{
    const auto sets = extents(log_.get(), *global_);
    require_something(sets, log_ ? "ICP log" : "map");
    const auto view = fit_view(sets, 1);
    frames_ = std::make_unique<Frames>();
    auto& f = *frames_;
    f.original = {view.focus, view.height};
    f.global_offset = global_->coordinate_offset();
    f.stored_global = {view.focus - f.global_offset, view.height};
    if (!log_) return;
    f.local_offset = log_->pcLocal->coordinate_offset();
    f.stored_local.unit = view.height;
    if (const auto local = extent_points(*log_->pcLocal); !local.empty())
        f.stored_local.origin = fit_view({local}, 1, {-90.0, 90.0}).focus;  // along x, y, z
}

void LogScene::make_maps()
{
    root_ = CSetOfObjects::Create(), front_ = CSetOfObjects::Create();
    global_objects_ = map_objects(*global_, frames_->stored_global, uploads_);
    local_objects_ =
        log_ ? map_objects(*log_->pcLocal, frames_->stored_local, uploads_) : CSetOfObjects::Create();
    pairing_objects_ = CSetOfObjects::Create(), decorations_ = CSetOfObjects::Create();
    for (const auto& part : {pairing_objects_, local_objects_, decorations_}) front_->insert(part);
    root_->insert(front_), root_->insert(global_objects_);
    points_ = count_points(*global_objects_) + count_points(*local_objects_);
    style_maps();
}

void LogScene::show(const LogMoment& moment)
{
    if (!log_) return;
    const CPose3D pose = pose_at(*log_, moment);
    if (!is_finite(pose))
        throw DataError("ICP log", "the pose of the " + to_string(moment) + " is not finite");
    moment_ = moment;
    show_pose(pose);
}

void LogScene::show_pose(const CPose3D& localWrtGlobal)
{
    if (!is_finite(localWrtGlobal))
        throw std::invalid_argument("LogScene::show_pose: `localWrtGlobal` must be finite");
    pose_ = localWrtGlobal;
    place_local();
    make_pairings();
    make_decorations();
}

void LogScene::place_local()
{
    local_objects_->setPose(frames_->original.in_scene(pose_, frames_->local_middle()));
}

void LogScene::set_options(const LogSceneOptions& options)
{
    options_ = options;
    style_maps();
    make_pairings();
    make_decorations();
}

void LogScene::style_maps()
{
    MapStyle global = options_.global, local = options_.local;
    if (options_.color_by_residual)
    {
        global.color = BEHIND_RESIDUALS_GLOBAL, local.color = BEHIND_RESIDUALS_LOCAL;
        for (auto* style : {&global, &local}) style->part_colors.clear(), style->by_height = false;
    }
    style_map_objects(*global_objects_, global);
    style_map_objects(*local_objects_, local);
}

void LogScene::make_pairings()
{
    pairing_objects_->clear();
    residual_scale_ = 0;
    if (!log_ || (!options_.draw_pairings && !options_.color_by_residual)) return;
    bool stored = false;
    const Pairings* pairings = pairings_at(*log_, moment_, stored);
    if (!pairings || pairings->empty()) return;
    const auto& f = *frames_;
    const TPoint3D zero(0, 0, 0);
    const auto local_from = stored ? f.local_offset : zero, global_from = stored ? f.global_offset : zero;
    const CPose3D T_origin_local(
        make_pose(rotation_of(pose_), to_eigen(pose_.composePoint(local_from) - f.original.origin)));
    const auto made = make_pairing_objects(*pairings, global_from - f.original.origin, T_origin_local,
                                           f.original.unit, options_);
    pairing_objects_->insert(made.objects);
    residual_scale_ = made.residual_scale;
    pairing_builds_++;
}

void LogScene::make_decorations()
{
    decorations_->clear();
    const auto& f = *frames_;
    const auto insert = [this](const mrpt::opengl::CRenderizable::Ptr& object)
    {
        if (object) decorations_->insert(object);
    };
    if (options_.frames) insert(frame_object(CPose3D(f.original.in_scene(TPoint3D(0, 0, 0)))));
    if (!log_) return;
    if (options_.frames) insert(frame_object(f.original.in_scene(pose_, TPoint3D(0, 0, 0))));
    const auto middle = f.original.in_scene(pose_.composePoint(f.local_middle()));
    const auto& results = log_->icpResult;
    covariance_scale_ = 1;
    if (options_.covariance)
        insert(covariance_object(results.optimal_tf.cov.asEigen().topLeftCorner<3, 3>(), middle,
                                 f.original.unit, covariance_scale_));
    if (options_.free_motions)
        for (const auto& twist : results.unobservable) insert(free_motion_object(twist, f.original, middle));
}

double LogScene::unit() const
{
    return frames_->original.unit;
}

TPoint3D LogScene::local_middle() const
{
    return log_ ? pose_.composePoint(frames_->local_middle()) : frames_->original.origin;
}

TPoint3D LogScene::in_scene(const TPoint3D& original) const
{
    return frames_->original.in_scene(original);
}

OrthoView LogScene::fit(double width_over_height, const ViewDirection& direction) const
{
    return fit_view(extents(log_.get(), *global_), width_over_height, direction);
}

mrpt::opengl::COpenGLScene::Ptr LogScene::scene_for(const OrthoView& view, int width_px, int height_px)
{
    const auto& frame = frames_->original;
    const double scale = frame.unit / view.height;
    root_->setLocation(view.in_scene(frame.origin));
    root_->setScale(static_cast<float>(scale));
    bring_forward(view.towards_eye() * (PRIORITY_SHIFT / scale));
    auto scene = scene_of_view(view, width_px, height_px);
    // The eye is as far before the focus as things are shown behind it.
    const auto from_eye = [&](double behind)
    { return static_cast<float>((view.depth + std::clamp(behind, -view.depth, view.depth)) / view.height); };
    scene->getViewport()->setViewportClipDistances(from_eye(-options_.clip.before),
                                                   from_eye(options_.clip.behind));
    scene->insert(root_);
    return scene;
}

void LogScene::leave_view()
{
    root_->setLocation({0, 0, 0}), root_->setScale(1);
    bring_forward({0, 0, 0});
}

void LogScene::bring_forward(const mrpt::math::TVector3D& shift)
{
    front_->setLocation(shift);
    pairing_objects_->setLocation(shift);  // once more: it is within front_
}

}  // namespace mp2p_icp
