#include "gui_widgets.h"

#include <algorithm>

namespace mp2p_icp_apps
{
namespace
{
constexpr float FONT_SIZE = 15, LINE_HEIGHT = 18;

void choose_font(NVGcontext* ctx)
{
    nvgFontFace(ctx, "sans");
    nvgFontSize(ctx, FONT_SIZE);
    nvgFillColor(ctx, nanogui::Color(230, 255));
    nvgTextAlign(ctx, NVG_ALIGN_LEFT | NVG_ALIGN_TOP);
}
}  // namespace

TextPanel::TextPanel(nanogui::Widget* parent, int width) : nanogui::Widget(parent), width_(width) {}

float TextPanel::height_of(NVGcontext* ctx, const std::string& line) const
{
    float bounds[4];
    nvgTextBoxBounds(ctx, 0, 0, static_cast<float>(width_), line.c_str(), nullptr, bounds);
    return std::max(LINE_HEIGHT, bounds[3] - bounds[1] + LINE_HEIGHT - FONT_SIZE);
}

nanogui::Vector2i TextPanel::preferredSize(NVGcontext* ctx) const
{
    choose_font(ctx);
    float height = 0;
    for (const auto& line : lines_) height += height_of(ctx, line);
    return {width_, static_cast<int>(height) + 1};
}

void TextPanel::draw(NVGcontext* ctx)
{
    nanogui::Widget::draw(ctx);
    choose_font(ctx);
    auto top = static_cast<float>(mPos.y());
    for (const auto& line : lines_)
    {
        nvgTextBox(ctx, static_cast<float>(mPos.x()), top, static_cast<float>(width_), line.c_str(), nullptr);
        top += height_of(ctx, line);
    }
}

TextPanel* add_text_panel(nanogui::Widget* parent, int width, int height)
{
    auto* scroll = new nanogui::VScrollPanel(parent);
    scroll->setFixedSize({width, height});
    return new TextPanel(scroll, width - 14);
}

nanogui::Widget* add_row(nanogui::Widget* parent)
{
    auto* row = new nanogui::Widget(parent);
    row->setLayout(
        new nanogui::BoxLayout(nanogui::Orientation::Horizontal, nanogui::Alignment::Middle, 0, 4));
    return row;
}

void make_column(nanogui::Widget* widget, int spacing)
{
    widget->setLayout(
        new nanogui::BoxLayout(nanogui::Orientation::Vertical, nanogui::Alignment::Minimum, 4, spacing));
}

nanogui::Label* add_label(nanogui::Widget* parent, const std::string& text, int width)
{
    auto* label = new nanogui::Label(parent, text, "sans", static_cast<int>(FONT_SIZE));
    label->setFixedWidth(width);
    return label;
}

nanogui::Slider* add_slider(nanogui::Widget* parent, int width, const std::function<void(float)>& changed)
{
    auto* slider = new nanogui::Slider(parent);
    slider->setFixedWidth(width);
    slider->setCallback(changed);
    return slider;
}

nanogui::CheckBox* add_check_box(nanogui::Widget* parent, const std::string& text, bool checked,
                                 const std::function<void(bool)>& changed)
{
    auto* box = new nanogui::CheckBox(parent, text, changed);
    box->setChecked(checked);
    box->setFontSize(static_cast<int>(FONT_SIZE));
    return box;
}

nanogui::ComboBox* add_choice(nanogui::Widget* parent, const std::vector<std::string>& items, int width,
                              const std::function<void(int)>& changed)
{
    auto* choice = new nanogui::ComboBox(parent, items);
    choice->setFixedSize({width, 22});
    choice->setFontSize(static_cast<int>(FONT_SIZE));
    choice->setCallback(changed);
    return choice;
}

nanogui::Button* add_button(nanogui::Widget* parent, const std::string& text,
                            const std::function<void()>& pushed)
{
    auto* button = new nanogui::Button(parent, text);
    button->setFontSize(static_cast<int>(FONT_SIZE));
    button->setCallback(pushed);
    return button;
}

}  // namespace mp2p_icp_apps
