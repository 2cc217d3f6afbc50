#include <mp2p_icp/errors.h>
#include <mp2p_icp/metricmap.h>
#include <mrpt/serialization/CArchive.h>
#include <mrpt/serialization/optional_serialization.h>
#include <mrpt/serialization/stl_serialization.h>
#include <mrpt/version.h>

#include "fits_serialization.h"
#include "metadata_text.h"

/** \file metricmap_serialization.cpp
 * The layout, after the class name and the version byte that MRPT writes (integers are little endian):
 *  - lines: MRPT's form of std::vector<TLine3D>;
 *  - u32 number of planes; each: 4 doubles A B C D, 3 doubles centroid;
 *  - u32 number of lines, and all of them again (so wrote the original, so it is read);
 *  - u32 number of layers; each: its name, and the MRPT object;
 *  - from version 1 on: MRPT's form of optional<uint64_t> id, optional<string> label;
 *  - from version 4 on: the georeference block: its name, version byte 0, u8 present;
 *  - from version 5 on: u8 present, and then the metadata as YAML text;
 *  - version 128 only: the fits, see fits_serialization.h.
 */
namespace mp2p_icp
{
using mrpt::serialization::CArchive;

namespace
{
constexpr const char* GEOREFERENCE = "mp2p_icp::Georeferencing";
constexpr uint8_t WITH_FITS = 128;  // far from what the original may come to use

bool has_metadata(const mrpt::containers::yaml& metadata)
{
    return !metadata.isNullNode() && !(metadata.isMap() && metadata.asMap().empty());
}

DataError bad(const std::string& problem)
{
    return DataError("mp2p_icp::metric_map_t", problem);
}

// Counts are not to be believed before the items have come: containers grow as items are read.

void read_planes(CArchive& in, std::vector<fitted_plane_t>& planes)
{
    const auto count = in.ReadAs<uint32_t>();
    for (uint32_t i = 0; i < count; i++)
    {
        fitted_plane_t patch;
        in >> patch.plane >> patch.centroid;
        planes.push_back(patch);
    }
}

void read_lines_again(CArchive& in, std::vector<fitted_line_t>& lines)
{
    const auto count = in.ReadAs<uint32_t>();
    lines.clear();
    for (uint32_t i = 0; i < count; i++)
    {
        mrpt::math::TLine3D line;
        in >> line;
        lines.push_back(line);
    }
}

void read_layers(CArchive& in, std::map<layer_name_t, mrpt::maps::CMetricMap::Ptr>& layers)
{
    const auto count = in.ReadAs<uint32_t>();
    for (uint32_t i = 0; i < count; i++)
    {
        std::string name;
        in >> name;
        const auto object = in.ReadObject();
        const auto layer = std::dynamic_pointer_cast<mrpt::maps::CMetricMap>(object);
        if (!layer)
            throw bad("layer '" + name + "' is no map but " +
                      (object ? "a " + std::string(object->GetRuntimeClass()->className) : "nothing"));
        layers[name] = layer;
    }
}

void read_georeference(CArchive& in)
{
    const auto name = in.ReadAs<std::string>();
    const auto version = in.ReadAs<uint8_t>();
    if (name != GEOREFERENCE || version != 0)
        throw bad(std::string("expected the block '") + GEOREFERENCE + "' of version 0, found '" + name +
                  "' of version " + std::to_string(version));
    if (in.ReadAs<bool>()) throw bad("version 5 with a georeference is not supported");
}
}  // namespace

uint8_t metric_map_t::serializeGetVersion() const
{
    if (has_fits(*this)) return WITH_FITS;
    return has_metadata(metadata) ? 5 : 1;
}

void metric_map_t::serializeTo(CArchive& out) const
{
    out << std::vector<mrpt::math::TLine3D>(lines.begin(), lines.end());
    out.WriteAs<uint32_t>(planes.size());
    for (const auto& p : planes) out << p.plane << p.centroid;
    out.WriteAs<uint32_t>(lines.size());
    for (const auto& l : lines) out << static_cast<const mrpt::math::TLine3D&>(l);
    out.WriteAs<uint32_t>(layers.size());
    for (const auto& [name, layer] : layers)
    {
        if (!layer) throw std::invalid_argument("metric_map_t: layer '" + name + "' is null");
        out << name << *layer;
    }
    out << id << label;
    if (serializeGetVersion() < 5) return;
    out << std::string(GEOREFERENCE);
    out.WriteAs<uint8_t>(0);
    out << false;  // no georeference
    out << has_metadata(metadata);
    if (has_metadata(metadata)) out << metadata_to_text(metadata);
    if (has_fits(*this)) write_fits(*this, out);
}

void metric_map_t::serializeFrom(CArchive& in, uint8_t version)
{
    if (version > 1 && version != 5 && version != WITH_FITS)
        throw bad("version " + std::to_string(version) +
                  " is not supported (only 0, 1, 5 without georeference, and 128)");
    clear();
    std::vector<mrpt::math::TLine3D> first_copy;
    in >> first_copy;
    read_planes(in, planes);
    read_lines_again(in, lines);
    read_layers(in, layers);
    if (version >= 1) in >> id >> label;
    if (version < 5) return;
    read_georeference(in);
    if (in.ReadAs<bool>()) metadata = metadata_from_text(in.ReadAs<std::string>());
    if (version == WITH_FITS) read_fits(in, *this);
}

}  // namespace mp2p_icp
