#include <mp2p_icp/errors.h>
#include <mp2p_icp/numbers.h>
#include <mp2p_icp/synthetic/load_obj_mesh.h>
#include <mp2p_icp/synthetic/load_ply_mesh.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>

namespace mp2p_icp::synthetic
{
namespace
{
/// A kind of number: its bytes, and whether they are an integer with a sign, without, or a float.
struct PlyType
{
    size_t size;
    enum
    {
        Signed,
        Unsigned,
        Float
    } kind;
};
const std::map<std::string, PlyType> PLY_TYPES = {
    {"char", {1, PlyType::Signed}},     {"int8", {1, PlyType::Signed}},
    {"uchar", {1, PlyType::Unsigned}},  {"uint8", {1, PlyType::Unsigned}},
    {"short", {2, PlyType::Signed}},    {"int16", {2, PlyType::Signed}},
    {"ushort", {2, PlyType::Unsigned}}, {"uint16", {2, PlyType::Unsigned}},
    {"int", {4, PlyType::Signed}},      {"int32", {4, PlyType::Signed}},
    {"uint", {4, PlyType::Unsigned}},   {"uint32", {4, PlyType::Unsigned}},
    {"float", {4, PlyType::Float}},     {"float32", {4, PlyType::Float}},
    {"double", {8, PlyType::Float}},    {"float64", {8, PlyType::Float}}};

struct PlyProperty
{
    std::string name;
    PlyType type{};                  ///< of a list: of its items
    const PlyType* count = nullptr;  ///< of a list: of its length
};

struct PlyElement
{
    std::string name;
    double count = 0;
    std::vector<PlyProperty> properties;
};

/// The numbers of a PLY file, one after the other.
class PlyReader
{
 public:
    PlyReader(std::istream& in, const std::string& source) : in_(in), source_(source) { read_header(); }

    const std::vector<PlyElement>& elements() const { return elements_; }

    /// The values of a property: one, or those of a list.
    void read(const PlyProperty& property, std::vector<double>& values)
    {
        const double count = property.count ? number(*property.count) : 1;
        if (!(count >= 0)) fail("the length of a list", std::to_string(count));
        values.clear();
        for (double i = 0; i < count; i++) values.push_back(number(property.type));
    }
    [[noreturn]] void fail(const std::string& expected, const std::string& found) const
    {
        throw DataError(source_, "", expected, found);
    }

 private:
    void read_header()
    {
        std::string text;
        if (!std::getline(in_, text) || text.rfind("ply", 0) != 0) fail("`ply`", "`" + text + "`");
        while (std::getline(in_, text))
        {
            std::istringstream line(text);
            std::string keyword;
            line >> keyword;
            if (keyword == "end_header") return;
            if (keyword == "format") read_format(line);
            if (keyword == "element") read_element(line);
            if (keyword == "property") read_property(line);
        }
        fail("`end_header`", "the end of the file");
    }
    void read_format(std::istringstream& line)
    {
        std::string format;
        line >> format;
        ascii_ = format == "ascii", big_endian_ = format == "binary_big_endian";
        if (!ascii_ && !big_endian_ && format != "binary_little_endian")
            fail("a PLY format", "`" + format + "`");
    }
    void read_element(std::istringstream& line)
    {
        PlyElement element;
        if (!(line >> element.name >> element.count) || element.count < 0)
            fail("`element NAME COUNT`", "`" + line.str() + "`");
        elements_.push_back(element);
    }
    void read_property(std::istringstream& line)
    {
        PlyProperty property;
        std::string type;
        line >> type;
        if (type == "list")
        {
            line >> type;
            property.count = &type_of(type);
            line >> type;
        }
        property.type = type_of(type);
        if (!(line >> property.name) || elements_.empty())
            fail("the property of an element", "`" + line.str() + "`");
        elements_.back().properties.push_back(property);
    }
    const PlyType& type_of(const std::string& name) const
    {
        const auto type = PLY_TYPES.find(name);
        if (type == PLY_TYPES.end()) fail("a type of numbers", "`" + name + "`");
        return type->second;
    }

