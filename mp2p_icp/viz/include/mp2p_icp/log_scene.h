#pragma once

#include <mp2p_icp/log_moments.h>
#include <mp2p_icp/ortho_view.h>
#include <mrpt/img/TColor.h>
#include <mrpt/opengl/COpenGLScene.h>

#include <limits>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

namespace mp2p_icp
{
/// The names of what a map holds: its layers, `planes`, `lines`.
std::vector<std::string> drawable_parts(const metric_map_t& map);
/// A colour for each of them, well told apart for the first seven.
std::map<std::string, mrpt::img::TColor> distinct_colors(const metric_map_t& map);

/// How the parts of one map (its layers, `planes`, `lines`) are drawn.
struct MapStyle
{
    mrpt::img::TColor color;
    std::map<std::string, mrpt::img::TColor> part_colors;  ///< those of single parts
    std::set<std::string> hidden;                          ///< parts that are not drawn
    float point_size_px = 2;
    bool by_height = false;  ///< points get lighter with their z in the map's own frame
    double voxel_size = 0;   ///< m; above 0, points are drawn as the cubes of that size that hold any
};

/// Only what is so near to the plane through the middle of the view, across the line of sight, is drawn, m.
/// Negative distances lie on its other side.
struct DepthClip
{
    double before = std::numeric_limits<double>::infinity(), behind = before;
};

/// Which of the five kinds of pairings are drawn.
struct PairingKinds
{
    bool pt2pt = true, pt2ln = true, pt2pl = true, ln2ln = true, pl2pl = true;

    bool operator==(const PairingKinds& o) const
    {
        return pt2pt == o.pt2pt && pt2ln == o.pt2ln && pt2pl == o.pt2pl && ln2ln == o.ln2ln &&
               pl2pl == o.pl2pl;
    }
};

/// Colours of both maps where colours tell residuals.
const mrpt::img::TColor BEHIND_RESIDUALS_GLOBAL(0x70, 0x70, 0x70), BEHIND_RESIDUALS_LOCAL(0xC8, 0xC8, 0xC8);

struct LogSceneOptions
{
    // Blue and orange of the Okabe-Ito palette: told apart by all kinds of colour vision, and in grey print.
    MapStyle global{{0x00, 0x72, 0xB2}, {}, {}, 2, false};
    MapStyle local{{0xD5, 0x5E, 0x00}, {}, {}, 2, false};

    PairingKinds pairings;
    bool draw_pairings = false;
    size_t max_pairings = 20'000;  ///< of each kind; of more, an evenly spaced choice is drawn
    /// Paired points (or feet, centroids) get a colour from blue (no residual) to red; see
    /// LogScene::residual_scale().
    bool color_by_residual = false;

    DepthClip clip;            ///< of pictures; a window has to ask for it
    bool frames = false;       ///< axes (x red, y green, z blue) of both maps
    bool covariance = false;   ///< of the final translation; enlarged, see LogScene::covariance_scale()
    bool free_motions = true;  ///< arrows along translations, rings around rotations that nothing determines
};

/// A white ground, and a light that leaves no side of a thing dark.
void prepare_viewport(mrpt::opengl::COpenGLViewport& viewport);

/** Everything that can be seen in the log of an ICP run, or in a map, as one MRPT object.
 *
 * Points are handed over once: another moment moves an object, and makes only the pairings anew; another
 * style changes only what it names. Coordinates of any size are drawn: OpenGL gets them relative to the
 * middle of the data, divided by unit(). Not thread-safe.
 */
class LogScene
{
 public:
    /// Shows the final pose. \exception DataError if the log has no maps, neither of them anything finite to
    /// draw, or a pose that is not finite.
    explicit LogScene(LogRecord::ConstPtr log);
    /// Shows a map alone: as the global one, in its original coordinates.
    explicit LogScene(metric_map_t::ConstPtr map);
    ~LogScene();

    const LogRecord* log() const { return log_.get(); }  ///< null for a map
    const metric_map_t& global() const { return *global_; }
    const metric_map_t* local() const { return log_ ? log_->pcLocal.get() : nullptr; }

    /// \exception std::invalid_argument if the log does not hold it, DataError if its pose is not finite;
    /// then everything stays as it was.
    void show(const LogMoment& moment);
    const LogMoment& moment() const { return moment_; }

    /// Puts the local map at a pose (original coordinates) of the caller's; pairings are those of the moment.
    void show_pose(const mrpt::poses::CPose3D& localWrtGlobal);
    const mrpt::poses::CPose3D& pose() const { return pose_; }  ///< that is shown, original coordinates

    void set_options(const LogSceneOptions& options);
    const LogSceneOptions& options() const { return options_; }

    /// All of it, in scene coordinates.
    mrpt::opengl::CSetOfObjects::Ptr object() const { return root_; }
    /// A metre of the world is 1/unit() of the scene; the unit is about the size of the data.
    double unit() const;
    mrpt::math::TPoint3D in_scene(const mrpt::math::TPoint3D& original) const;
    /// Of the local map where it is shown, original coordinates; of a map alone, its own. What a camera that
    /// follows looks at.
    mrpt::math::TPoint3D local_middle() const;

    /// The view that shows both maps, the local one at the guess and at the final pose; world = the original
    /// coordinates of the global map. As fit_view().
    OrthoView fit(double width_over_height, const ViewDirection& direction = {}) const;
    /// A scene with the camera of a view, in which local points are seen where they meet global ones. The
    /// object is moved into it, until the next call.
    mrpt::opengl::COpenGLScene::Ptr scene_for(const OrthoView& view, int width_px, int height_px);
    /// Undoes what scene_for() did to the object: back to the scene coordinates of object().
    void leave_view();

    /// Moves the local map by that much, and pairings by twice as much (scene coordinates): towards the eye,
    /// so that they are seen where they meet the global map.
    void bring_forward(const mrpt::math::TVector3D& shift);

    double residual_scale() const { return residual_scale_; }      ///< metres that are drawn red; 0: none
    double covariance_scale() const { return covariance_scale_; }  ///< standard deviations times this
    size_t points() const { return points_; }                      ///< finite ones, of both maps

    /// How often things were made for the graphics card, since the beginning.
    struct Builds
    {
        size_t cloud_uploads = 0;  ///< sendings of a whole cloud
        size_t pairings = 0;
    };
    Builds builds() const { return {*uploads_, pairing_builds_}; }

 private:
    struct Frames;

    void make_frames();
    void make_maps();
    void place_local();
    void style_maps();
    void make_pairings();
    void make_decorations();

    LogRecord::ConstPtr log_;
    metric_map_t::ConstPtr global_;
    LogSceneOptions options_;
    LogMoment moment_;
    mrpt::poses::CPose3D pose_;
    std::unique_ptr<Frames> frames_;
    std::shared_ptr<size_t> uploads_ = std::make_shared<size_t>(0);
    size_t pairing_builds_ = 0, points_ = 0;
    double residual_scale_ = 0, covariance_scale_ = 1;

    mrpt::opengl::CSetOfObjects::Ptr root_, front_;  ///< front_: what is drawn before the global map
    mrpt::opengl::CSetOfObjects::Ptr global_objects_, local_objects_, pairing_objects_, decorations_;
};

}  // namespace mp2p_icp
