#include <mp2p_icp/QualityEvaluator_RangeImageSimilarity.h>
#include <mp2p_icp/parallel.h>
#include <mrpt/core/bits_math.h>

#include <algorithm>

#include "RangeImage.h"
#include "direction_weights.h"
#include "quality_points.h"

IMPLEMENTS_MRPT_OBJECT(QualityEvaluator_RangeImageSimilarity, mp2p_icp::QualityEvaluator, mp2p_icp)

namespace mp2p_icp
{
namespace
{
constexpr size_t LEAST_PIXELS = 3;  // as few points as fix a pose
constexpr double SAME_WITHIN = 3;   // sigmas

/// Of the pixels of the local image.
struct PixelSums
{
    size_t local = 0, both = 0;
    double score = 0, weight = 0;

    PixelSums& operator+=(const PixelSums& o)
    {
        local += o.local, both += o.both, score += o.score, weight += o.weight;
        return *this;
    }
};

using Normals = std::vector<std::optional<Eigen::Vector3d>>;

Normals normals_of(const RangeImage& image)
{
    Normals normals(image.geometry().size());
    parallel_for_blocks(normals.size(),
                        [&](size_t first, size_t last)
                        {
                            for (size_t i = first; i < last; i++)
                                if (image.seen(i)) normals[i] = image.normal(i);
                        });
    return normals;
}

DirectionWeights weights_for(const Normals& normals)
{
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    size_t count = 0;
    for (const auto& n : normals)
        if (n) sum += *n * n->transpose(), count++;
    return {sum, count};
}

/// Of two images from one place.
class Comparison
{
 public:
    Comparison(const RangeImage& local, const RangeImage& global, double sigma, double penalty)
        : local_(local),
          global_(global),
          normals_(normals_of(local)),
          weights_(weights_for(normals_)),
          sigma_(sigma),
          hidden_(std::exp(-0.5 * penalty * penalty))
    {
    }

    void add(size_t pixel, PixelSums& sums) const
    {
        if (!local_.seen(pixel)) return;
        sums.local++;
        std::array<size_t, 9> around;
        const size_t count = seen_in_global(pixel, around);
        if (count == 0) return;
        const double weight = normals_[pixel] ? weights_.of(*normals_[pixel]) : 1.0;
        sums.both++;
        sums.score += weight * score(pixel, around, count);
        sums.weight += weight;
    }

 private:
    /// The pixel and its neighbours that show something of the global map: their number.
    size_t seen_in_global(size_t pixel, std::array<size_t, 9>& out) const
    {
        const size_t count = local_.geometry().neighbourhood(pixel, out);
        const auto end =
            std::remove_if(out.begin(), out.begin() + count, [this](size_t k) { return !global_.seen(k); });
        return static_cast<size_t>(end - out.begin());
    }

    double score(size_t pixel, const std::array<size_t, 9>& around, size_t count) const
    {
        const auto& normal = normals_[pixel];
        double least = std::numeric_limits<double>::infinity();
        bool all_farther = true;
        for (size_t k = 0; k < count; k++)
        {
            const double deeper = global_.range(around[k]) - local_.range(pixel);
            all_farther = all_farther && deeper > SAME_WITHIN * sigma_;
            const double distance =
                normal ? normal->dot(global_.point(around[k]) - local_.point(pixel)) : deeper;
            least = std::min(least, std::abs(distance));
        }
        const double similar = std::exp(-0.5 * std::pow(least / sigma_, 2));
        return all_farther ? std::max(similar, hidden_) : similar;
    }

