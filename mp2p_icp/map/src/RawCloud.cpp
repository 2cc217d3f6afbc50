#include "RawCloud.h"

#include <mp2p_icp/errors.h>
#include <mp2p_icp/numbers.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "files.h"
#include "text_scan.h"

namespace mp2p_icp
{
namespace
{
std::string lower(std::string s)
{
    std::transform(s.begin(), s.end(), s.begin(), [](unsigned char c) { return std::tolower(c); });
    return s;
}

int find_column(const std::vector<CloudColumn>& columns, const std::vector<std::string>& names)
{
    for (size_t i = 0; i < columns.size(); i++)
        if (!columns[i].is_skipped && std::count(names.begin(), names.end(), lower(columns[i].name)))
            return static_cast<int>(i);
    return -1;
}
}  // namespace

RawCloudBuilder::RawCloudBuilder(const std::string& source, const std::string& place,
                                 const std::vector<CloudColumn>& columns)
    : source_(source)
{
    const char* names[3] = {"x", "y", "z"};
    for (int k = 0; k < 3; k++)
    {
        xyz_[k] = find_column(columns, {names[k]});
        const auto same = [&](const CloudColumn& c) { return !c.is_skipped && lower(c.name) == names[k]; };
        const auto count = std::count_if(columns.begin(), columns.end(), same);
        if (count != 1)
            throw DataError(source, place, std::string("one column '") + names[k] + "'",
                            std::to_string(count));
    }
    intensity_ = find_column(columns, {"intensity", "scalar_intensity", "reflectance", "i"});
    packed_ = find_column(columns, {"rgb", "rgba"});
    const std::vector<std::string> colours[3] = {
        {"red", "r", "diffuse_red"}, {"green", "g", "diffuse_green"}, {"blue", "b", "diffuse_blue"}};
    for (int k = 0; k < 3 && packed_ < 0; k++) colour_[k] = find_column(columns, colours[k]);
    if (std::min({colour_[0], colour_[1], colour_[2]}) < 0) colour_[0] = colour_[1] = colour_[2] = -1;
    if (colour_[0] >= 0) colours_are_integers_ = columns[static_cast<size_t>(colour_[0])].is_integer;
    note_columns_without_place(columns);
}

bool RawCloudBuilder::is_colour(size_t column) const
{
    return std::count(std::begin(colour_), std::end(colour_), static_cast<int>(column)) > 0;
}

void RawCloudBuilder::note_columns_without_place(const std::vector<CloudColumn>& columns)
{
    std::string names;
    for (size_t i = 0; i < columns.size(); i++)
    {
        const int k = static_cast<int>(i);
        const bool used = std::count(xyz_, xyz_ + 3, k) || is_colour(i) || k == intensity_ || k == packed_;
        const bool padding = columns[i].name == "_";  // PCD
        if (!used && !padding) names += (names.empty() ? "" : ", ") + columns[i].name;
    }
    if (!names.empty())
        cloud_.notes.push_back("fields without a place in MRPT's clouds are left out: " + names);
}

void RawCloudBuilder::reserve(uint64_t rows, uint64_t bytes_held)
{
    const uint64_t per_row = sizeof(cloud_.points[0]) + (intensity_ >= 0 ? sizeof(float) : 0) +
                             (has_colours() ? sizeof(cloud_.rgb[0]) : 0);
    if (rows > READ_MEMORY_BUDGET_BYTES / per_row || rows * per_row + bytes_held > READ_MEMORY_BUDGET_BYTES)
        throw DataError(source_,
                        std::to_string(rows) + " points need more than the 2 GB that reading may use");
    cloud_.points.reserve(rows);
    if (intensity_ >= 0) cloud_.intensity.reserve(rows);
    if (has_colours()) cloud_.rgb.reserve(rows);
}

void RawCloudBuilder::add_row(const double* v)
{
    cloud_.points.emplace_back(v[xyz_[0]], v[xyz_[1]], v[xyz_[2]]);
    if (intensity_ >= 0) cloud_.intensity.push_back(static_cast<float>(v[intensity_]));
    if (packed_ >= 0)
    {
        const double p = v[packed_];
        const auto bits = p >= 0 && p <= 4294967295.0 ? static_cast<uint32_t>(p) : 0u;
        const auto channel = [bits](int shift) { return static_cast<float>((bits >> shift) & 0xffu); };
        cloud_.rgb.push_back({channel(16), channel(8), channel(0)});
    }
    else if (colour_[0] >= 0)
    {
        const auto channel = [&](int k) { return static_cast<float>(v[colour_[k]]); };
        cloud_.rgb.push_back({channel(0), channel(1), channel(2)});
    }
}

/// Files hold 0..1, 0..255 or (rarely) 0..65535: whole numbers are never 0..1, others are if none is above 1.
void RawCloudBuilder::scale_colours()
{
    float smallest = 0, largest = 0;
    for (const auto& colour : cloud_.rgb)
        for (const float c : colour)
            if (std::isfinite(c)) smallest = std::min(smallest, c), largest = std::max(largest, c);
    if (smallest < 0)  // six columns may also be positions and normals
    {
        cloud_.rgb = {};
        cloud_.notes.push_back("the colours are left out: some are negative (normals, perhaps)");
        return;
    }
    const float full = !colours_are_integers_ && largest <= 1 ? 1.f : largest <= 255 ? 255.f : 65535.f;
    for (auto& colour : cloud_.rgb)
        for (float& c : colour) c = c > 0 ? std::min(c / full, 1.f) : 0.f;  // NaN: 0
}

RawCloud RawCloudBuilder::finish(const std::string& kind)
{
    scale_colours();
    cloud_.kind = kind;
    return std::move(cloud_);
}

std::optional<mrpt::math::TPoint3D> offset_in_comment(std::string_view comment)
{
    std::vector<std::string_view> words;
    if (!split_words(comment, Separators::Blanks, words) || words.size() != 4 ||
        words[0] != "coordinate_offset")
        return {};
    double xyz[3];
    for (size_t k = 0; k < 3; k++)
    {
        const auto value = parse_number(words[k + 1]);
        if (!value || !std::isfinite(*value) || *value != std::round(*value)) return {};
        xyz[k] = *value;
    }
    return mrpt::math::TPoint3D(xyz[0], xyz[1], xyz[2]);
}

std::string offset_as_comment(const mrpt::math::TPoint3D& o)
{
    return "coordinate_offset " + to_text(o.x) + " " + to_text(o.y) + " " + to_text(o.z);
}

}  // namespace mp2p_icp
