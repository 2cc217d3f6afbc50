#include <mp2p_icp/errors.h>

#include "cloud_readers.h"
#include "scalar_types.h"

namespace mp2p_icp
{
RawCloud read_kitti(const std::string& source, std::string_view bytes)
{
    constexpr size_t record = 4 * sizeof(float);
    if (bytes.size() % record != 0)
        throw DataError(source, place_byte(bytes.size() - bytes.size() % record),
                        "a KITTI record of 16 bytes (x, y, z, intensity as floats)",
                        std::to_string(bytes.size() % record) + " bytes");
    RawCloudBuilder builder(source, "", {{"x"}, {"y"}, {"z"}, {"intensity"}});
    builder.reserve(bytes.size() / record, bytes.size());
    double values[4];
    for (size_t at = 0; at < bytes.size(); at += record)
    {
        for (size_t k = 0; k < 4; k++)
            values[k] =
                load_scalar(ScalarType::F32, bytes.data() + at + k * sizeof(float), is_big_endian_machine());
        builder.add_row(values);
    }
    return builder.finish("KITTI .bin");
}

}  // namespace mp2p_icp
