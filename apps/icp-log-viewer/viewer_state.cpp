#include "viewer_state.h"

#include <mp2p_icp/numbers.h>
#include <mp2p_icp/yaml_tools.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace mp2p_icp_apps
{
namespace
{
/// The text of a key; empty if it is not there.
std::string text_at(const mp2p_icp::yaml& file, const std::string& key)
{
    const auto& map = file.asMap();
    const auto it = map.find(key);
    return it == map.end() ? std::string() : mp2p_icp::scalar_text(it->second, {});
}

void read_number(const mp2p_icp::yaml& file, const char* key, double lowest, double highest, double& value)
{
    const auto number = mp2p_icp::to_number(text_at(file, key));
    if (number && *number >= lowest && *number <= highest) value = *number;
}
void read_number(const mp2p_icp::yaml& file, const char* key, int lowest, int highest, int& value)
{
    double number = value;
    read_number(file, key, double(lowest), double(highest), number);
    value = static_cast<int>(number);
}
void read_flag(const mp2p_icp::yaml& file, const char* key, bool& value)
{
    const std::string text = text_at(file, key);
    if (text == "true" || text == "false") value = text == "true";
}

const char* flag_text(bool value)
{
    return value ? "true" : "false";
}
}  // namespace

std::string viewer_state_path()
{
    const char *config = std::getenv("XDG_CONFIG_HOME"), *home = std::getenv("HOME");
    if (config && *config) return std::string(config) + "/mp2p_icp/icp-log-viewer.yaml";
    if (home && *home) return std::string(home) + "/.config/mp2p_icp/icp-log-viewer.yaml";
    return {};
}

ViewerState load_viewer_state(const std::string& path)
{
    ViewerState s;
    std::error_code ignored;
    if (path.empty() || !std::filesystem::exists(path, ignored)) return s;
    try
    {
        const auto file = mp2p_icp::yaml_from_file(path);
        if (!file.isMap()) return s;
        read_number(file, "width", 400, 8192, s.width);
        read_number(file, "height", 300, 8192, s.height);
        double point_size = s.point_size;
        read_number(file, "point_size", 1.0, 20.0, point_size);
        s.point_size = static_cast<float>(point_size);
        if (const auto color = text_at(file, "color"); color == "height" || color == "residual")
            s.color = color;
        read_flag(file, "pairings", s.pairings);
        read_flag(file, "frames", s.frames);
        read_flag(file, "covariance", s.covariance);
        read_flag(file, "orthographic", s.orthographic);
        read_number(file, "tab", 0, 20, s.tab);
    }
    catch (const std::exception&)
    {
        // A damaged file of preferences is not worth a complaint: it is written anew at the end.
    }
    return s;
}

bool save_viewer_state(const ViewerState& s, const std::string& path)
{
    if (path.empty()) return false;
    std::error_code ignored;
    std::filesystem::create_directories(std::filesystem::path(path).parent_path(), ignored);
    std::ofstream file(path);
    file << "width: " << s.width << "\nheight: " << s.height
         << "\npoint_size: " << mp2p_icp::to_text(s.point_size) << "\ncolor: " << s.color
         << "\npairings: " << flag_text(s.pairings) << "\nframes: " << flag_text(s.frames)
         << "\ncovariance: " << flag_text(s.covariance) << "\northographic: " << flag_text(s.orthographic)
         << "\ntab: " << s.tab << "\n";
    file.close();
    return static_cast<bool>(file);
}

}  // namespace mp2p_icp_apps
