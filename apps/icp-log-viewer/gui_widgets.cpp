#include "gui_widgets.h"

namespace mp2p_icp_apps
{
namespace
{
constexpr int FONT_SIZE = 15, LINE_HEIGHT = 18;
}

TextPanel::TextPanel(nanogui::Widget* parent, int width) : nanogui::Widget(parent), width_(width) {}

nanogui::Vector2i TextPanel::preferredSize(NVGcontext*) const
{
    return {width_, LINE_HEIGHT * static_cast<int>(lines_.size())};
}

void TextPanel::draw(NVGcontext* ctx)
{
    nanogui::Widget::draw(ctx);
    nvgFontFace(ctx, "sans");
    nvgFontSize(ctx, FONT_SIZE);
    nvgFillColor(ctx, nanogui::Color(230, 255));
    nvgTextAlign(ctx, NVG_ALIGN_LEFT | NVG_ALIGN_TOP);
    for (size_t i = 0; i < lines_.size(); i++)
        nvgText(ctx, static_cast<float>(mPos.x()),
                static_cast<float>(mPos.y() + LINE_HEIGHT * static_cast<int>(i)), lines_[i].c_str(), nullptr);
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
    auto* label = new nanogui::Label(parent, text, "sans", FONT_SIZE);
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
    box->setFontSize(FONT_SIZE);
    return box;
}

nanogui::ComboBox* add_choice(nanogui::Widget* parent, const std::vector<std::string>& items, int width,
                              const std::function<void(int)>& changed)
{
    auto* choice = new nanogui::ComboBox(parent, items);
    choice->setFixedSize({width, 22});
    choice->setFontSize(FONT_SIZE);
    choice->setCallback(changed);
    return choice;
}

nanogui::Button* add_button(nanogui::Widget* parent, const std::string& text,
                            const std::function<void()>& pushed)
{
    auto* button = new nanogui::Button(parent, text);
    button->setFontSize(FONT_SIZE);
    button->setCallback(pushed);
    return button;
}

}  // namespace mp2p_icp_apps
