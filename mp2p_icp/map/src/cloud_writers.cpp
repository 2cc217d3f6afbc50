#include "cloud_writers.h"

#include <mrpt/maps/CColouredPointsMap.h>
#include <mrpt/maps/CPointsMapXYZI.h>

#include <charconv>
#include <cmath>

#include "RawCloud.h"
#include "cloud_layer.h"
#include "scalar_types.h"

namespace mp2p_icp
{
using mrpt::math::TPoint3D;

namespace
{
/// Colours as bytes if that loses nothing (they were bytes once), else as floats.
enum class ColourForm
{
    None,
    Bytes,
    Floats
};

uint8_t to_byte(float c)
{
    return c >= 0 && c <= 1 ? static_cast<uint8_t>(std::lround(c * 255.f)) : uint8_t(0);
}

bool is_byte(float c)
{
    return static_cast<float>(to_byte(c)) / 255.f == c;
}

/// A cloud with what its class has besides coordinates.
class CloudView
{
 public:
    CloudView(const mrpt::maps::CPointsMap& points, const TPoint3D& offset)
        : x_(points.getPointsBufferRef_x()),
          y_(points.getPointsBufferRef_y()),
          z_(points.getPointsBufferRef_z()),
          intensity_(dynamic_cast<const mrpt::maps::CPointsMapXYZI*>(&points)),
          colour_(dynamic_cast<const mrpt::maps::CColouredPointsMap*>(&points)),
          offset_(offset)
    {
        if (!colour_) return;
        form_ = ColourForm::Bytes;
        for (size_t i = 0; i < size(); i++)
            for (const float c : rgb(i))
                if (!is_byte(c)) form_ = ColourForm::Floats;
    }

    size_t size() const { return x_.size(); }
    bool has_offset() const { return offset_ != TPoint3D(0, 0, 0); }
    bool has_intensity() const { return intensity_ != nullptr; }
    ColourForm colour_form() const { return form_; }

    std::array<float, 3> stored(size_t i) const { return {x_[i], y_[i], z_[i]}; }
    std::array<double, 3> moved(size_t i) const
    {
        return {x_[i] + offset_.x, y_[i] + offset_.y, z_[i] + offset_.z};
    }
    float intensity(size_t i) const { return intensity_ ? intensity_->getPointIntensity_fast(i) : 0.f; }
    std::array<float, 3> rgb(size_t i) const
    {
        float x, y, z;
        std::array<float, 3> c = {};
        colour_->getPointRGB(i, x, y, z, c[0], c[1], c[2]);
        return c;
    }

    /// Without this note in a file, the reader would choose another offset. Empty where it would choose none.
    std::string offset_comment() const
    {
        bool far = has_offset();
        for (size_t i = 0; i < size() && !far; i++)
            for (const float c : stored(i)) far = far || std::abs(c) > FAR_AWAY;
        return far ? offset_as_comment(offset_) : std::string();
    }

