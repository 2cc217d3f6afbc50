#include "pairing_lines.h"

#include <mp2p_icp/errors.h>

#include <charconv>
#include <cmath>

namespace mp2p_icp_certify
{
namespace
{
/// What stands on the line of a kind, in the order of `Pairing::kind`.
constexpr std::array<const char*, NUMBER_OF_KINDS> FORMS = {
    "pt2pt,w, gx,gy,gz, lx,ly,lz", "pt2ln,w, px,py,pz, dx,dy,dz, lx,ly,lz",
    "pt2pl,w, px,py,pz, nx,ny,nz, lx,ly,lz",
    "ln2ln,w,wd,free|oriented, gpx,gpy,gpz, gdx,gdy,gdz, lpx,lpy,lpz, ldx,ldy,ldz",
    "pl2pl,w,wd,free|oriented, gpx,gpy,gpz, gnx,gny,gnz, lpx,lpy,lpz, lnx,lny,lnz"};

constexpr std::string_view SPACES = " \t\r";

std::string_view trimmed(std::string_view text)
{
    const auto first = text.find_first_not_of(SPACES);
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(SPACES) + 1 - first);
}

/// For messages: not too long, and without control characters.
std::string quoted(std::string_view text)
{
    std::string out = "'" + std::string(text.substr(0, 30)) + (text.size() > 30 ? "...'" : "'");
    for (char& c : out)
        if (static_cast<unsigned char>(c) < 0x20) c = '?';
    return out;
}

/// The words of one line, from the left to the right.
class Line
{
 public:
    Line(std::string_view text, const std::string& file_name, size_t number)
        : rest_(text), file_name_(file_name), number_(number)
    {
    }

    std::string_view word()
    {
        if (at_end_) refuse(form_, "the end of the line");
        const auto comma = rest_.find(',');
        const std::string_view found = trimmed(rest_.substr(0, comma));
        at_end_ = comma == std::string_view::npos;
        rest_ = at_end_ ? std::string_view() : rest_.substr(comma + 1);
        return found;
    }

    PairingKind kind()
    {
        const std::string_view name = word();
        for (size_t k = 0; k < NUMBER_OF_KINDS; k++)
            if (name == KIND_NAMES[k])
            {
                form_ = FORMS[k];
                return static_cast<PairingKind>(k);
            }
        refuse("a pairing: pt2pt, pt2ln, pt2pl, ln2ln or pl2pl", quoted(name));
    }

    double number()
    {
        std::string_view text = word();
        const std::string_view whole = text;
        if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
        double value = 0;
        const char* const end = text.data() + text.size();
        const auto [stop, problem] = std::from_chars(text.data(), end, value);
        if (problem != std::errc() || stop != end) refuse("a number", quoted(whole));
        if (!std::isfinite(value)) refuse("a finite number", quoted(whole));
        return value;
    }

    double weight()
    {
        const double w = number();
        if (!(w >= 0)) refuse("a weight that is not negative", quoted(std::to_string(w)));
        return w;
    }

    Eigen::Vector3d point()
    {
        const double x = number(), y = number(), z = number();
        return {x, y, z};
    }

    Eigen::Vector3d direction()
    {
        const Eigen::Vector3d d = point();
        if (!(d.cwiseAbs().maxCoeff() > 0)) refuse("a direction or normal", "one of length zero");
        return d;
    }

    bool is_oriented()
    {
        const std::string_view text = word();
        if (text != "free" && text != "oriented") refuse("'free' or 'oriented'", quoted(text));
        return text == "oriented";
    }

    void expect_end() const
    {
        if (!at_end_) refuse(form_, "more: " + quoted(trimmed(rest_)));
    }

 private:
    [[noreturn]] void refuse(const std::string& expected, const std::string& found) const
    {
        throw mp2p_icp::DataError(file_name_, mp2p_icp::place_line(number_), expected, found);
    }

    std::string_view rest_;
    const std::string& file_name_;
    size_t number_;
    bool at_end_ = false;
    std::string form_ = "a pairing";
};

Pairing pairing_from(Line line)
{
    Pairing p;
    p.kind = line.kind();
    p.weight = line.weight();
    const bool has_local_dir = p.kind == PairingKind::ln2ln || p.kind == PairingKind::pl2pl;
    if (has_local_dir) p.direction_weight = line.weight(), p.oriented = line.is_oriented();
    p.global = line.point();
    if (p.kind != PairingKind::pt2pt) p.global_dir = line.direction();
    p.local = line.point();
    if (has_local_dir) p.local_dir = line.direction();
    line.expect_end();
    return p;
}
}  // namespace

std::vector<Pairing> pairings_from_lines(std::string_view text, const std::string& file_name,
                                         size_t first_line)
{
    std::vector<Pairing> pairings;
    for (size_t number = first_line; !text.empty(); number++)
    {
        const auto end = text.find('\n');
        const std::string_view line = trimmed(text.substr(0, end));
        text = end == std::string_view::npos ? std::string_view() : text.substr(end + 1);
        if (!line.empty() && line[0] != '#') pairings.push_back(pairing_from({line, file_name, number}));
    }
    return pairings;
}

}  // namespace mp2p_icp_certify
