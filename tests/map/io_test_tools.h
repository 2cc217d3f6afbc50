#pragma once

#include <gtest/gtest.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/load_map.h>
#include <mrpt/maps/CColouredPointsMap.h>
#include <mrpt/maps/CPointsMapXYZI.h>
#include <mrpt/maps/CSimplePointsMap.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "test_data.h"

/// What the tests of reading and writing share.
namespace mp2p_icp_test
{
/// A file that is gone after the test.
class TempFile
{
 public:
    explicit TempFile(const std::string& suffix, const std::string& bytes = "") : path_(temp_path(suffix))
    {
        std::ofstream(path_, std::ios::binary | std::ios::trunc) << bytes;
    }
    ~TempFile() { std::filesystem::remove(path_); }
    TempFile(const TempFile&) = delete;
    TempFile& operator=(const TempFile&) = delete;
    const std::string& path() const { return path_; }

 private:
    std::string path_;
};

inline std::string bytes_of_file(const std::string& path)
{
    std::ifstream in(path, std::ios::binary);
    std::stringstream all;
    all << in.rdbuf();
    return all.str();
}

/// gzip by zlib's own file functions: an encoder and decoder that the library does not use.
inline std::string gunzipped(const std::string& path)
{
    const gzFile f = gzopen(path.c_str(), "rb");
    std::string all;
    char buffer[65536];
    for (int n; (n = gzread(f, buffer, sizeof(buffer))) > 0;) all.append(buffer, static_cast<size_t>(n));
    gzclose(f);
    return all;
}
inline std::string gzipped(const std::string& bytes)
{
    const TempFile temp(".gz_tool");
    const gzFile f = gzopen(temp.path().c_str(), "wb");
    gzwrite(f, bytes.data(), static_cast<unsigned>(bytes.size()));
    gzclose(f);
    return bytes_of_file(temp.path());
}

inline mp2p_icp::LoadedMap load_bytes(const std::string& bytes, const std::string& suffix,
                                      const mp2p_icp::LoadOptions& options = {})
{
    const TempFile file(suffix, bytes);
    return mp2p_icp::load_map(file.path(), options);
}

/// The text of the DataError that loading ends with, the path replaced by `FILE`; `no error` if there is
/// none.
inline std::string error_of_path(const std::string& path)
{
    try
    {
        mp2p_icp::load_map(path);
        return "no error";
    }
    catch (const mp2p_icp::DataError& e)
    {
        std::string text = e.what();
        if (const auto at = text.find(path); at != std::string::npos) text.replace(at, path.size(), "FILE");
        return text;
    }
}
inline std::string error_of_bytes(const std::string& bytes, const std::string& suffix)
{
    const TempFile file(suffix, bytes);
    return error_of_path(file.path());
}

inline bool contains(const std::string& text, const std::string& part)
{
    return text.find(part) != std::string::npos;
}

inline std::string notes_of(const mp2p_icp::LoadReport& report)
{
    std::string all;
    for (const auto& n : report.notes) all += n + "\n";
    return all;
}

inline mrpt::maps::CPointsMap::Ptr raw_layer(const mp2p_icp::LoadedMap& m)
{
    return m.map->point_layer("raw");
}

template <class T>
std::shared_ptr<T> raw_layer_as(const mp2p_icp::LoadedMap& m)
{
    const auto layer = std::dynamic_pointer_cast<T>(raw_layer(m));
    EXPECT_TRUE(layer) << "the layer is a " << raw_layer(m)->GetRuntimeClass()->className;
    return layer;
}

using Rows = std::vector<std::vector<float>>;

/// All fields of all points: x y z, with intensity or r g b where the class has them.
inline Rows rows_of(const mrpt::maps::CPointsMap& points)
{
    Rows rows(points.size());
    for (size_t i = 0; i < points.size(); i++)
    {
        if (dynamic_cast<const mrpt::maps::CSimplePointsMap*>(&points))
        {
            rows[i].resize(3);
            points.getPointFast(i, rows[i][0], rows[i][1], rows[i][2]);
        }
        else
            points.getPointAllFieldsFast(i, rows[i]);
    }
    return rows;
}

inline void expect_same_bits(const Rows& actual, const Rows& expected)
{
    ASSERT_EQ(actual.size(), expected.size());
    for (size_t i = 0; i < actual.size(); i++)
    {
        ASSERT_EQ(actual[i].size(), expected[i].size()) << "point " << i;
        for (size_t k = 0; k < actual[i].size(); k++)
            ASSERT_EQ(std::memcmp(&actual[i][k], &expected[i][k], sizeof(float)), 0)
                << "point " << i << ", field " << k << ": " << actual[i][k] << " instead of "
                << expected[i][k];
    }
}

template <class T>
std::string little_endian(T value)
{
    std::string s(sizeof(T), '\0');
    std::memcpy(s.data(), &value, sizeof(T));
    return s;
}
template <class T>
std::string big_endian(T value)
{
    std::string s = little_endian(value);
    std::reverse(s.begin(), s.end());
    return s;
}
}  // namespace mp2p_icp_test