    double number(const PlyType& type)
    {
        if (!ascii_) return binary_number(type);
        std::string word;
        in_ >> word;
        const auto value = to_number(word);
        if (!value) fail("a number", word.empty() ? "the end of the file" : "`" + word + "`");
        return *value;
    }
    double binary_number(const PlyType& type)
    {
        unsigned char bytes[8] = {};
        if (!in_.read(reinterpret_cast<char*>(bytes), static_cast<std::streamsize>(type.size)))
            fail("a number", "the end of the file");
        if (!big_endian_) std::reverse(bytes, bytes + type.size);
        uint64_t bits = 0;
        for (size_t i = 0; i < type.size; i++) bits = bits << 8 | bytes[i];
        if (type.kind == PlyType::Unsigned) return static_cast<double>(bits);
        if (type.kind == PlyType::Signed)
        {
            const double range = std::ldexp(1.0, static_cast<int>(8 * type.size));
            const auto value = static_cast<double>(bits);
            return value < range / 2 ? value : value - range;
        }
        return type.size == 4 ? float_of(static_cast<uint32_t>(bits)) : double_of(bits);
    }
    static double float_of(uint32_t bits)
    {
        float value = 0;
        std::memcpy(&value, &bits, sizeof(value));
        return static_cast<double>(value);
    }
    static double double_of(uint64_t bits)
    {
        double value = 0;
        std::memcpy(&value, &bits, sizeof(value));
        return value;
    }

    std::istream& in_;
    std::string source_;
    bool ascii_ = true, big_endian_ = false;
    std::vector<PlyElement> elements_;
};

void read_vertex(const PlyElement& element, PlyReader& reader, TriangleMesh& mesh)
{
    std::map<std::string, double> coordinates;
    std::vector<double> values;
    for (const auto& property : element.properties)
    {
        reader.read(property, values);
        if (!property.count) coordinates[property.name] = values[0];
    }
    for (const char* name : {"x", "y", "z"})
        if (!coordinates.count(name) || !std::isfinite(coordinates[name]))
            reader.fail("finite x, y and z of vertex " + std::to_string(mesh.vertices.size()), "other ones");
    mesh.vertices.emplace_back(coordinates["x"], coordinates["y"], coordinates["z"]);
}

void append_fan(const std::vector<double>& corners, const PlyReader& reader, TriangleMesh& mesh)
{
    if (corners.size() < 3)
        reader.fail("a face of three or more corners", std::to_string(corners.size()) + " corners");
    for (const double c : corners)
        if (!(c >= 0 && c < static_cast<double>(mesh.vertices.size()) && c == std::floor(c)))
            reader.fail("the number of one of the " + std::to_string(mesh.vertices.size()) + " vertices",
                        std::to_string(c));
    const auto corner = [&](size_t i) { return static_cast<uint32_t>(corners[i]); };
    for (size_t i = 2; i < corners.size(); i++)
        mesh.triangles.push_back({corner(0), corner(i - 1), corner(i)});
}

void read_face(const PlyElement& element, PlyReader& reader, TriangleMesh& mesh)
{
    std::vector<double> values;
    for (const auto& property : element.properties)
    {
        reader.read(property, values);
        if (property.name == "vertex_indices" || property.name == "vertex_index")
            append_fan(values, reader, mesh);
    }
}

void skip(const PlyElement& element, PlyReader& reader)
{
    std::vector<double> values;
    for (const auto& property : element.properties) reader.read(property, values);
}
}  // namespace

TriangleMesh read_ply_mesh(std::istream& in, const std::string& source)
{
    PlyReader reader(in, source);
    TriangleMesh mesh;
    for (const auto& element : reader.elements())
        for (double i = 0; i < element.count && !element.properties.empty(); i++)
            if (element.name == "vertex")
                read_vertex(element, reader, mesh);
            else if (element.name == "face")
                read_face(element, reader, mesh);
            else
                skip(element, reader);
    if (mesh.triangles.empty()) throw DataError(source, "", "a PLY file with faces", "no face");
    return mesh;
}

TriangleMesh load_ply_mesh(const std::string& path)
{
    std::ifstream file(path, std::ios::binary);
    if (!file) throw DataError(path, "the file cannot be opened");
    return read_ply_mesh(file, path);
}

TriangleMesh load_mesh(const std::string& path)
{
    std::ifstream file(path, std::ios::binary);
    char start[3] = {};
    file.read(start, 3);
    return std::string(start, 3) == "ply" ? load_ply_mesh(path) : load_obj_mesh(path);
}

}  // namespace mp2p_icp::synthetic
