#include <mp2p_icp/load_map.h>
#include <mrpt/maps/CSimplePointsMap.h>

#include <cstdio>

int main()
{
    auto points = mrpt::maps::CSimplePointsMap::Create();
    points->insertPoint(1, 2, 3);
    mp2p_icp::metric_map_t map;
    map.layers["raw"] = points;
    mp2p_icp::save_map(map, "use_map.ply");
    const auto again = mp2p_icp::load_map("use_map.ply");
    std::remove("use_map.ply");
    return again.map->size() == 1 ? 0 : 1;
}
