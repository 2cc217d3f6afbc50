#include "findings_text.h"

#include <charconv>
#include <cmath>

namespace mp2p_icp_certify
{
namespace
{
// ---- Words ------------------------------------------------------------------------------------------------
std::string pairings_in_words(const Findings& f)
{
    size_t all = 0;
    std::string kinds;
    for (size_t k = 0; k < NUMBER_OF_KINDS; k++)
    {
        if (f.pairings[k] == 0) continue;
        all += f.pairings[k];
        kinds += (kinds.empty() ? " (" : ", ") + std::to_string(f.pairings[k]) + " " + KIND_NAMES[k];
    }
    return std::to_string(all) + kinds + (kinds.empty() ? "" : ")") + (f.has_prior ? ", and a prior" : "");
}

std::string line(const std::string& name, const TwoNumbers& n, const std::string& unit)
{
    return name + text_of(n.found) + unit + " (the file says " + text_of(n.in_file) + ")\n";
}

std::string gap_relative(const Findings& f)
{
    return text_of(f.gap.found / f.scale.found) + " of the scale";
}

std::string minima_in_words(const Findings& f)
{
    if (f.minima == 0) return "none listed";
    return std::to_string(f.minima) + " listed; " + std::to_string(f.equal_minima) +
           " other than the pose cost no more, within the tolerance";
}

std::string bound(const Findings& f)
{
    return "no pose costs less than " + text_of(f.cost.found) + " m^2 by more than " + text_of(f.gap.found) +
           " m^2 (" + gap_relative(f) + ")";
}

std::string conclusion(const Findings& f)
{
    if (!f.holds())
    {
        std::string out = "The certificate does NOT hold: " + f.failures[0] + "\n";
        for (size_t i = 1; i < f.failures.size(); i++) out += "  Also: " + f.failures[i] + "\n";
        return out;
    }
    std::string out = "The certificate holds: " + bound(f) + "\n";
    if (f.verdict == "gap") out += "  This is a bound, and no proof that the pose is the best one.\n";
    if (f.verdict == "global_ambiguous") out += "  Other poses cost as little: see the listed minima.\n";
    if (f.verdict == "unobservable") out += "  Other poses cost as little: motions are left free.\n";
    return out;
}
}  // namespace

std::string findings_in_words(const Findings& f)
{
    std::string out = "Pairings: " + pairings_in_words(f) + "\n";
    out += "Verdict in the file: " + f.verdict + ", tolerance " + text_of(f.tolerance) + "\n";
    if (f.compared)
    {
        out += line("Cost at the pose: ", f.cost, " m^2");
        out += line("Scale: ", f.scale, " m^2");
        out += line("Gap: ", f.gap, " m^2, " + gap_relative(f));
        out += line("Margin: ", f.margin, "");
        out += "Minima: " + minima_in_words(f) + "\n";
    }
    return out + conclusion(f);
}

// ---- YAML -------------------------------------------------------------------------------------------------
namespace
{
std::string number(Real wide)
{
    const double value = static_cast<double>(wide);
    if (std::isnan(value)) return ".nan";
    if (std::isinf(value)) return value > 0 ? ".inf" : "-.inf";
    char buffer[40];
    const auto end =
        std::to_chars(buffer, buffer + sizeof(buffer), value, std::chars_format::general, 17).ptr;
    std::string text(buffer, end);
    // YAML 1.1 takes 1e-05 for text: it wants a point.
    const auto exponent = text.find('e');
    if (exponent != std::string::npos && text.find('.') == std::string::npos) text.insert(exponent, ".0");
    return text;
}

/// Single quotes: nothing but they themselves has a meaning between them.
std::string quoted(const std::string& text)
{
    std::string out = "'";
    for (const char c : text) out += c == '\'' ? "''" : std::string(1, c);
    return out + "'";
}

std::string entry(const std::string& key, const TwoNumbers& n)
{
    return key + ": {found: " + number(n.found) + ", in_file: " + number(n.in_file) + "}\n";
}

std::string truth(bool value)
{
    return value ? "true" : "false";
}

std::string numbers_as_yaml(const Findings& f)
{
    return entry("cost", f.cost) + entry("scale", f.scale) + entry("gap", f.gap) +
           "gap_relative: " + number(f.gap.found / f.scale.found) + "\n" + entry("margin", f.margin) +
           "minima: {listed: " + std::to_string(f.minima) + ", equal: " + std::to_string(f.equal_minima) +
           "}\n" + "largest_mismatch: " + number(f.largest_mismatch) + "\ngradient: " + number(f.gradient) +
           "\ntranslation_excess: " + number(f.translation_excess) + "\nrounding: " + number(f.rounding) +
           "\n";
}
}  // namespace

std::string findings_as_yaml(const Findings& f)
{
    std::string out = "holds: " + truth(f.holds()) + "\n";
    out += f.failures.empty() ? "failures: []\n" : "failures:\n";
    for (const auto& failure : f.failures) out += "  - " + quoted(failure) + "\n";
    out += "verdict: " + f.verdict + "\ntolerance: " + number(f.tolerance) + "\n";
    out += "pairings: {";
    for (size_t k = 0; k < NUMBER_OF_KINDS; k++)
        out += std::string(k ? ", " : "") + KIND_NAMES[k] + ": " + std::to_string(f.pairings[k]);
    out += "}\nprior: " + truth(f.has_prior) + "\n";
    return f.compared ? out + numbers_as_yaml(f) : out;
}

}  // namespace mp2p_icp_certify
