#pragma once

#include <mrpt/img/TColor.h>

namespace mp2p_icp
{
/** \file pairings_render_params.h
 * How Pairings::get_visualization() draws each kind of pairing. `color` is that of the primitives of the
 * global map, `localColor` that of the local ones (moved by the pose), `segmentColor` that of the residuals
 * between them. Sizes are in metres; those that are negative or not finite are refused with
 * std::invalid_argument.
 */

struct render_params_pairings_pt2pt_t
{
    bool visible = true;
    mrpt::img::TColor color{0x00, 0xa0, 0x00, 0xff};  ///< of the residuals: there is nothing else to draw
};

struct render_params_pairings_pt2ln_t
{
    bool visible = true;
    mrpt::img::TColor color{0xff, 0x00, 0x00, 0xff};
    mrpt::img::TColor segmentColor{0x00, 0xa0, 0x00, 0xff};
    double lineLength = 0.2;  ///< of the piece of the line that is drawn, m
};

struct render_params_pairings_pt2pl_t
{
    bool visible = true;
    mrpt::img::TColor color{0x00, 0x00, 0xff, 0xff};
    mrpt::img::TColor segmentColor{0x00, 0xa0, 0x00, 0xff};
    double planePatchSize = 0.2;  ///< side of the square, m
};

struct render_params_pairings_ln2ln_t
{
    bool visible = true;
    mrpt::img::TColor color{0xff, 0x00, 0x00, 0xff};
    mrpt::img::TColor localColor{0xff, 0x80, 0x00, 0xff};
    mrpt::img::TColor segmentColor{0x00, 0xa0, 0x00, 0xff};
    double lineLength = 0.2;  ///< of the piece of each line that is drawn, m
};

struct render_params_pairings_pl2pl_t
{
    bool visible = true;
    mrpt::img::TColor color{0x00, 0x00, 0xff, 0xff};
    mrpt::img::TColor localColor{0x00, 0xc0, 0xff, 0xff};
    mrpt::img::TColor segmentColor{0x00, 0xa0, 0x00, 0xff};
    double planePatchSize = 0.2;  ///< side of each square, m
    double normalLength = 0.1;    ///< of the segments along the normals, m
};

struct pairings_render_params_t
{
    render_params_pairings_pt2pt_t pt2pt;
    render_params_pairings_pt2ln_t pt2ln;
    render_params_pairings_pt2pl_t pt2pl;
    render_params_pairings_ln2ln_t ln2ln;
    render_params_pairings_pl2pl_t pl2pl;
};

}  // namespace mp2p_icp
