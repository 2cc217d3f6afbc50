#include <mp2p_icp/errors.h>
#include <mp2p_icp/numbers.h>
#include <mp2p_icp/synthetic/load_obj_mesh.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

namespace mp2p_icp::synthetic
{
namespace
{
/// One line of the file, for messages.
struct Line
{
    const std::string& source;
    uint64_t number;
    std::istringstream words;

    [[noreturn]] void fail(const std::string& expected, const std::string& found) const
    {
        throw DataError(source, place_line(number), expected, found.empty() ? "nothing" : "`" + found + "`");
    }
};

double coordinate(Line& line)
{
    std::string word;
    line.words >> word;
    const auto value = to_number(word);
    if (!value || !std::isfinite(*value)) line.fail("three finite coordinates", word);
    return *value;
}

/// The vertex that a corner such as `7`, `7/2`, `-1//3` names.
uint32_t corner(const std::string& word, size_t vertex_count, const Line& line)
{
    const auto value = to_number(word.substr(0, word.find('/')));
    const auto count = static_cast<double>(vertex_count);
    if (!value || *value != std::floor(*value)) line.fail("a vertex number", word);
    const double index = *value < 0 ? count + *value : *value - 1;
    if (*value == 0 || index < 0 || index >= count)
        line.fail("the number of one of the " + std::to_string(vertex_count) + " vertices so far", word);
    return static_cast<uint32_t>(index);
}

void append_face(TriangleMesh& mesh, Line& line)
{
    std::vector<uint32_t> corners;
    for (std::string word; line.words >> word;) corners.push_back(corner(word, mesh.vertices.size(), line));
    if (corners.size() < 3)
        line.fail("a face of three or more corners", std::to_string(corners.size()) + " corners");
    for (size_t i = 2; i < corners.size(); i++)
        mesh.triangles.push_back({corners[0], corners[i - 1], corners[i]});
}

/// Joins lines that end with a backslash. Returns the number of lines read: 0 at the end of the file.
uint64_t read_logical_line(std::istream& in, std::string& text)
{
    text.clear();
    uint64_t count = 0;
    for (std::string part; std::getline(in, part);)
    {
        count++;
        if (!part.empty() && part.back() == '\r') part.pop_back();
        const bool continued = !part.empty() && part.back() == '\\';
        if (continued) part.back() = ' ';
        text += part;
        if (!continued) break;
    }
    return count;
}
}  // namespace

TriangleMesh read_obj_mesh(std::istream& in, const std::string& source)
{
    TriangleMesh mesh;
    std::string text;
    uint64_t number = 1;
    for (uint64_t lines = 0; (lines = read_logical_line(in, text)) > 0; number += lines)
    {
        Line line{source, number, std::istringstream(text)};
        std::string keyword;
        line.words >> keyword;
        if (keyword == "v")
        {
            const double x = coordinate(line), y = coordinate(line), z = coordinate(line);
            mesh.vertices.emplace_back(x, y, z);
        }
        else if (keyword == "f")
            append_face(mesh, line);
    }
    if (mesh.triangles.empty()) throw DataError(source, "", "an OBJ file with faces", "no face");
    return mesh;
}

TriangleMesh load_obj_mesh(const std::string& path)
{
    std::ifstream file(path);
    if (!file) throw DataError(path, "the file cannot be opened");
    return read_obj_mesh(file, path);
}

ObjectMesh load_object_mesh(const std::string& path)
{
    ObjectMesh object{load_obj_mesh(path), 0};
    const auto box = object.mesh.bounding_box();
    const mrpt::math::TPoint3D middle = (box.min + box.max) * 0.5, sides = box.max - box.min;
    for (auto& vertex : object.mesh.vertices) vertex -= middle;
    object.size = std::max({sides.x, sides.y, sides.z});
    return object;
}

}  // namespace mp2p_icp::synthetic
