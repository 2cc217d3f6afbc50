#include <mp2p_icp/errors.h>
#include <mp2p_icp/html_report.h>
#include <mp2p_icp/run_curves.h>
#include <mrpt/core/bits_math.h>

#include <cstdio>
#include <fstream>
#include <stdexcept>

#include "encoded_picture.h"
#include "html_text.h"
#include "report_plots.h"
#include "report_scene.h"
#include "report_summary.h"

namespace mp2p_icp
{
namespace
{
const char* STYLE =
#include "report_page_style.inc"
    ;
const char* SCRIPT_OF_VIEW =
#include "report_page_view.inc"
    ;
const char* SCRIPT_OF_CONTROLS =
#include "report_page_controls.inc"
    ;

const char* VIEW = R"html(<section class="card view">
<div class="stage"><canvas id="view" tabindex="0" aria-label="both clouds, in a view that turns"></canvas>
<div class="help">drag to turn · two fingers or shift to move · wheel or pinch to zoom</div>
<div class="buttons"><button id="top">top</button><button id="side">side</button><button id="reset">reset</button></div></div>
<div class="controls"><div class="time"><button id="guess">guess</button><input id="state" type="range" min="0" value="0"
 aria-label="iteration"><button id="end">end</button><button id="play">▶ play</button><output id="state-label"></output></div>
<div class="toggles" id="toggles"></div><noscript>The view needs JavaScript; all else on this page does not.</noscript></div>
</section>
)html";

std::string hex(const mrpt::img::TColor& color)
{
    char text[8];
    std::snprintf(text, sizeof(text), "#%02x%02x%02x", color.R, color.G, color.B);
    return text;
}

/// Towards white, so that it stands out from a dark ground.
mrpt::img::TColor lighter(const mrpt::img::TColor& color)
{
    const auto mixed = [](uint8_t value) { return static_cast<uint8_t>(value + (255 - value) * 3 / 10); };
    return {mixed(color.R), mixed(color.G), mixed(color.B)};
}

std::string colors_css(const HtmlReportOptions& options)
{
    const auto& global = options.global_color;
    const auto& local = options.local_color;
    return ":root { --global: " + hex(global) + "; --local: " + hex(local) +
           "; }\n@media (prefers-color-scheme: dark) { :root { --global: " + hex(lighter(global)) +
           "; --local: " + hex(lighter(local)) + "; } }\n";
}

std::string strip_of(const std::vector<ReportPicture>& pictures)
{
    if (pictures.empty()) return {};
    std::string out = "<section class=\"card\"><h2>Pictures</h2><div class=\"strip\">\n";
    for (const auto& picture : pictures)
    {
        const std::string png = encoded_png(picture.image), caption = html_escaped(picture.caption);
        out += "<figure><img alt=\"" + caption + "\" src=\"data:image/png;base64," +
               base64(png.data(), png.size()) + "\"><figcaption>" + caption + "</figcaption></figure>\n";
    }
    return out + "</div></section>\n";
}
}  // namespace

std::string html_report(const LogRecord& log, const HtmlReportOptions& options)
{
    const ReportScene scene = report_scene(log, options);
    const std::string title = html_escaped(options.title);
    return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
           "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
           "<link rel=\"icon\" href=\"data:,\">\n<title>" +
           title + "</title>\n<style>" + STYLE + colors_css(options) + "</style></head>\n<body>\n<h1>" +
           title + "</h1>\n" + headline_html(log) + VIEW + plots_html(log) + tables_html(log, scene) +
           strip_of(options.pictures) +
           "<dialog id=\"large\"><img alt=\"the picture in full size\"></dialog>\n"
           "<script type=\"application/json\" id=\"scene\">" +
           scene.json + "</script>\n<script>" + SCRIPT_OF_VIEW + SCRIPT_OF_CONTROLS +
           "</script>\n</body></html>\n";
}

void save_html_report(const LogRecord& log, const std::string& path, const HtmlReportOptions& options)
{
    const std::string page = html_report(log, options);
    std::ofstream file(path, std::ios::binary);
    file << page;
    file.close();
    if (!file) throw DataError(path, "cannot write the report");
}

}  // namespace mp2p_icp
