#pragma once

#include <sys/wait.h>

#include <chrono>
#include <cstdlib>
#include <functional>
#include <thread>

#include "run_tools.h"

namespace mp2p_icp_test
{
inline bool has_program(const std::string& name)
{
    return std::system(("command -v " + name + " >/dev/null 2>&1").c_str()) == 0;
}

inline bool wait_until(const std::function<bool()>& condition, double seconds = 30)
{
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    while (std::chrono::steady_clock::now() < end)
    {
        if (condition()) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    return condition();
}

inline std::string text_of(const std::string& path)
{
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

/// A program that runs in the background; ended when this goes.
class Background
{
 public:
    /// \param command of a shell, without redirections
    Background(const Folder& folder, const std::string& name, const std::string& command)
        : base_(folder.path(name))
    {
        const std::string started =
            "sh -c 'echo $$ >" + base_ + ".pid; exec " + command + "' >" + base_ + ".out 2>" + base_ + ".err";
        EXPECT_EQ(std::system(("( " + started + "; echo $? >" + base_ + ".rc ) &").c_str()), 0);
        wait_until([this] { return contains(text_of(base_ + ".pid"), "\n"); });
    }
    ~Background()
    {
        if (!ended()) (void)!std::system(("kill " + text_of(base_ + ".pid")).c_str());
        wait_until([this] { return ended(); }, 10);
    }
    bool ended() const { return contains(text_of(base_ + ".rc"), "\n"); }
    int code() const { return std::atoi(text_of(base_ + ".rc").c_str()); }
    std::string out() const { return text_of(base_ + ".out"); }
    std::string err() const { return text_of(base_ + ".err"); }

 private:
    std::string base_;
};

/// What is on a screen.
struct Screenshot
{
    size_t width = 0, height = 0;
    std::vector<uint32_t> pixels;  ///< 0xRRGGBB

    uint32_t at(size_t x, size_t y) const { return pixels[y * width + x]; }
    Screenshot right_of(size_t left) const
    {
        Screenshot part{width - left, height, {}};
        for (size_t y = 0; y < height; y++)
            for (size_t x = left; x < width; x++) part.pixels.push_back(at(x, y));
        return part;
    }
    size_t count(uint32_t color) const
    {
        return static_cast<size_t>(std::count(pixels.begin(), pixels.end(), color));
    }
};

inline size_t differing(const Screenshot& a, const Screenshot& b)
{
    EXPECT_EQ(a.pixels.size(), b.pixels.size());
    size_t count = 0;
    for (size_t i = 0; i < std::min(a.pixels.size(), b.pixels.size()); i++)
        count += a.pixels[i] != b.pixels[i];
    return count;
}

/// A virtual screen of 1280x800 pixels (Xvfb), and a user at it (xdotool).
class XServer
{
 public:
    static bool is_installed() { return has_program("Xvfb") && has_program("xdotool"); }

    explicit XServer(const Folder& folder)
        : screen_file_(folder.path("Xvfb_screen0")),
          display_file_(folder.path("display")),
          said_(folder.path("xdotool.out")),
          server_(folder, "xvfb",
                  "Xvfb -displayfd 3 -screen 0 1280x800x24 -noreset -nolisten tcp -fbdir " + folder.path("") +
                      " 3>" + display_file_)
    {
        EXPECT_TRUE(wait_until([this] { return contains(text_of(display_file_), "\n"); })) << server_.err();
    }

    std::string display() const
    {
        const std::string number = text_of(display_file_);
        return ":" + number.substr(0, number.find('\n'));
    }
    /// What xdotool says.
    std::string user(const std::string& does) const
    {
        (void)!std::system(
            ("DISPLAY=" + display() + " xdotool " + does + " >" + said_ + " 2>/dev/null").c_str());
        return text_of(said_);
    }
    void drag(int x0, int y0, int x1, int y1) const
    {
        const auto at = [](int x, int y)
        { return " mousemove " + std::to_string(x) + " " + std::to_string(y); };
        user(at(x0, y0) + " sleep 0.2 mousedown 1 sleep 0.2" + at((x0 + x1) / 2, (y0 + y1) / 2) +
             " sleep 0.2" + at(x1, y1) + " sleep 0.2 mouseup 1");
    }

    /// Of the server's own memory, which it maps to a file in the format of xwd.
    Screenshot screenshot() const
    {
        const std::string file = text_of(screen_file_);
        const auto field = [&](size_t i)
        {
            uint32_t value = 0;  // big endian
            for (size_t byte = 0; byte < 4; byte++)
                value = value << 8 | static_cast<uint8_t>(file.at(4 * i + byte));
            return static_cast<size_t>(value);
        };
        Screenshot shot;
        shot.width = field(4), shot.height = field(5);
        const size_t bytes_per_line = field(12), start = field(0) + 12 * field(19);
        for (size_t y = 0; y < shot.height; y++)
            for (size_t x = 0; x < shot.width; x++)
            {
                const auto byte = [&](size_t i) {
                    return static_cast<uint32_t>(
                        static_cast<uint8_t>(file.at(start + y * bytes_per_line + 4 * x + i)));
                };
                shot.pixels.push_back(byte(2) << 16 | byte(1) << 8 | byte(0));
            }
        return shot;
    }

 private:
    std::string screen_file_, display_file_, said_;
    Background server_;
};
}  // namespace mp2p_icp_test
