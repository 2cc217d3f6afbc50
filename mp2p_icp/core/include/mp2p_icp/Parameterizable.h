#pragma once

#include <mp2p_icp/Formula.h>
#include <mp2p_icp/yaml_tools.h>

#include <array>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace mp2p_icp
{
/// Must the key be there, or does the member keep its value without it?
enum class Need : uint8_t
{
    Optional,
    Required
};

/// The values a number may have.
struct Range
{
    double lo = -std::numeric_limits<double>::infinity();
    double hi = std::numeric_limits<double>::infinity();
    bool lo_open = false, hi_open = false;  ///< is the end itself excluded?

    bool contains(double value) const;
    std::string text() const;  ///< such as `(0, inf)`

    static Range any() { return {}; }
    static Range positive() { return {0, std::numeric_limits<double>::infinity(), true, true}; }
    static Range not_negative() { return {0, std::numeric_limits<double>::infinity(), false, true}; }
    static Range between(double lo, double hi) { return {lo, hi, false, false}; }
    static Range open(double lo, double hi) { return {lo, hi, true, true}; }
};

class Parameterizable;

/** The parameters of a part, declared once, each bound to the member that holds it. This one list loads YAML
 * (refusing unknown keys and values out of range), writes YAML and prints the reference.
 */
class ParameterDeclaration
{
 public:
    struct Entry
    {
        std::string name, type, unit, range, help, default_text;
        bool required = false;
        std::function<void(const yaml::node_t&, const YamlPlace&)> load;
        std::function<yaml::node_t()> save;  ///< empty, or giving a null node: not written
    };

    void number(const std::string& name, double& value, const std::string& unit, const Range& range,
                const std::string& help, Need need = Need::Optional);
    void integer(const std::string& name, uint32_t& value, const Range& range, const std::string& help,
                 Need need = Need::Optional);
    void flag(const std::string& name, bool& value, const std::string& help, Need need = Need::Optional);
    void text(const std::string& name, std::string& value, const std::string& help,
              Need need = Need::Optional);
    /// A number or a formula of run variables. The range is checked at once for constants, by checked_value()
    /// otherwise.
    void formula(const std::string& name, Formula& value, const std::string& unit, const Range& range,
                 const std::string& help, Need need = Need::Optional);
    /// A list of exactly N numbers or formulas.
    void formulas(const std::string& name, Formula* values, size_t count, const std::string& unit,
                  const std::string& help, Need need = Need::Optional);
    /// One text, or a list of texts.
    void texts(const std::string& name, std::vector<std::string>& values, const std::string& help,
               Need need = Need::Optional);
    /// A nested map with parameters of its own.
    void group(const std::string& name, Parameterizable& part, const std::string& help,
               Need need = Need::Optional);
    /// Anything else.
    void custom(Entry entry) { entries_.push_back(std::move(entry)); }

    /// One of several names, written `Enum::Name` or just `Name`.
    template <class Enum>
    void choice(const std::string& name, Enum& value, const std::string& enum_name,
                const std::vector<std::pair<Enum, std::string>>& options, const std::string& help,
                Need need = Need::Optional)
    {
        std::vector<std::string> names;
        for (const auto& option : options) names.push_back(option.second);
        const auto get = [&value, options]()
        {
            size_t i = 0;
            while (options[i].first != value) i++;
            return i;
        };
        choice_by_index(
            name, enum_name, names, get, [&value, options](size_t i) { value = options[i].first; }, help,
            need);
    }

    /// `older` is accepted in place of `name`, which must have been declared. Giving both is an error.
    void older_name(const std::string& older, const std::string& name) { older_names_[older] = name; }

    /// Adds a check over several parameters, run after loading: returns the broken rule, or an empty text.
    void rule(std::function<std::string()> check) { rules_.push_back(std::move(check)); }

    const std::vector<Entry>& entries() const { return entries_; }

    void load(const yaml& params, const YamlPlace& place) const;
    yaml save() const;
    std::string describe() const;  ///< one block of text per parameter

 private:
    void choice_by_index(const std::string& name, const std::string& enum_name,
                         const std::vector<std::string>& names, std::function<size_t()> get,
                         std::function<void(size_t)> set, const std::string& help, Need need);

    /// The key under which the parameter stands in `params`: its name or its older name; empty if it is not
    /// there.
    std::string given_name(const Entry& entry, const yaml& params, const YamlPlace& place) const;

    std::vector<Entry> entries_;
    std::map<std::string, std::string> older_names_;  ///< older name -> name
    std::vector<std::function<std::string()>> rules_;
};

/** A part with parameters. Derived classes override declare_parameters(), calling their base's first. */
class Parameterizable
{
 public:
    virtual ~Parameterizable() = default;

    /// Binds every parameter to its member. Called again for each use, so it must only declare.
    virtual void declare_parameters(ParameterDeclaration& declare) = 0;

    /** Sets the parameters from a map of keys and values; keys that are not given keep their value.
     * \exception ConfigError on an unknown key, a missing required one, a wrong type, a value out of range, a
     * broken rule. The message names the place; then the object may be half-set and must not be used.
     */
    void load_parameters(const yaml& params, const YamlPlace& place = {});
    yaml save_parameters() const;
    std::string describe_parameters() const;

    /// Formulas of this part see the variables of `source` from now on.
    void attachToParameterSource(const ParameterSource& source) { source_ = source; }

 protected:
    /// The attached variables together with those of the run (which win).
    RunVariables variables(const RunVariables& of_the_run = {}) const;

 private:
    std::optional<ParameterSource> source_;
};

/// `formula.value(variables)`, checked. \exception std::runtime_error naming the parameter, the value and the
/// range.
double checked_value(const Formula& formula, const RunVariables& variables, const std::string& name,
                     const Range& range);

}  // namespace mp2p_icp
