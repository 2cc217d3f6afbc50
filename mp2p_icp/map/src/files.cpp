#include "files.h"

#include <mp2p_icp/errors.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace mp2p_icp
{
namespace fs = std::filesystem;

std::string read_whole_file(const std::string& path)
{
    std::error_code error;
    const auto status = fs::status(path, error);
    if (status.type() == fs::file_type::not_found) throw DataError(path, "there is no such file");
    if (error) throw DataError(path, "cannot be read: " + error.message());
    if (fs::is_directory(status)) throw DataError(path, "is a directory, not a file");
    if (!fs::is_regular_file(status)) throw DataError(path, "is not a regular file");

    const uint64_t size = fs::file_size(path, error);
    if (error) throw DataError(path, "cannot be read: " + error.message());
    if (size == 0) throw DataError(path, "the file is empty");
    if (size > READ_CONTENT_CAP_BYTES)
        throw DataError(path, "", "at most " + std::to_string(READ_CONTENT_CAP_BYTES) + " bytes",
                        std::to_string(size));

    std::ifstream in(path, std::ios::binary);
    if (!in) throw DataError(path, std::string("cannot be opened: ") + std::strerror(errno));
    std::string bytes(size, '\0');
    in.read(bytes.data(), static_cast<std::streamsize>(size));
    if (static_cast<uint64_t>(in.gcount()) != size)
        throw DataError(path, place_byte(static_cast<uint64_t>(in.gcount())), std::to_string(size) + " bytes",
                        "a read error");
    return bytes;
}

void write_whole_file(const std::string& path, std::string_view bytes)
{
    errno = 0;
    std::ofstream out(path, std::ios::binary | std::ios::trunc);
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    out.close();
    if (!out)
        throw DataError(
            path, std::string("cannot be written") + (errno ? std::string(": ") + std::strerror(errno) : ""));
}

namespace
{
std::string lower_suffix(const fs::path& path)
{
    std::string s = path.extension().string();
    std::transform(s.begin(), s.end(), s.begin(), [](unsigned char c) { return std::tolower(c); });
    return s;
}
}  // namespace

bool has_gz_suffix(const std::string& path)
{
    return lower_suffix(path) == ".gz";
}

std::string suffix_of(const std::string& path)
{
    const fs::path p(path);
    return has_gz_suffix(path) ? lower_suffix(p.stem()) : lower_suffix(p);
}

}  // namespace mp2p_icp
