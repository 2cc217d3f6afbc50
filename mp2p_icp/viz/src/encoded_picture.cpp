#include "encoded_picture.h"

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace mp2p_icp
{
namespace
{
/// A new empty file that is gone in the end.
class TemporaryPng
{
 public:
    TemporaryPng() : path_((std::filesystem::temp_directory_path() / "mp2p_icp-XXXXXX.png").string())
    {
        const int file = mkstemps(path_.data(), 4);
        if (file < 0) throw std::runtime_error("cannot make a temporary file '" + path_ + "'");
        close(file);
    }
    ~TemporaryPng() { std::remove(path_.c_str()); }
    TemporaryPng(const TemporaryPng&) = delete;
    TemporaryPng& operator=(const TemporaryPng&) = delete;

    const std::string& path() const { return path_; }

 private:
    std::string path_;
};
}  // namespace

std::string encoded_png(const mrpt::img::CImage& image)
{
    if (image.isEmpty()) throw std::invalid_argument("encoded_png: the picture is empty");
    const TemporaryPng file;  // MRPT encodes into files only
    if (!image.saveToFile(file.path())) throw std::runtime_error("cannot encode a picture as PNG");
    std::ifstream in(file.path(), std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

}  // namespace mp2p_icp
