#pragma once

#include <string>
#include <vector>

namespace mp2p_icp_apps::experiments
{
/// Writes YAML in block style, top to bottom. Every open_*() needs its close().
class YamlWriter
{
 public:
    void open_map(const std::string& key);
    void open_list(const std::string& key);
    void open_item();  ///< of a list: a map
    void close();

    void value(const std::string& key, double number);
    void value(const std::string& key, size_t number);
    void value(const std::string& key, const std::string& text);
    void value(const std::string& key, const char* text) { value(key, std::string(text)); }
    void list(const std::string& key, const std::vector<std::string>& texts);
    /// A map on one line.
    void numbers(const std::string& key, const std::vector<std::pair<std::string, double>>& values);

    const std::string& text() const { return text_; }

 private:
    void line(const std::string& content);

    std::string text_;
    size_t indent_ = 0;
    bool item_begins_ = false;  ///< the next line gets the dash
};

}  // namespace mp2p_icp_apps::experiments
