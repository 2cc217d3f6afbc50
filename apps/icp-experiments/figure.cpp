#include "figure.h"

#include <cmath>
#include <map>
#include <stdexcept>

#include "number_text.h"

namespace mp2p_icp_apps::experiments
{
namespace
{
constexpr const char *BLACK = "#000000", *ORANGE = "#E69F00", *SKY = "#56B4E9", *GREEN = "#009E73",
                     *BLUE = "#0072B2", *VERMILLION = "#D55E00", *PURPLE = "#CC79A7", *GREY = "#777777";

struct Look
{
    const char* color;
    const char* marker;
    bool dashed = false;
};

/// One solver keeps its colour in all figures; its variants differ in marker and dash.
const std::map<std::string, Look>& looks()
{
    static const std::map<std::string, Look> all = {
        {"bound", {BLACK, "", true}},
        {"olae", {VERMILLION, "o"}},
        {"olae-ml", {VERMILLION, "v", true}},
        {"olae-scale-test", {VERMILLION, "v", true}},
        {"olae-loss", {VERMILLION, "v", true}},
        {"olae-least-squares", {ORANGE, "s"}},
        {"olae-least-squares-ml", {ORANGE, "s", true}},
        {"olae-loss-iterated", {ORANGE, "s"}},
        {"olae-newton", {PURPLE, "P"}},
        {"olae-newton-scale-test", {GREY, "p", true}},
        {"olae-newton-ml", {PURPLE, "P", true}},
        {"horn", {BLUE, "^"}},
        {"horn-ml", {BLUE, "<", true}},
        {"horn-scale-test", {SKY, "<", true}},
        {"horn-loss", {SKY, "<", true}},
        {"horn-noise-scale", {PURPLE, "P"}},
        {"horn-consistency-graph", {ORANGE, "s"}},
        {"horn-gnc-truncated", {GREEN, "X"}},
        {"horn-gnc-geman-mcclure", {BLACK, "d", true}},
        {"gauss-newton", {GREEN, "D"}},
        {"gauss-newton-ml", {GREEN, "D", true}},
        {"gauss-newton-unit", {GREY, "d", true}},
        {"certified", {SKY, "X"}},
        {"certified-ml", {SKY, "X", true}},
    };
    return all;
}

/// Text and numbers of JSON, nested by braces that the caller writes in order.
class Json
{
 public:
    void open(char bracket) { comma(), text_ += bracket, first_ = true; }
    void open(const std::string& key, char bracket)
    {
        name(key);
        text_ += bracket, first_ = true;
    }
    void close(char bracket) { text_ += bracket, first_ = false; }
    void add(const std::string& key, const std::string& value) { name(key), text_ += quoted(value); }
    void add(const std::string& key, double value) { name(key), text_ += number(value); }
    void add(const std::string& key, const std::vector<double>& values)
    {
        open(key, '[');
        for (const double v : values) comma(), text_ += number(v);
        close(']');
    }
    void add(const std::string& key, const std::vector<std::string>& values)
    {
        open(key, '[');
        for (const auto& v : values) comma(), text_ += quoted(v);
        close(']');
    }
    const std::string& text() const { return text_; }

 private:
    void comma()
    {
        if (!first_) text_ += ",\n";
        first_ = false;
    }
    void name(const std::string& key) { comma(), text_ += quoted(key) + ":"; }
    static std::string number(double v) { return std::isfinite(v) ? number_text(v) : "null"; }
    static std::string quoted(const std::string& value)
    {
        std::string out = "\"";
        for (const char c : value)
        {
            if (c == '"' || c == '\\') out += '\\';
            out += c == '\n' ? "\\n" : std::string(1, c);
        }
        return out + "\"";
    }

    std::string text_;
    bool first_ = true;
};

void add(Json& json, const SeriesStyle& s)
{
    json.open('{');
    json.add("id", s.id), json.add("label", s.label), json.add("color", s.color);
    json.add("marker", s.marker), json.add("dashed", s.dashed ? 1.0 : 0.0);
    json.close('}');
}

void add(Json& json, const BoxSeries& series)
{
    json.open('{');
    json.add("style", series.style);
    json.open("boxes", '[');
    for (const Box& b : series.boxes)
    {
        const Statistics& s = b.statistics;
        json.open('{');
        json.add("x", b.x), json.add("q05", s.q05), json.add("q25", s.q25), json.add("median", s.median);
        json.add("q75", s.q75), json.add("q95", s.q95), json.add("rmse", s.rmse);
        json.close('}');
    }
    json.close(']'), json.close('}');
}

void add(Json& json, const LineSeries& series)
{
    json.open('{');
    json.add("style", series.style), json.add("x", series.x), json.add("y", series.y);
    json.add("low", series.low), json.add("high", series.high);
    json.close('}');
}

void add(Json& json, const Panel& p)
{
    json.open('{');
    json.add("title", p.title), json.add("note", p.note);
    json.add("x_label", p.x_label), json.add("y_label", p.y_label);
    json.add("x_scale", p.x_scale), json.add("y_scale", p.y_scale), json.add("categories", p.categories);
    json.add("y_from", p.y_from), json.add("y_to", p.y_to);
    json.open("boxes", '[');
    for (const auto& s : p.boxes) add(json, s);
    json.close(']');
    json.open("lines", '[');
    for (const auto& s : p.lines) add(json, s);
    json.close(']'), json.close('}');
}

void add(Json& json, const Figure& f)
{
    json.open('{');
    json.add("name", f.name), json.add("title", f.title), json.add("columns", static_cast<double>(f.columns));
    json.open("legend", '[');
    for (const auto& s : f.legend) add(json, s);
    json.close(']');
    json.open("panels", '[');
    for (const auto& p : f.panels) add(json, p);
    json.close(']'), json.close('}');
}
}  // namespace

SeriesStyle style_of(const std::string& id, const std::string& label)
{
    const auto found = looks().find(id);
    if (found == looks().end()) throw std::logic_error("no style for '" + id + "'");
    return {id, label, found->second.color, found->second.marker, found->second.dashed};
}

std::string figures_json(const std::vector<Figure>& figures)
{
    Json json;
    json.open('[');
    for (const auto& f : figures) add(json, f);
    json.close(']');
    return json.text() + "\n";
}

}  // namespace mp2p_icp_apps::experiments
