#pragma once

#include <mp2p_icp/block_grid.h>
#include <mp2p_icp/fitted_line.h>
#include <mp2p_icp/local_surfaces.h>
#include <mp2p_icp/nn_index.h>
#include <mp2p_icp/plane_patch.h>
#include <mp2p_icp/render_params.h>
#include <mrpt/containers/yaml.h>
#include <mrpt/maps/CPointsMap.h>
#include <mrpt/math/TBoundingBox.h>
#include <mrpt/math/TLine3D.h>
#include <mrpt/math/TPose3D.h>
#include <mrpt/opengl/CSetOfObjects.h>
#include <mrpt/serialization/CSerializable.h>

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace mp2p_icp
{
using layer_name_t = std::string;

struct LayerIndexCache;

/** What a sensor, or a map, offers for alignment: named layers of MRPT maps (mostly point clouds), planes and
 * lines.
 *
 * All coordinates are metres in one frame. Layers and what they point to may be read by several threads at
 * once; changing them needs exclusive access.
 *
 * Serialization: the original's layout, version 1 (5 when there is metadata); versions 0, 1 and 5 without
 * georeference are read. Where lines or planes come with a fit, version 128, which the original does not
 * know.
 */
class metric_map_t : public mrpt::serialization::CSerializable,
                     public std::enable_shared_from_this<metric_map_t>
{
    DEFINE_SERIALIZABLE(metric_map_t, mp2p_icp)

 public:
    static constexpr const char* PT_LAYER_RAW = "raw";
    static constexpr const char* PT_LAYER_PLANE_CENTROIDS = "plane_centroids";

    /// Copies share the layers (their pointers) and not the derived indexes.
    metric_map_t();
    metric_map_t(const metric_map_t&);
    metric_map_t& operator=(const metric_map_t&);
    ~metric_map_t() override;

    std::map<layer_name_t, mrpt::maps::CMetricMap::Ptr> layers;
    std::vector<fitted_line_t> lines;  ///< infinite lines, unit director
    std::vector<fitted_plane_t> planes;

    std::optional<uint64_t> id;
    std::optional<std::string> label;
    mrpt::containers::yaml metadata = mrpt::containers::yaml::Map();

    /// No layer, plane or line at all. A map with an empty layer is not empty.
    virtual bool empty() const;
    /// Number of points, planes and lines.
    virtual size_t size() const;
    virtual size_t size_points_only() const;
    virtual void clear();
    /// Such as `2 planes, 100 points in "raw", 10 points in "decimated"`.
    virtual std::string contents_summary() const;

    /// The layer as a cloud. \exception std::invalid_argument if it is missing (naming the layers there are)
    /// or not a cloud.
    mrpt::maps::CPointsMap::Ptr point_layer(const layer_name_t& name) const;

    /// The box around all points of all cloud layers (not planes and lines); empty if there are none.
    std::optional<mrpt::math::TBoundingBox> bounding_box() const;

    /** Adds everything of `other`, as seen from the pose of `other` in this map if given: points, planes and
     * lines. A layer that this map lacks is copied, one that it has gets the points appended. The pose is
     * between the stored coordinates; without it, different coordinate offsets of the maps are accounted for
     * (an empty map takes over the other's). \exception std::invalid_argument for a layer that is not a cloud
     * and is in both maps, or that would need a transformation.
     */
    virtual void merge_with(const metric_map_t& other,
                            const std::optional<mrpt::math::TPose3D>& otherRelativePose = std::nullopt);

    /** The nearest-neighbour index of a cloud layer: made at the first call, kept beside the layer for later
     * ones, made again when the layer's coordinates have changed since (found by a fingerprint of all of
     * them, about 1 ns per point). \exception std::invalid_argument as point_layer(). Thread-safe.
     */
    NearestNeighborIndex::ConstPtr nn_index(const layer_name_t& name, uint32_t leaf_max_points = 0) const;

    /** Normals and local covariances of a cloud layer, found by its nn_index(). Made, kept and made again as
     * that is; of each layer those of the eight latest sets of options are kept. \exception
     * std::invalid_argument as point_layer(), or for options out of their ranges. Thread-safe.
     */
    LocalSurfaces::ConstPtr local_surfaces(const layer_name_t& name, const LocalSurfaceOptions& options,
                                           uint32_t leaf_max_points = 0) const;

    /** The surfaces around the voxels of a cloud layer, from which local_surfaces() are made; made, kept and
     * made again as those. \param side m \exception std::invalid_argument as point_layer() and
     * BlockGrid::rebuild(). Thread-safe.
     */
    std::shared_ptr<const SurfacesOfVoxels> voxel_surfaces(const layer_name_t& name, double side) const;

    /** The whole numbers of metres that were subtracted from the coordinates of far-away data when they were
     * stored (MRPT's clouds are float: beyond 10 km they lose centimetres). Kept in metadata as
     * `coordinate_offset: [x, y, z]`; zero if absent. A point p of this map stands at p + coordinate_offset()
     * in the original data.
     */
    mrpt::math::TPoint3D coordinate_offset() const;
    void set_coordinate_offset(const mrpt::math::TPoint3D& offset);

    /// As a `.mm` file. Returns false if the file cannot be written.
    bool save_to_file(const std::string& file_name) const;
    /// Reads a `.mm` file, with the checks of load_map(). Returns false, and leaves the map as it was, if it
    /// cannot be read.
    bool load_from_file(const std::string& file_name);

    virtual std::shared_ptr<mrpt::opengl::CSetOfObjects> get_visualization(
        const render_params_t& p = render_params_t()) const;
    void get_visualization_planes(mrpt::opengl::CSetOfObjects& o, const render_params_planes_t& p) const;
    void get_visualization_lines(mrpt::opengl::CSetOfObjects& o, const render_params_lines_t& p) const;
    void get_visualization_points(mrpt::opengl::CSetOfObjects& o, const render_params_points_t& p) const;
    static void get_visualization_map_layer(mrpt::opengl::CSetOfObjects& o,
                                            const render_params_point_layer_t& p,
                                            const mrpt::maps::CMetricMap::Ptr& map);

    Ptr get_shared_from_this();
    ConstPtr get_shared_from_this() const;
    /// A shared pointer to this object if it is owned by one, else to a copy.
    ConstPtr get_shared_from_this_or_clone() const;

 private:
    std::shared_ptr<LayerIndexCache> indexes_;
};

/// The layer as a cloud, or null if it is another kind of map.
const mrpt::maps::CPointsMap* MapToPointsMap(const mrpt::maps::CMetricMap& map);
mrpt::maps::CPointsMap* MapToPointsMap(mrpt::maps::CMetricMap& map);

/// A 64-bit fingerprint of the coordinates, for change detection.
uint64_t coordinates_fingerprint(const mrpt::maps::CPointsMap& points);

}  // namespace mp2p_icp
