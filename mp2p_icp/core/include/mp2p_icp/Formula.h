#pragma once

#include <map>
#include <memory>
#include <string>

namespace mp2p_icp
{
/// Values of the variables that formulas may use, by name (e.g. `ICP_ITERATION`).
using RunVariables = std::map<std::string, double>;

/** A number that may be written as a formula of run variables, such as `"0.5 + 2*exp(-0.2*ICP_ITERATION)"`.
 *
 * The syntax is exprtk's, through mrpt::expr. A formula without variables is folded to a constant when it is
 * set. Syntax errors are found when the formula is set, unknown variables when it is evaluated.
 *
 * Thread-safety: value() may be called from several threads at once. Cost: a constant is a plain read; a
 * formula takes a lock and about a microsecond, so evaluate it once per iteration and never per point.
 */
class Formula
{
 public:
    Formula() = default;
    Formula(double constant) : constant_(constant) {}  // NOLINT: numbers are formulas

    /// \exception std::invalid_argument if the text is not a valid expression; the message quotes it.
    explicit Formula(const std::string& text);

    /// The value now. \exception std::runtime_error if a variable is missing; the message lists the known
    /// ones.
    double value(const RunVariables& variables) const;

    /// The value of a constant formula. \exception std::runtime_error if it depends on variables.
    double value() const { return value({}); }

    bool is_constant() const { return !compiled_; }

    /// As it was written; numbers with up to 17 significant digits.
    std::string text() const;

 private:
    struct Compiled;
    double constant_ = 0;
    std::shared_ptr<Compiled> compiled_;
};

/** Where modules read the variables of their formulas from. A handle: copies share the same values.
 * Modules that were attached to a source keep it alive, so neither side can dangle.
 * Not thread-safe while being updated.
 */
class ParameterSource
{
 public:
    ParameterSource() : values_(std::make_shared<RunVariables>()) {}

    void updateVariable(const std::string& name, double value) { (*values_)[name] = value; }
    void updateVariables(const RunVariables& values)
    {
        for (const auto& [name, value] : values) updateVariable(name, value);
    }
    const RunVariables& getVariableValues() const { return *values_; }

 private:
    std::shared_ptr<RunVariables> values_;
};

}  // namespace mp2p_icp
