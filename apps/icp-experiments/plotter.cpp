#include "plotter.h"

#include <sys/wait.h>

#include <cstdio>

#include "plot_script.h"
#include "text_file.h"

namespace mp2p_icp_apps::experiments
{
namespace
{
struct Outcome
{
    int code;            ///< of the shell: 127 if there is no such program
    std::string output;  ///< of both streams
};

std::string quoted(const std::string& argument)
{
    std::string out = "'";
    for (const char c : argument) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return out + "'";
}

Outcome run(const std::vector<std::string>& command)
{
    std::string line;
    for (const auto& word : command) line += quoted(word) + " ";
    Outcome outcome{-1, ""};
    FILE* pipe = popen((line + "2>&1 </dev/null").c_str(), "r");
    if (!pipe) return outcome;
    char buffer[4096];
    for (size_t n = 0; (n = fread(buffer, 1, sizeof(buffer), pipe)) > 0;) outcome.output.append(buffer, n);
    const int status = pclose(pipe);
    if (WIFEXITED(status)) outcome.code = WEXITSTATUS(status);
    return outcome;
}

bool has_matplotlib(const std::string& python)
{
    return run({python, "-c", "import matplotlib"}).code == 0;
}

std::string script_in(const std::string& folder)
{
    return folder + "/plot_figures.py";
}
std::string numbers_in(const std::string& folder, const std::string& experiment)
{
    return folder + "/" + experiment + ".figures.json";
}

std::string last_line(std::string text)
{
    while (!text.empty() && text.back() == '\n') text.pop_back();
    return text.substr(text.rfind('\n') + 1);
}
}  // namespace

void write_figures(const std::vector<Figure>& figures, const std::string& folder,
                   const std::string& experiment)
{
    write_text_file(script_in(folder), PLOT_SCRIPT);
    write_text_file(numbers_in(folder, experiment), figures_json(figures));
}

Plotter::Plotter(const std::string& python)
{
    const std::vector<std::string> candidates =
        python.empty() ? std::vector<std::string>{"/usr/bin/python3", "python3"} : std::vector{python};
    for (const auto& candidate : candidates)
    {
        if (!has_matplotlib(candidate)) continue;
        python_ = candidate;
        return;
    }
    throw NoFigures("no figures: " + candidates.back() +
                    " is missing, or cannot import matplotlib (Debian's package python3-matplotlib); "
                    "--python names another one");
}

void Plotter::draw(const std::string& folder, const std::string& experiment) const
{
    const std::string script = script_in(folder), numbers = numbers_in(folder, experiment);
    const Outcome outcome = run({python_, script, numbers, folder});
    if (outcome.code != 0)
        throw NoFigures("the figures of " + experiment + " could not be drawn: " + last_line(outcome.output) +
                        " (again with: " + python_ + " " + script + " " + numbers + " " + folder + ")");
}

}  // namespace mp2p_icp_apps::experiments
