#include "noise_levels.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "number_text.h"

namespace mp2p_icp_apps::experiments
{
namespace
{
const Column POINTS = {"sigma_points_m", "standard deviation of each coordinate of the global positions"};
const Column ANGLES = {"sigma_angle_deg",
                       "standard deviation of the angle by which global directions are turned"};
}  // namespace

void set_point_levels(const ExperimentOptions& options, PoseStudy& study)
{
    study.columns = {POINTS};
    study.x_label = "σ of the points' noise [m]";
    for (const double sigma : options.noise_points)
        study.levels.push_back({{sigma}, number_text(sigma), {sigma, 0}, 0});
}

void set_mixed_levels(const ExperimentOptions& options, PoseStudy& study)
{
    const auto &points = options.noise_points, &angles = options.noise_angles;
    study.columns = {POINTS, ANGLES};
    study.x_label = "σ of positions [m], of directions [°]";
    for (size_t i = 0; i < std::max(points.size(), angles.size()); i++)
    {
        const double point = points[std::min(i, points.size() - 1)],
                     angle = angles[std::min(i, angles.size() - 1)];
        if ((point == 0) != (angle == 0))
            throw std::invalid_argument(
                "--noise-points and --noise-angles go together: " + number_text(point) + " m meets " +
                number_text(angle) + " degrees; either both or none must be zero");
        study.levels.push_back({{point, angle},
                                number_text(point) + "\n" + number_text(angle) + "°",
                                {point, angle * M_PI / 180},
                                0});
    }
}

}  // namespace mp2p_icp_apps::experiments
