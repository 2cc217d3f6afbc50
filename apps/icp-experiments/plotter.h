#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "figure.h"

namespace mp2p_icp_apps::experiments
{
/// Figures could not be drawn; what() says what to do.
class NoFigures : public std::runtime_error
{
 public:
    using std::runtime_error::runtime_error;
};

/// Writes EXPERIMENT.figures.json (all that is drawn) and plot_figures.py (which draws it).
void write_figures(const std::vector<Figure>& figures, const std::string& folder,
                   const std::string& experiment);

/// Draws with matplotlib, in a Python of its own.
class Plotter
{
 public:
    /// \param python the interpreter; empty: Debian's, or the one in the PATH, whichever has matplotlib.
    /// \exception NoFigures if it has none
    explicit Plotter(const std::string& python);

    /// Makes NAME.png and NAME.svg of each figure that write_figures() wrote there. \exception NoFigures
    void draw(const std::string& folder, const std::string& experiment) const;

 private:
    std::string python_;
};

}  // namespace mp2p_icp_apps::experiments
