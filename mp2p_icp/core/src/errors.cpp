#include <mp2p_icp/errors.h>

namespace mp2p_icp
{
DataError::DataError(const std::string& source, const std::string& place, const std::string& expected,
                     const std::string& found)
    : std::runtime_error(source + (place.empty() ? "" : ", " + place) + ": expected " + expected +
                         ", found " + found)
{
}

DataError::DataError(const std::string& source, const std::string& problem)
    : std::runtime_error(source + ": " + problem)
{
}

std::string place_byte(uint64_t offset)
{
    return "byte " + std::to_string(offset);
}
std::string place_line(uint64_t line)
{
    return "line " + std::to_string(line);
}

std::string short_reason(const std::exception& e)
{
    std::string text = e.what();
    // MRPT's exceptions are several lines: a banner, "Message:  ...", "Location: ...", a call stack.
    const std::string tag = "Message:";
    if (const auto at = text.find(tag); at != std::string::npos) text = text.substr(at + tag.size());
    const char* const spaces = " \t\r\n";
    const auto first = text.find_first_not_of(spaces);
    if (first == std::string::npos) return "unknown error";
    text = text.substr(first, text.find_first_of("\r\n", first) - first);
    return text.substr(0, text.find_last_not_of(spaces) + 1);
}

}  // namespace mp2p_icp
