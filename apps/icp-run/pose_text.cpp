#include "pose_text.h"

#include <mp2p_icp/errors.h>
#include <mp2p_icp/numbers.h>
#include <mp2p_icp/se3.h>
#include <mrpt/core/bits_math.h>
#include <mrpt/math/wrap2pi.h>

#include <charconv>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <vector>

namespace mp2p_icp_apps
{
using mp2p_icp::DataError;
using mp2p_icp::to_number;
using mp2p_icp::to_text;
using mrpt::math::TPose3D;

// ---- Text -------------------------------------------------------------------------------------------------
namespace
{
const char* const FORM = "\"[x y z yaw_deg pitch_deg roll_deg]\"";

std::vector<std::string> words_of(std::string text, const std::string& separators)
{
    for (char& c : text)
        if (separators.find(c) != std::string::npos) c = ' ';
    std::istringstream in(text);
    std::vector<std::string> words;
    for (std::string word; in >> word;) words.push_back(word);
    return words;
}

std::string without_brackets(const std::string& text)
{
    const auto first = text.find_first_not_of(" \t\n"), last = text.find_last_not_of(" \t\n");
    if (first == std::string::npos) return {};
    const bool opens = text[first] == '[', closes = text[last] == ']';
    if (opens != closes || (opens && first == last))
        throw std::invalid_argument("the brackets of '" + text + "' do not match; expected " + FORM);
    return opens ? text.substr(first + 1, last - first - 1) : text.substr(first, last - first + 1);
}
}  // namespace

TPose3D pose_from_text(const std::string& text)
{
    std::vector<double> numbers;
    for (const auto& word : words_of(without_brackets(text), ","))
    {
        const auto number = to_number(word);
        if (!number) throw std::invalid_argument("'" + word + "' is not a number; expected " + FORM);
        if (!std::isfinite(*number))
            throw std::invalid_argument("'" + word + "' is not finite; expected " + FORM);
        numbers.push_back(*number);
    }
    if (numbers.size() != 6)
        throw std::invalid_argument("expected the 6 numbers " + std::string(FORM) + ", found " +
                                    std::to_string(numbers.size()));
    return {numbers[0],
            numbers[1],
            numbers[2],
            mrpt::DEG2RAD(numbers[3]),
            mrpt::DEG2RAD(numbers[4]),
            mrpt::DEG2RAD(numbers[5])};
}

// ---- A matrix ---------------------------------------------------------------------------------------------
namespace
{
std::string read_start_of_file(const std::string& file_name)
{
    constexpr size_t MOST = 65536;  // a matrix is much shorter, and a wrong file may be huge
    std::ifstream in(file_name, std::ios::binary);
    std::string text(MOST, '\0');
    in.read(text.data(), static_cast<std::streamsize>(MOST));
    if (!in && !in.eof()) throw DataError(file_name, "cannot be read");
    text.resize(static_cast<size_t>(in.gcount()));
    return text;
}

Eigen::Matrix4d matrix_from_file(const std::string& file_name)
{
    const auto words = words_of(read_start_of_file(file_name), "[],;");
    const std::string expected = "a 4x4 matrix: 16 numbers, row by row";
    for (const auto& word : words)
        if (!to_number(word)) throw DataError(file_name, "", expected, "'" + word.substr(0, 20) + "'");
    if (words.size() != 16)
        throw DataError(file_name, "", expected, std::to_string(words.size()) + " numbers");
    Eigen::Matrix4d T;
    for (int i = 0; i < 16; i++) T(i / 4, i % 4) = *to_number(words[static_cast<size_t>(i)]);
    return T;
}

/// The rotation nearest to the matrix (in the least-squares sense).
Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& m)
{
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Matrix3d R = svd.matrixU() * svd.matrixV().transpose();
    if (R.determinant() < 0)
        R = svd.matrixU() * Eigen::Vector3d(1, 1, -1).asDiagonal() * svd.matrixV().transpose();
    return R;
}
}  // namespace

TPose3D pose_from_matrix_file(const std::string& file_name)
{
    constexpr double TOLERANCE = 1e-3;  // files with 4 digits are common
    const Eigen::Matrix4d T = matrix_from_file(file_name);
    if (!T.allFinite()) throw DataError(file_name, "", "finite numbers", "one that is not");
    if ((T.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() > TOLERANCE)
        throw DataError(file_name, "", "0 0 0 1 as the last row of the matrix", "another one");
    const Eigen::Matrix3d m = T.topLeftCorner<3, 3>(), R = nearest_rotation(m);
    if (const double off = (m - R).cwiseAbs().maxCoeff(); off > TOLERANCE)
        throw DataError(file_name, "", "a rotation in the upper left 3x3 part",
                        "a matrix that is off by " + to_text(off));
    return mp2p_icp::make_pose(R, T.topRightCorner<3, 1>()).asTPose();
}

TPose3D pose_from_argument(const std::string& option, const std::string& argument)
{
    std::error_code ignored;
    if (std::filesystem::is_regular_file(argument, ignored)) try
        {
            return pose_from_matrix_file(argument);
        }
        catch (const DataError& e)
        {
            throw std::invalid_argument(option + ": " + e.what());
        }
    try
    {
        return pose_from_text(argument);
    }
    catch (const std::invalid_argument& e)
    {
        throw std::invalid_argument(option + ": " + e.what() + ", or a text file with a 4x4 matrix");
    }
}

// ---- Degrees ----------------------------------------------------------------------------------------------
namespace
{
bool leads_to(double degrees, double radians)
{
    return mrpt::math::wrapToPi(mrpt::DEG2RAD(degrees)) == radians;
}

double rounded_to_digits(double value, int digits)
{
    char text[40];
    const auto end = std::to_chars(text, text + sizeof(text), value, std::chars_format::general, digits).ptr;
    std::from_chars(text, end, value);
    return value;
}
}  // namespace

double degrees_of(double radians)
{
    const double nearest = mrpt::RAD2DEG(radians);
    if (!std::isfinite(nearest)) return nearest;
    for (int digits = 1; digits <= 17; digits++)
        if (const double d = rounded_to_digits(nearest, digits); leads_to(d, radians)) return d;
    // Rounding on the way may also have moved it by some units in the last place.
    double below = nearest, above = nearest;
    for (int steps = 0; steps < 8; steps++)
    {
        below = std::nextafter(below, -INFINITY), above = std::nextafter(above, INFINITY);
        if (leads_to(below, radians)) return below;
        if (leads_to(above, radians)) return above;
    }
    return nearest;
}

}  // namespace mp2p_icp_apps
