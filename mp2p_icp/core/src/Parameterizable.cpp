#include <mp2p_icp/Parameterizable.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/numbers.h>

#include <algorithm>
#include <sstream>

namespace mp2p_icp
{
bool Range::contains(double value) const
{
    const bool above = lo_open ? value > lo : value >= lo;
    const bool below = hi_open ? value < hi : value <= hi;
    return above && below;  // false for NaN
}

std::string Range::text() const
{
    if (lo == -hi && std::isinf(hi)) return "any";
    const auto end = [](double v)
    { return std::isinf(v) ? std::string(v > 0 ? "inf" : "-inf") : to_text(v); };
    return (lo_open || std::isinf(lo) ? "(" : "[") + end(lo) + ", " + end(hi) +
           (hi_open || std::isinf(hi) ? ")" : "]");
}

namespace
{
[[noreturn]] void refuse(const YamlPlace& place, const yaml::node_t& node, const std::string& expected,
                         const std::string& found)
{
    throw ConfigError(place.text(&node) + ": expected " + expected + ", found '" + found + "'");
}

Formula formula_from(const yaml::node_t& node, const YamlPlace& place, const Range& range,
                     const std::string& unit)
{
    const std::string text = scalar_text(node, place);
    Formula formula;
    if (const auto number = to_number(text))
        formula = Formula(*number);
    else
        try
        {
            formula = Formula(text);
        }
        catch (const std::invalid_argument& e)
        {
            throw ConfigError(place.text(&node) + ": " + e.what());
        }
    if (formula.is_constant() && !range.contains(formula.value()))
        refuse(place, node, "a value in " + range.text() + (unit.empty() ? "" : " " + unit), text);
    return formula;
}

double number_from(const yaml::node_t& node, const YamlPlace& place, const Range& range,
                   const std::string& unit)
{
    const Formula formula = formula_from(node, place, range, unit);
    if (!formula.is_constant()) refuse(place, node, "a number", formula.text());
    return formula.value();
}

bool flag_from(const yaml::node_t& node, const YamlPlace& place)
{
    std::string text = scalar_text(node, place);
    std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
    if (text == "true" || text == "1" || text == "yes" || text == "on") return true;
    if (text == "false" || text == "0" || text == "no" || text == "off") return false;
    refuse(place, node, "true or false", text);
}

std::string joined(const std::vector<std::string>& words)
{
    std::string out;
    for (const auto& w : words) out += (out.empty() ? "" : ", ") + w;
    return out;
}
}  // namespace

// ---- Declarations -----------------------------------------------------------------------------------------

void ParameterDeclaration::number(const std::string& name, double& value, const std::string& unit,
                                  const Range& range, const std::string& help, Need need)
{
    custom({name, "number", unit, range.text(), help, to_text(value), need == Need::Required,
            [&value, range, unit](const auto& node, const auto& place)
            { value = number_from(node, place, range, unit); },
            [&value]() { return yaml::node_t(to_text(value)); }});
}

void ParameterDeclaration::integer(const std::string& name, uint32_t& value, const Range& range,
                                   const std::string& help, Need need)
{
    const auto load = [&value, range](const yaml::node_t& node, const YamlPlace& place)
    {
        const double number = number_from(node, place, range, "");
        if (number != std::floor(number) || number < 0 || number > std::numeric_limits<uint32_t>::max())
            refuse(place, node, "a whole number, not negative", to_text(number));
        value = static_cast<uint32_t>(number);
    };
    custom({name, "integer", "", range.text(), help, std::to_string(value), need == Need::Required, load,
            [&value]() { return yaml::node_t(std::to_string(value)); }});
}

void ParameterDeclaration::flag(const std::string& name, bool& value, const std::string& help, Need need)
{
    custom({name, "true/false", "", "", help, value ? "true" : "false", need == Need::Required,
            [&value](const auto& node, const auto& place) { value = flag_from(node, place); },
            [&value]() { return yaml::node_t(std::string(value ? "true" : "false")); }});
}

void ParameterDeclaration::text(const std::string& name, std::string& value, const std::string& help,
                                Need need)
{
    custom({name, "text", "", "", help, "\"" + value + "\"", need == Need::Required,
            [&value](const auto& node, const auto& place)
            { value = node.isNullNode() ? std::string() : scalar_text(node, place); },
            [&value]() { return yaml::node_t(value); }});
}

void ParameterDeclaration::formula(const std::string& name, Formula& value, const std::string& unit,
                                   const Range& range, const std::string& help, Need need)
{
    custom({name, "number or formula", unit, range.text(), help, value.text(), need == Need::Required,
            [&value, range, unit](const auto& node, const auto& place)
            { value = formula_from(node, place, range, unit); },
            [&value]() { return yaml::node_t(value.text()); }});
}

void ParameterDeclaration::formulas(const std::string& name, Formula* values, size_t count,
                                    const std::string& unit, const std::string& help, Need need)
{
    const auto load = [=](const yaml::node_t& node, const YamlPlace& place)
    {
        if (!node.isSequence() || node.size() != count)
            throw ConfigError(place.text(&node) + ": expected a list of " + std::to_string(count) +
                              " numbers");
        for (size_t i = 0; i < count; i++)
            values[i] = formula_from(node.asSequence()[i], place.item(i), Range::any(), unit);
    };
    const auto save = [=]()
    {
        yaml::node_t list = yaml::Sequence();
        for (size_t i = 0; i < count; i++) list.asSequence().push_back(yaml::node_t(values[i].text()));
        return list;
    };
    std::vector<std::string> defaults;
    for (size_t i = 0; i < count; i++) defaults.push_back(values[i].text());
    custom({name, "list of " + std::to_string(count) + " numbers or formulas", unit, "", help,
            "[" + joined(defaults) + "]", need == Need::Required, load, save});
}

void ParameterDeclaration::texts(const std::string& name, std::vector<std::string>& values,
                                 const std::string& help, Need need)
{
    const auto load = [&values](const yaml::node_t& node, const YamlPlace& place)
    {
        values.clear();
        if (!node.isSequence()) return values.push_back(scalar_text(node, place));
        for (size_t i = 0; i < node.size(); i++)
            values.push_back(scalar_text(node.asSequence()[i], place.item(i)));
    };
    const auto save = [&values]()
    {
        yaml::node_t list = yaml::Sequence();
        for (const auto& v : values) list.asSequence().push_back(yaml::node_t(v));
        return list;
    };
    custom({name, "text or list of texts", "", "", help, "[" + joined(values) + "]", need == Need::Required,
            load, save});
}

void ParameterDeclaration::group(const std::string& name, Parameterizable& part, const std::string& help,
                                 Need need)
{
    custom({name, "map", "", "", help + "\n" + part.describe_parameters(), "", need == Need::Required,
            [&part](const auto& node, const auto& place) { part.load_parameters(yaml(node), place); },
            [&part]() { return part.save_parameters().node(); }});
}

void ParameterDeclaration::choice_by_index(const std::string& name, const std::string& enum_name,
                                           const std::vector<std::string>& names, std::function<size_t()> get,
                                           std::function<void(size_t)> set, const std::string& help,
                                           Need need)
{
    const auto full = [enum_name](const std::string& n) { return enum_name + "::" + n; };
    const auto load = [=](const yaml::node_t& node, const YamlPlace& place)
    {
        const std::string text = scalar_text(node, place);
        for (size_t i = 0; i < names.size(); i++)
            if (text == names[i] || text == full(names[i])) return set(i);
        const std::string nearest =
            nearest_name(text.substr(text.rfind(':') == std::string::npos ? 0 : text.rfind(':') + 1), names);
        refuse(
            place, node,
            "one of " + joined(names) + (nearest.empty() ? "" : " (did you mean '" + full(nearest) + "'?)"),
            text);
    };
    custom({name, enum_name, "", joined(names), help, full(names[get()]), need == Need::Required, load,
            [=]() { return yaml::node_t(full(names[get()])); }});
}

// ---- Uses -------------------------------------------------------------------------------------------------

std::string ParameterDeclaration::given_name(const Entry& e, const yaml& params, const YamlPlace& place) const
{
    if (!params.isMap()) return {};
    std::string given = params.has(e.name) ? e.name : std::string();
    for (const auto& [older, name] : older_names_)
    {
        if (name != e.name || !params.has(older)) continue;
        if (!given.empty())
            throw ConfigError(place.key(older).text(&params.asMap().at(older)) + ": '" + older +
                              "' is the older name of '" + name + "'; only one of '" + given + "' and '" +
                              older + "' may be given");
        given = older;
    }
    return given;
}

void ParameterDeclaration::load(const yaml& params, const YamlPlace& place) const
{
    std::vector<std::string> names;
    for (const auto& e : entries_) names.push_back(e.name);
    for (const auto& [older, name] : older_names_) names.push_back(older);
    const bool empty = params.isNullNode() || (params.isMap() && params.size() == 0);
    if (!empty) check_keys(params, place, names);
    for (const auto& e : entries_)
    {
        if (const std::string key = given_name(e, params, place); !key.empty())
            e.load(params.asMap().at(key), place.key(key));
        else if (e.required)
            throw ConfigError(place.text(&params.node()) + ": the required key '" + e.name +
                              "' is missing (" + e.help + ")");
    }
    for (const auto& rule : rules_)
        if (const std::string broken = rule(); !broken.empty())
            throw ConfigError(place.text(&params.node()) + ": " + broken);
}

yaml ParameterDeclaration::save() const
{
    yaml out = yaml::Map();
    for (const auto& e : entries_)
        if (const auto value = e.save ? e.save() : yaml::node_t(); !value.isNullNode())
            out.asMap()[e.name] = value;
    return out;
}

std::string ParameterDeclaration::describe() const
{
    std::ostringstream out;
    for (const auto& e : entries_)
    {
        out << "  " << e.name << ": " << e.type;
        if (!e.unit.empty()) out << " [" << e.unit << "]";
        if (e.required)
            out << ", required";
        else if (!e.default_text.empty())
            out << ", default " << e.default_text;
        if (!e.range.empty() && e.range != "any") out << ", range " << e.range;
        for (const auto& [older, name] : older_names_)
            if (name == e.name) out << ", older name " << older;
        std::istringstream help(e.help);
        for (std::string line; std::getline(help, line);) out << "\n      " << line;
        out << "\n";
    }
    return out.str();
}

void Parameterizable::load_parameters(const yaml& params, const YamlPlace& place)
{
    ParameterDeclaration declaration;
    declare_parameters(declaration);
    declaration.load(params, place);
}

// Declaring binds members by reference and changes none of them; saving and describing only read through the
// bindings.
yaml Parameterizable::save_parameters() const
{
    ParameterDeclaration declaration;
    const_cast<Parameterizable*>(this)->declare_parameters(declaration);
    return declaration.save();
}

std::string Parameterizable::describe_parameters() const
{
    ParameterDeclaration declaration;
    const_cast<Parameterizable*>(this)->declare_parameters(declaration);
    return declaration.describe();
}

RunVariables Parameterizable::variables(const RunVariables& of_the_run) const
{
    RunVariables all = of_the_run;
    if (source_) all.insert(source_->getVariableValues().begin(), source_->getVariableValues().end());
    return all;
}

double checked_value(const Formula& formula, const RunVariables& variables, const std::string& name,
                     const Range& range)
{
    const double value = formula.value(variables);
    if (!range.contains(value))
        throw std::runtime_error("parameter '" + name + "' = " + formula.text() + " gives " + to_text(value) +
                                 ", outside " + range.text());
    return value;
}

}  // namespace mp2p_icp
