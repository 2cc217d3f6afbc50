#pragma once

#include <nanogui/nanogui.h>

#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace mp2p_icp_apps
{
/// Lines of text, as many as there are; too long ones are wrapped.
class TextPanel : public nanogui::Widget
{
 public:
    TextPanel(nanogui::Widget* parent, int width);

    void set_lines(const std::vector<std::string>& lines) { lines_ = lines; }
    nanogui::Vector2i preferredSize(NVGcontext* ctx) const override;
    void draw(NVGcontext* ctx) override;

 private:
    float height_of(NVGcontext* ctx, const std::string& line) const;

    int width_;
    std::vector<std::string> lines_;
};

/// A text panel that scrolls when it is higher than that.
TextPanel* add_text_panel(nanogui::Widget* parent, int width, int height);

/// A row of widgets side by side.
nanogui::Widget* add_row(nanogui::Widget* parent);
/// A column of them.
void make_column(nanogui::Widget* widget, int spacing = 4);

nanogui::Label* add_label(nanogui::Widget* parent, const std::string& text, int width);
nanogui::Slider* add_slider(nanogui::Widget* parent, int width, const std::function<void(float)>& changed);
nanogui::CheckBox* add_check_box(nanogui::Widget* parent, const std::string& text, bool checked,
                                 const std::function<void(bool)>& changed);
nanogui::ComboBox* add_choice(nanogui::Widget* parent, const std::vector<std::string>& items, int width,
                              const std::function<void(int)>& changed);
nanogui::Button* add_button(nanogui::Widget* parent, const std::string& text,
                            const std::function<void()>& pushed);

}  // namespace mp2p_icp_apps
