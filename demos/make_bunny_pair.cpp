// Draws two independent samples of a mesh, uniformly by area, and moves one of them: two scans with a known
// answer.
//   make-bunny-pair MESH.obj OUTPUT_FOLDER
#include <mp2p_icp/load_map.h>
#include <mp2p_icp/numbers.h>
#include <mp2p_icp/synthetic/load_obj_mesh.h>
#include <mp2p_icp/synthetic/sample_by_area.h>
#include <mrpt/core/bits_math.h>

#include <fstream>
#include <iostream>

namespace
{
void save(const mrpt::maps::CSimplePointsMap::Ptr& points, const std::string& path)
{
    mp2p_icp::metric_map_t map;
    map.layers[mp2p_icp::metric_map_t::PT_LAYER_RAW] = points;
    mp2p_icp::save_map(map, path);
}
}  // namespace

int main(int argc, char** argv)
{
    if (argc != 3)
    {
        std::cerr << "usage: make-bunny-pair MESH.obj OUTPUT_FOLDER\n";
        return 1;
    }
    const std::string folder = argv[2];
    const auto mesh = mp2p_icp::synthetic::load_obj_mesh(argv[1]);
    const auto global = mp2p_icp::synthetic::sample_by_area(mesh, 20000, 1),
               local = mp2p_icp::synthetic::sample_by_area(mesh, 20000, 2);

    const auto box = global->boundingBox();
    const double size = static_cast<double>((box.max - box.min).norm());
    const double pose[6] = {0.10 * size, -0.08 * size, 0.05 * size, 15, -10, 8};  // m and degrees
    const mrpt::poses::CPose3D truth(pose[0], pose[1], pose[2], mrpt::DEG2RAD(pose[3]),
                                     mrpt::DEG2RAD(pose[4]), mrpt::DEG2RAD(pose[5]));
    local->changeCoordinatesReference(-truth);

    save(global, folder + "/bunny-global.ply");
    save(local, folder + "/bunny-local.ply");
    std::ofstream text(folder + "/bunny-truth.txt");
    text << "[";
    for (const double v : pose) text << (v == pose[0] ? "" : " ") << mp2p_icp::to_text(v);
    text << "]\n";
    return text ? 0 : 1;
}
