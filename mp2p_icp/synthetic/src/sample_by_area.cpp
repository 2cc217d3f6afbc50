#include <mp2p_icp/random.h>
#include <mp2p_icp/synthetic/sample_by_area.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace mp2p_icp::synthetic
{
namespace
{
Eigen::Vector3d uniform_point(const Triangle& t, SeededRandom& random)
{
    // The square root spreads points evenly: the strip at distance s from corner a is as long as s.
    const double s = std::sqrt(random.uniform()), u = random.uniform();
    return t.a + s * ((1 - u) * (t.b - t.a) + u * (t.c - t.a));
}
}  // namespace

mrpt::maps::CSimplePointsMap::Ptr sample_by_area(const TriangleMesh& mesh, size_t count, uint64_t seed)
{
    std::vector<double> area_up_to;
    area_up_to.reserve(mesh.size());
    double sum = 0;
    for (size_t i = 0; i < mesh.size(); i++) area_up_to.push_back(sum += mesh.triangle(i).area());
    if (!(sum > 0)) throw std::invalid_argument("sample_by_area: the mesh must have an area above zero");

    SeededRandom random(seed);
    auto points = mrpt::maps::CSimplePointsMap::Create();
    points->reserve(count);
    for (size_t i = 0; i < count; i++)
    {
        const auto chosen = std::upper_bound(area_up_to.begin(), area_up_to.end(), random.uniform(0, sum));
        const auto triangle =
            std::min<size_t>(static_cast<size_t>(chosen - area_up_to.begin()), mesh.size() - 1);
        const Eigen::Vector3f p = uniform_point(mesh.triangle(triangle), random).cast<float>();
        points->insertPoint(p.x(), p.y(), p.z());
    }
    return points;
}

}  // namespace mp2p_icp::synthetic
