#include "debug_file.h"

#include <fcntl.h>
#include <mp2p_icp/archive_file.h>
#include <mp2p_icp/errors.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <vector>

namespace mp2p_icp
{
namespace
{
/// A text as part of a file's name: no separators, nothing that cannot be seen, and not too long.
std::string as_part_of_name(std::string text)
{
    constexpr size_t longest = 60;
    text.resize(std::min(text.size(), longest));
    for (char& c : text)
        if (c == '/' || c == '\\' || c == ':' || static_cast<unsigned char>(c) <= ' ' || c == 127) c = '_';
    return text;
}

using Tokens = std::vector<std::pair<std::string, std::string>>;

Tokens tokens_of(const LogRecord& log)
{
    const auto id = [](const metric_map_t& m) { return m.id ? std::to_string(*m.id) : std::string(); };
    const auto label = [](const metric_map_t& m) { return as_part_of_name(m.label.value_or("")); };
    return {{"$LOCAL_ID", id(*log.pcLocal)},
            {"$LOCAL_LABEL", label(*log.pcLocal)},
            {"$GLOBAL_ID", id(*log.pcGlobal)},
            {"$GLOBAL_LABEL", label(*log.pcGlobal)}};
}

/// In one pass: a label that looks like a token stays as it is.
std::string with_tokens_replaced(const std::string& format, const Tokens& tokens)
{
    std::string out;
    for (size_t at = 0; at < format.size();)
    {
        const auto token =
            std::find_if(tokens.begin(), tokens.end(),
                         [&](const auto& t) { return format.compare(at, t.first.size(), t.first) == 0; });
        if (token == tokens.end())
            out += format[at++];
        else
            out += token->second, at += token->first.size();
    }
    return out;
}

/// Makes the file, empty. \return false if there is one already.
bool claim(const std::string& name)
{
    const int file = open(name.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0666);
    if (file >= 0) return close(file), true;
    if (errno == EEXIST) return false;
    throw DataError(name, std::string("cannot be written: ") + std::strerror(errno));
}

void make_folder_of(const std::string& name)
{
    std::error_code error;
    const auto folder = std::filesystem::path(name).parent_path();
    if (!folder.empty()) std::filesystem::create_directories(folder, error);
    if (error) throw DataError(name, "cannot be written: " + error.message());
}

std::atomic<uint64_t> next_unique_id{0};

std::string number_text(uint64_t number)
{
    char text[24];
    std::snprintf(text, sizeof(text), "%05llu", static_cast<unsigned long long>(number));
    return text;
}

/// The name of the file, which is there, empty, if it is this log's own.
std::string name_for(const LogRecord& log)
{
    const std::string& format = log.icpParameters.debugFileNameFormat;
    Tokens tokens = tokens_of(log);
    tokens.emplace_back("$UNIQUE_ID", "");
    while (true)
    {
        tokens.back().second = number_text(next_unique_id++);
        const std::string name = with_tokens_replaced(format, tokens);
        make_folder_of(name);
        if (format.find("$UNIQUE_ID") == std::string::npos || claim(name)) return name;
    }
}
}  // namespace

void write_debug_file(const LogRecord& log)
{
    const std::string name = name_for(log);
    // Whoever reads meanwhile, or writes a file of the same name, finds a whole one.
    const std::string unfinished =
        name + "." + std::to_string(getpid()) + "-" + number_text(next_unique_id++);
    try
    {
        write_archive_file(unfinished, log);
        std::filesystem::rename(unfinished, name);
    }
    catch (...)
    {
        std::error_code ignored;
        std::filesystem::remove(unfinished, ignored);
        throw;
    }
}

}  // namespace mp2p_icp
