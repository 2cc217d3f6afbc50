#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>

namespace mp2p_icp_test
{
/// Chromium without a window, or empty where none is installed.
inline std::string browser()
{
    std::stringstream path(std::getenv("PATH") ? std::getenv("PATH") : "");
    for (std::string folder; std::getline(path, folder, ':');)
        for (const char* name : {"chromium-headless-shell", "chromium", "google-chrome"})
            if (std::filesystem::exists(folder + "/" + name)) return folder + "/" + name;
    return {};
}

struct BrowserRun
{
    std::string page;     ///< as it stood at the end
    std::string console;  ///< what it wrote there, messages of errors too
};

/// Opens a page in a browser, lets it run for some seconds of its own time, and takes a screenshot if wanted.
inline BrowserRun open_in_browser(const std::string& html_path, const std::string& screenshot = {},
                                  int virtual_ms = 1000)
{
    const std::string log = html_path + ".log", profile = html_path + ".profile";
    const std::string command =
        "timeout 60 " + browser() + " --headless --disable-gpu --hide-scrollbars --window-size=1000,900" +
        (geteuid() == 0 ? " --no-sandbox" : "") + " --user-data-dir='" + profile +
        "' --enable-logging=stderr --virtual-time-budget=" + std::to_string(virtual_ms) + " " +
        (screenshot.empty() ? std::string("--dump-dom") : "--screenshot='" + screenshot + "'") + " 'file://" +
        html_path + "' 2>'" + log + "'";
    BrowserRun out;
    FILE* pipe = popen(command.c_str(), "r");
    if (!pipe) throw std::runtime_error("cannot start the browser");
    std::array<char, 4096> buffer;
    while (const size_t n = std::fread(buffer.data(), 1, buffer.size(), pipe))
        out.page.append(buffer.data(), n);
    EXPECT_EQ(pclose(pipe), 0) << command;
    std::ifstream in(log);
    for (std::string line; std::getline(in, line);)
        if (line.find("CONSOLE") != std::string::npos) out.console += line + "\n";
    std::filesystem::remove(log);
    std::filesystem::remove_all(profile);
    return out;
}
}  // namespace mp2p_icp_test

#define MP2P_ICP_SKIP_WITHOUT_BROWSER()   \
    if (mp2p_icp_test::browser().empty()) \
    GTEST_SKIP() << "Chromium is absent (package chromium-headless-shell)"