 private:
    const mrpt::aligned_std_vector<float>&x_, &y_, &z_;
    const mrpt::maps::CPointsMapXYZI* intensity_;
    const mrpt::maps::CColouredPointsMap* colour_;
    TPoint3D offset_;
    ColourForm form_ = ColourForm::None;
};

template <class T>
void append_le(std::string& out, T value)
{
    char bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    if (is_big_endian_machine()) std::reverse(bytes, bytes + sizeof(T));
    out.append(bytes, sizeof(T));
}

void append_coordinates(std::string& out, const CloudView& c, size_t i)
{
    if (c.has_offset())
        for (const double v : c.moved(i)) append_le(out, v);
    else
        for (const float v : c.stored(i)) append_le(out, v);
}

/// \param digits enough for the same bits to be read back: 9 for float, 17 for double
template <class T>
void append_number(std::string& out, T value, int digits)
{
    char text[64];
    const auto end = std::to_chars(text, text + sizeof(text), value, std::chars_format::general, digits).ptr;
    out.append(text, static_cast<size_t>(end - text));
}
}  // namespace

std::string write_ply(const mrpt::maps::CPointsMap& points, const TPoint3D& offset)
{
    const CloudView c(points, offset);
    const std::string type = c.has_offset() ? "double" : "float";
    std::string out = "ply\nformat binary_little_endian 1.0\n";
    if (const auto comment = c.offset_comment(); !comment.empty()) out += "comment " + comment + "\n";
    out += "element vertex " + std::to_string(c.size()) + "\n";
    for (const char axis : {'x', 'y', 'z'}) out += "property " + type + " " + axis + "\n";
    if (c.has_intensity()) out += "property float intensity\n";
    const bool bytes = c.colour_form() == ColourForm::Bytes;
    if (c.colour_form() != ColourForm::None)
        for (const auto* name : {"red", "green", "blue"})
            out += std::string("property ") + (bytes ? "uchar " : "float ") + name + "\n";
    out += "end_header\n";
    for (size_t i = 0; i < c.size(); i++)
    {
        append_coordinates(out, c, i);
        if (c.has_intensity()) append_le(out, c.intensity(i));
        if (c.colour_form() == ColourForm::None) continue;
        for (const float v : c.rgb(i)) bytes ? append_le(out, to_byte(v)) : append_le(out, v);
    }
    return out;
}

namespace
{
std::string pcd_header(const CloudView& c)
{
    const bool bytes = c.colour_form() == ColourForm::Bytes, floats = c.colour_form() == ColourForm::Floats;
    const std::string size = c.has_offset() ? "8" : "4", n = std::to_string(c.size());
    std::string fields = "x y z", sizes = size + " " + size + " " + size, types = "F F F", counts = "1 1 1";
    const auto add = [&](const std::string& field, const char* type)
    { fields += " " + field, sizes += " 4", types += std::string(" ") + type, counts += " 1"; };
    if (c.has_intensity()) add("intensity", "F");
    if (bytes) add("rgb", "U");
    if (floats)
        for (const auto* name : {"r", "g", "b"}) add(name, "F");
    std::string out = "# .PCD v0.7 - Point Cloud Data file format\n";
    if (const auto comment = c.offset_comment(); !comment.empty()) out += "# " + comment + "\n";
    out += "VERSION 0.7\nFIELDS " + fields + "\nSIZE " + sizes + "\nTYPE " + types + "\nCOUNT " + counts;
    return out + "\nWIDTH " + n + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + n + "\nDATA binary\n";
}
}  // namespace

std::string write_pcd(const mrpt::maps::CPointsMap& points, const TPoint3D& offset)
{
    const CloudView c(points, offset);
    std::string out = pcd_header(c);
    for (size_t i = 0; i < c.size(); i++)
    {
        append_coordinates(out, c, i);
        if (c.has_intensity()) append_le(out, c.intensity(i));
        if (c.colour_form() == ColourForm::None) continue;
        const auto rgb = c.rgb(i);
        if (c.colour_form() == ColourForm::Floats)
            for (const float v : rgb) append_le(out, v);
        else
            append_le(out,
                      uint32_t(to_byte(rgb[0])) << 16 | uint32_t(to_byte(rgb[1])) << 8 | to_byte(rgb[2]));
    }
    return out;
}

std::string write_text_points(const mrpt::maps::CPointsMap& points, const TPoint3D& offset, char separator,
                              bool header)
{
    const CloudView c(points, offset);
    std::string out;
    if (const auto comment = c.offset_comment(); !comment.empty()) out += "# " + comment + "\n";
    std::string names = "x,y,z";
    if (c.has_intensity()) names += ",intensity";
    if (c.colour_form() != ColourForm::None) names += ",r,g,b";
    if (header) out += names + "\n";
    const auto separate = [&] { out += separator; };
    for (size_t i = 0; i < c.size(); i++)
    {
        for (size_t k = 0; k < 3; k++)
        {
            if (k > 0) separate();
            if (c.has_offset())
                append_number(out, c.moved(i)[k], 17);
            else
                append_number(out, c.stored(i)[k], 9);
        }
        if (c.has_intensity()) separate(), append_number(out, c.intensity(i), 9);
        if (c.colour_form() != ColourForm::None)
            for (const float v : c.rgb(i))
            {
                separate();
                if (c.colour_form() == ColourForm::Bytes)
                    out += std::to_string(to_byte(v));
                else
                    append_number(out, v, 9);
            }
        out += '\n';
    }
    return out;
}

std::string write_kitti(const mrpt::maps::CPointsMap& points)
{
    const CloudView c(points, {0, 0, 0});
    std::string out;
    out.reserve(c.size() * 16);
    for (size_t i = 0; i < c.size(); i++)
    {
        append_coordinates(out, c, i);
        append_le(out, c.intensity(i));
    }
    return out;
}

}  // namespace mp2p_icp
