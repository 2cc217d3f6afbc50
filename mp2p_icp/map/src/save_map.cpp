#include <mp2p_icp/errors.h>
#include <mp2p_icp/load_map.h>
#include <mrpt/io/CMemoryStream.h>
#include <mrpt/serialization/CArchive.h>

#include "cloud_writers.h"
#include "files.h"
#include "gzip.h"

namespace mp2p_icp
{
namespace
{
std::string write_metric_map(const metric_map_t& map)
{
    mrpt::io::CMemoryStream stream;
    stream.setAllocBlockSize(1 << 20);
    mrpt::serialization::archiveFrom(stream) << map;
    return gzip({static_cast<const char*>(stream.getRawBufferData()), stream.getTotalBytesCount()});
}

mrpt::maps::CPointsMap::Ptr layer_to_save(const metric_map_t& map, const std::string& layer)
{
    if (!layer.empty()) return map.point_layer(layer);
    std::string names, only;
    size_t count = 0;
    for (const auto& [name, l] : map.layers)
    {
        if (!MapToPointsMap(*l)) continue;
        count++;
        only = name;
        names += (names.empty() ? "'" : ", '") + name + "'";
    }
    if (count == 0)
        throw std::invalid_argument("save_map: the map has no cloud layer, and only .mm can hold the rest");
    if (count > 1)
        throw std::invalid_argument("save_map: 'layer' must name one of the cloud layers " + names);
    return map.point_layer(only);
}

std::string write_cloud(const metric_map_t& map, const std::string& path, const std::string& layer)
{
    const std::string suffix = suffix_of(path);
    const bool text = suffix == ".xyz" || suffix == ".txt" || suffix == ".csv";
    if (!text && suffix != ".ply" && suffix != ".pcd" && suffix != ".bin")
        throw std::invalid_argument("save_map: the suffix of '" + path +
                                    "' must be .mm .ply .pcd .xyz .txt .csv or .bin");
    const auto points = layer_to_save(map, layer);
    const auto offset = map.coordinate_offset();
    if (suffix == ".ply") return write_ply(*points, offset);
    if (suffix == ".pcd") return write_pcd(*points, offset);
    if (text) return write_text_points(*points, offset, suffix == ".csv" ? ',' : ' ', suffix == ".csv");
    if (offset != mrpt::math::TPoint3D(0, 0, 0))
        throw std::invalid_argument(
            "save_map: .bin has only float coordinates, too coarse for a map with a coordinate offset");
    return write_kitti(*points);
}
}  // namespace

void save_map(const metric_map_t& map, const std::string& path, const std::string& layer)
{
    const bool whole = suffix_of(path) == ".mm";
    if (whole && !layer.empty())
        throw std::invalid_argument("save_map: a .mm file holds all layers, so 'layer' must be empty, not '" +
                                    layer + "'");
    const std::string bytes = whole ? write_metric_map(map) : write_cloud(map, path, layer);
    write_whole_file(path, has_gz_suffix(path) && !whole ? gzip(bytes) : bytes);
}

}  // namespace mp2p_icp
