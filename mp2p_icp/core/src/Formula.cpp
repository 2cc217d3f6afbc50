#include <mp2p_icp/Formula.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/numbers.h>
#include <mrpt/expr/CRuntimeCompiledExpression.h>

#include <mutex>
#include <optional>

namespace mp2p_icp
{
struct Formula::Compiled
{
    std::string text;
    RunVariables bound;  // the compiled expression holds references to these values
    mrpt::expr::CRuntimeCompiledExpression expression;
    std::mutex mutex;
};

namespace
{
// exprtk names one undefined symbol at a time: "... Undefined symbol: 'NAME' ..."
std::optional<std::string> undefined_symbol(const std::string& message)
{
    const std::string tag = "Undefined symbol: '";
    const auto at = message.find(tag);
    if (at == std::string::npos) return {};
    const auto from = at + tag.size();
    const auto to = message.find('\'', from);
    if (to == std::string::npos) return {};
    return message.substr(from, to - from);
}

[[noreturn]] void throw_missing_variable(const std::string& text, const std::string& name,
                                         const RunVariables& known)
{
    std::string list;
    for (const auto& [known_name, value] : known) list += (list.empty() ? "" : ", ") + known_name;
    throw std::runtime_error("formula '" + text + "' needs the variable '" + name +
                             "', which has no value here (" +
                             (list.empty() ? "no variables are known" : "known: " + list) + ")");
}
}  // namespace

Formula::Formula(const std::string& text)
{
    if (text.find_first_not_of(" \t\n") == std::string::npos)
        throw std::invalid_argument("an empty text is neither a number nor a formula");
    auto compiled = std::make_shared<Compiled>();
    compiled->text = text;
    for (;;)
    {
        try
        {
            compiled->expression.compile(text, compiled->bound, text);
            break;
        }
        catch (const std::exception& e)
        {
            const auto symbol = undefined_symbol(e.what());
            if (!symbol || !compiled->bound.emplace(*symbol, 0.0).second)
                throw std::invalid_argument("'" + text + "' is neither a number nor a valid formula");
        }
    }
    if (compiled->bound.empty())
        constant_ = compiled->expression.eval();
    else
        compiled_ = compiled;
}

double Formula::value(const RunVariables& variables) const
{
    if (!compiled_) return constant_;
    const std::lock_guard<std::mutex> lock(compiled_->mutex);
    for (auto& [name, value] : compiled_->bound)
    {
        const auto it = variables.find(name);
        if (it == variables.end()) throw_missing_variable(compiled_->text, name, variables);
        value = it->second;
    }
    return compiled_->expression.eval();
}

std::string Formula::text() const
{
    return compiled_ ? compiled_->text : to_text(constant_);
}

}  // namespace mp2p_icp
