#include <gtest/gtest.h>
#include <mp2p_icp/ortho_view.h>
#include <mp2p_icp/random.h>

#include <cmath>

using namespace mp2p_icp;
using mrpt::math::TPoint3D;
using mrpt::math::TVector3D;

namespace
{
constexpr int W = 600, H = 400;

double dot(const TVector3D& a, const TVector3D& b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

/// Points spread evenly over a box about `centre`.
PointSet box_of_points(size_t count, const TPoint3D& centre, const TPoint3D& half, uint64_t seed)
{
    SeededRandom random(seed);
    PointSet points;
    for (size_t i = 0; i < count; i++)
        points.push_back(centre + TPoint3D(random.uniform(-half.x, half.x), random.uniform(-half.y, half.y),
                                           random.uniform(-half.z, half.z)));
    return points;
}

size_t count_inside(const OrthoView& view, const PointSet& points)
{
    size_t inside = 0;
    for (const auto& p : points)
    {
        const auto pixel = view.project(p, W, H);
        inside += pixel.x > 0 && pixel.x < W && pixel.y > 0 && pixel.y < H;
    }
    return inside;
}

/// The larger of the shares of the picture's width and height that the points span.
double filled(const OrthoView& view, const PointSet& points)
{
    double x_lo = W, x_hi = 0, y_lo = H, y_hi = 0;
    for (const auto& p : points)
    {
        const auto pixel = view.project(p, W, H);
        x_lo = std::min(x_lo, pixel.x), x_hi = std::max(x_hi, pixel.x);
        y_lo = std::min(y_lo, pixel.y), y_hi = std::max(y_hi, pixel.y);
    }
    return std::max((x_hi - x_lo) / W, (y_hi - y_lo) / H);
}
}  // namespace

TEST(OrthoView, its_axes_are_a_right_handed_frame_with_z_upwards)
{
    for (const double azimuth : {-170.0, -90.0, 0.0, 33.0})
        for (const double elevation : {-90.0, -20.0, 0.0, 45.0, 90.0})
        {
            OrthoView view;
            view.azimuth_deg = azimuth;
            view.elevation_deg = elevation;
            const auto r = view.right(), u = view.up(), e = view.towards_eye();
            EXPECT_NEAR(dot(r, u), 0, 1e-15);
            EXPECT_NEAR(dot(u, e), 0, 1e-15);
            EXPECT_NEAR(e.norm(), 1, 1e-15);
            EXPECT_NEAR(r.y * u.z - r.z * u.y, e.x, 1e-15);
            EXPECT_NEAR(r.z * u.x - r.x * u.z, e.y, 1e-15);
            EXPECT_NEAR(r.x * u.y - r.y * u.x, e.z, 1e-15);
            EXPECT_GE(u.z, -1e-15);
        }
}

TEST(OrthoView, seen_from_above_x_runs_right_and_y_up)
{
    OrthoView view;
    view.azimuth_deg = -90;
    view.elevation_deg = 90;
    view.focus = {10, 20, 30};
    view.height = 4;
    const auto centre = view.project({10, 20, 55}, W, H), x = view.project({11, 20, 0}, W, H),
               y = view.project({10, 21, 0}, W, H);
    EXPECT_NEAR(centre.x, W / 2.0, 1e-9);
    EXPECT_NEAR(centre.y, H / 2.0, 1e-9);
    EXPECT_NEAR(x.x, W / 2.0 + 100, 1e-9);  // 4 m are 400 pixels
    EXPECT_NEAR(x.y, H / 2.0, 1e-9);
    EXPECT_NEAR(y.x, W / 2.0, 1e-9);
    EXPECT_NEAR(y.y, H / 2.0 - 100, 1e-9);
}

TEST(fit_view, shows_all_points_of_all_sets_and_fills_the_picture_whatever_their_size_and_place)
{
    for (const double size : {0.1, 1.0, 100.0, 1e4})
        for (const double away : {0.0, 1e4})
        {
            const TPoint3D centre(away, -away, 0.1 * away);
            PointSet a = box_of_points(500, centre, {size, 0.5 * size, 0.3 * size}, 1);
            const PointSet b =
                box_of_points(300, centre + TPoint3D(0.5 * size, 0, 0), {0.2 * size, size, 0.3 * size}, 2);
            const auto view = fit_view({a, b}, static_cast<double>(W) / H);
            EXPECT_EQ(count_inside(view, a), a.size());
            EXPECT_EQ(count_inside(view, b), b.size());
            a.insert(a.end(), b.begin(), b.end());
            EXPECT_GT(filled(view, a), 0.9) << size << " " << away;
        }
}

TEST(fit_view, a_few_far_points_do_not_shrink_the_rest)
{
    PointSet points = box_of_points(500, {0, 0, 0}, {1, 1, 1}, 3);
    const auto before = fit_view({points}, 1.5);
    for (const double far : {1e3, -1e4, 1e6}) points.emplace_back(far, -far, 0.5 * far);
    const auto after = fit_view({points}, 1.5);
    EXPECT_NEAR(after.height, before.height, 0.6 * before.height);
    EXPECT_EQ(count_inside(after, points), 500u);
}

TEST(fit_view, a_flat_scan_is_seen_from_above)
{
    for (const double height : {0.0, 500.0})
    {
        const auto view = fit_view({box_of_points(300, {5, 5, height}, {10, 8, 0}, 4)}, 1.5);
        EXPECT_DOUBLE_EQ(view.elevation_deg, 90);
        EXPECT_DOUBLE_EQ(view.azimuth_deg, -90);
    }
    // Also when the two scans hang at different heights, and when they form but one line.
    const auto line = box_of_points(300, {0, 0, 1}, {10, 0, 0}, 5),
               above = box_of_points(300, {0, 0, 3}, {10, 0, 0}, 6);
    EXPECT_DOUBLE_EQ(fit_view({line, above}, 1.5).elevation_deg, 90);
}

TEST(fit_view, a_wall_is_seen_along_its_normal)
{
    PointSet wall = box_of_points(300, {0, 0, 0}, {5, 0, 2}, 7);
    const double yaw = 0.5;
    for (auto& p : wall) p = {p.x * std::cos(yaw), p.x * std::sin(yaw), p.z};
    const auto e = fit_view({wall}, 1.5).towards_eye();
    EXPECT_NEAR(std::abs(dot(e, {-std::sin(yaw), std::cos(yaw), 0})), 1, 1e-9);
}

TEST(fit_view, a_solid_thing_is_seen_obliquely_and_the_caller_may_choose)
{
    const auto cube = box_of_points(300, {0, 0, 0}, {1, 1, 1}, 8);
    const auto view = fit_view({cube}, 1.5);
    EXPECT_GT(view.elevation_deg, 20);
    EXPECT_LT(view.elevation_deg, 80);
    const auto chosen = fit_view({cube}, 1.5, {15, -10});
    EXPECT_EQ(chosen.azimuth_deg, 15);
    EXPECT_EQ(chosen.elevation_deg, -10);
    EXPECT_EQ(count_inside(chosen, cube), cube.size());
}

TEST(fit_view, one_point_is_in_the_middle)
{
    const auto view = fit_view({{{3, 4, 5}, {3, 4, 5}}, {}}, 1.5);
    const auto pixel = view.project({3, 4, 5}, W, H);
    EXPECT_NEAR(pixel.x, W / 2.0, 1e-6);
    EXPECT_NEAR(pixel.y, H / 2.0, 1e-6);
    EXPECT_EQ(view.height, 1);
}

TEST(fit_view, what_cannot_be_shown_is_refused)
{
    EXPECT_THROW(fit_view({}, 1.5), std::invalid_argument);
    EXPECT_THROW(fit_view({{}, {}}, 1.5), std::invalid_argument);
    EXPECT_THROW(fit_view({{{0, 0, NAN}}}, 1.5), std::invalid_argument);
    EXPECT_THROW(fit_view({{{0, INFINITY, 0}}}, 1.5), std::invalid_argument);
    EXPECT_THROW(fit_view({{{0, 0, 0}}}, 0), std::invalid_argument);
    EXPECT_THROW(fit_view({{{0, 0, 0}}}, NAN), std::invalid_argument);
}