    const RangeImage &local_, &global_;
    const Normals normals_;
    const DirectionWeights weights_;
    const double sigma_, hidden_;
};

FieldOfView field_of_view(const QualityEvaluator_RangeImageSimilarity& q,
                          const std::vector<Eigen::Vector3d>& local)
{
    FieldOfView view = FieldOfView::around(local);
    if (q.azimuth_from_deg < q.azimuth_to_deg)
    {
        view.azimuth = mrpt::DEG2RAD(q.azimuth_from_deg);
        view.azimuth_span = mrpt::DEG2RAD(q.azimuth_to_deg - q.azimuth_from_deg);
    }
    if (q.elevation_from_deg < q.elevation_to_deg)
    {
        view.elevation = mrpt::DEG2RAD(q.elevation_from_deg);
        view.elevation_span = mrpt::DEG2RAD(q.elevation_to_deg - q.elevation_from_deg);
    }
    return view;
}

RangeImageGeometry geometry_for(const QualityEvaluator_RangeImageSimilarity& q,
                                const std::vector<Eigen::Vector3d>& local)
{
    if (q.fx > 0) return RangeImageGeometry::pinhole(q.ncols, q.nrows, q.cx, q.cy, q.fx, q.fy);
    const FieldOfView view = field_of_view(q, local);
    const double pixel = q.resolution_deg > 0 ? mrpt::DEG2RAD(q.resolution_deg)
                                              : RangeImageGeometry::pixel_angle_for(view, local.size());
    return RangeImageGeometry::spherical(view, pixel);
}

void declare_spherical(QualityEvaluator_RangeImageSimilarity& q, ParameterDeclaration& declare)
{
    declare.number("resolution_deg", q.resolution_deg, "deg", Range::between(0, 90),
                   "side of a pixel, at least 0.1; 0: about four local points in each");
    declare.number("azimuth_from_deg", q.azimuth_from_deg, "deg", Range::between(-360, 360),
                   "field of view, about the local z axis; both limits equal: that of the local points");
    declare.number("azimuth_to_deg", q.azimuth_to_deg, "deg", Range::between(-360, 360), "its upper end");
    declare.number("elevation_from_deg", q.elevation_from_deg, "deg", Range::between(-90, 90),
                   "field of view, above the local x-y plane; both limits equal: that of the local points");
    declare.number("elevation_to_deg", q.elevation_to_deg, "deg", Range::between(-90, 90), "its upper end");
    declare.rule(
        [&q]() -> std::string
        {
            if (q.resolution_deg > 0 && q.resolution_deg < 0.1)
                return "resolution_deg must be 0 or at least 0.1";
            if (q.azimuth_from_deg > q.azimuth_to_deg || q.azimuth_to_deg - q.azimuth_from_deg > 360)
                return "azimuth_to_deg must be above azimuth_from_deg, by 360 at most";
            if (q.elevation_from_deg > q.elevation_to_deg)
                return "elevation_to_deg must be above elevation_from_deg";
            return {};
        });
}

void declare_pinhole(QualityEvaluator_RangeImageSimilarity& q, ParameterDeclaration& declare)
{
    declare.integer("ncols", q.ncols, Range::between(0, 10000), "columns of a pinhole camera's image",
                    Need::Optional);
    declare.integer("nrows", q.nrows, Range::between(0, 10000), "rows of a pinhole camera's image");
    declare.number("cx", q.cx, "pixels", Range::any(), "where the camera's z axis meets the image");
    declare.number("cy", q.cy, "pixels", Range::any(), "where the camera's z axis meets the image");
    declare.number(
        "fx", q.fx, "pixels", Range::not_negative(),
        "focal length; above 0: the image is that of a pinhole camera looking along the local z axis");
    declare.number("fy", q.fy, "pixels", Range::not_negative(), "focal length");
    declare.rule(
        [&q]() -> std::string
        {
            const int given = (q.ncols > 0) + (q.nrows > 0) + (q.fx > 0) + (q.fy > 0);
            if (given != 0 && given != 4)
                return "a pinhole camera needs ncols, nrows, fx and fy, all above 0; a spherical image none";
            if (static_cast<uint64_t>(q.ncols) * q.nrows > 10'000'000)
                return "ncols * nrows must not be above 10 million";
            return {};
        });
}
}  // namespace

void QualityEvaluator_RangeImageSimilarity::declare_parameters(ParameterDeclaration& declare)
{
    declare.texts("pointLayers", pointLayers, "cloud layers of both maps to compare; default: all");
    declare.number("sigma", sigma, "m", Range::positive(), "scale of the distances: one sigma scores 0.61");
    declare.number("penalty_not_visible", penalty_not_visible, "sigmas", Range::not_negative(),
                   "distance taken for what the global map may have had hidden");
    declare.number("minimum_overlap", minimum_overlap, "", Range::between(0, 1),
                   "with a smaller share of the local pixels seen in both maps there is no overlap");
    declare_spherical(*this, declare);
    declare_pinhole(*this, declare);
    declare.number("sensor_x", sensor_x, "m", Range::any(), "where the sensor is in the local frame");
    declare.number("sensor_y", sensor_y, "m", Range::any(), "where the sensor is in the local frame");
    declare.number("sensor_z", sensor_z, "m", Range::any(), "where the sensor is in the local frame");
}

QualityEvaluator::Result QualityEvaluator_RangeImageSimilarity::evaluate(
    const metric_map_t& pcGlobal, const metric_map_t& pcLocal, const mrpt::poses::CPose3D& localPose,
    const Pairings&, const MatchContext&) const
{
    const Eigen::Vector3d sensor(sensor_x, sensor_y, sensor_z);
    const PointsFromSensor from_local(pcLocal, pointLayers, sensor);
    const PointsFromSensor from_global(pcGlobal, pointLayers, sensor, localPose);
    std::vector<Eigen::Vector3d> points;
    from_local.for_each(
        [&](const Eigen::Vector3d& p)
        {
            if (p.squaredNorm() > 0) points.push_back(p);
        });
    if (points.empty() || !is_finite(localPose)) return {0.0, true};

    RangeImage local(geometry_for(*this, points)), global(local.geometry());
    for (const auto& p : points) local.insert(p);
    from_global.for_each([&](const Eigen::Vector3d& p) { global.insert(p); });

    const Comparison comparison(local, global, sigma, penalty_not_visible);
    const auto sums = block_sum<PixelSums>(local.geometry().size(),
                                           [&](size_t first, size_t last)
                                           {
                                               PixelSums part;
                                               for (size_t i = first; i < last; i++) comparison.add(i, part);
                                               return part;
                                           });
    const double both = static_cast<double>(sums.both);
    if (sums.both < LEAST_PIXELS || both < minimum_overlap * static_cast<double>(sums.local))
        return {0.0, true};
    return {sums.score / sums.weight, false};
}

}  // namespace mp2p_icp
