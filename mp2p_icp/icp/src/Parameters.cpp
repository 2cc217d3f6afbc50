#include <mp2p_icp/Parameters.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/numbers.h>

namespace mp2p_icp
{
namespace
{
struct Checkpoint : public Parameterizable
{
    uint32_t iteration = 0;
    double minimum_quality = 0;
    void declare_parameters(ParameterDeclaration& declare) override
    {
        declare.integer("iteration", iteration, {1, 1e9, false, false}, "after so many iterations",
                        Need::Required);
        declare.number("minimum_quality", minimum_quality, "", Range::between(0, 1), "least quality to go on",
                       Need::Required);
    }
};

ParameterDeclaration::Entry checkpoints_entry(std::map<uint32_t, double>& checkpoints)
{
    const auto load = [&checkpoints](const yaml::node_t& node, const YamlPlace& place)
    {
        if (!node.isSequence())
            throw ConfigError(place.text(&node) +
                              ": expected a list of {iteration, minimum_quality}; [] for none");
        checkpoints.clear();
        for (size_t i = 0; i < node.size(); i++)
        {
            Checkpoint c;
            c.load_parameters(yaml(node.asSequence()[i]), place.item(i));
            if (!checkpoints.emplace(c.iteration, c.minimum_quality).second)
                throw ConfigError(place.item(i).text(&node) + ": iteration " + std::to_string(c.iteration) +
                                  " stands twice");
        }
    };
    const auto save = [&checkpoints]()
    {
        yaml::node_t list = yaml::Sequence();
        for (const auto& [iteration, quality] : checkpoints)
        {
            Checkpoint c;
            c.iteration = iteration, c.minimum_quality = quality;
            list.asSequence().push_back(c.save_parameters().node());
        }
        return list;
    };
    std::string defaults;
    for (const auto& [iteration, quality] : checkpoints)
        defaults += (defaults.empty() ? "" : ", ") + std::to_string(iteration) + ": " + to_text(quality);
    return {"quality_checkpoints",
            "list of {iteration, minimum_quality}",
            "",
            "",
            "stop early where an alignment is hopeless; what evaluators discard they discard at the end",
            "{" + defaults + "}",
            false,
            load,
            save};
}
}  // namespace

void Parameters::declare_parameters(ParameterDeclaration& declare)
{
    declare.integer("maxIterations", maxIterations, {1, 1e9, false, false}, "stop after so many iterations",
                    Need::Required);
    declare.number("minAbsStep_trans", minAbsStep_trans, "m", Range::not_negative(),
                   "converged when a step is smaller than this and ...");
    declare.number("minAbsStep_rot", minAbsStep_rot, "rad", Range::not_negative(), "... smaller than this");
    declare.number("maxMotionOverThreshold", maxMotionOverThreshold, "", Range::positive(),
                   "diverged when the local points' centre has moved by more than so many times the first "
                   "matching distance");
    declare.custom(checkpoints_entry(quality_checkpoints));
    declare.flag("debugPrintIterationProgress", debugPrintIterationProgress, "print one line per iteration");
    declare.flag("generateDebugFiles", generateDebugFiles, "write a log file of every run");
    declare.text("debugFileNameFormat", debugFileNameFormat,
                 "its name; tokens $UNIQUE_ID $LOCAL_ID $LOCAL_LABEL $GLOBAL_ID $GLOBAL_LABEL");
    declare.integer("decimationDebugFiles", decimationDebugFiles, {1, 1e9, false, false},
                    "write the log of one run of so many");
    declare.flag("saveIterationDetails", saveIterationDetails,
                 "keep poses and pairings of the iterations in the log");
    declare.integer("decimationIterationDetails", decimationIterationDetails, {1, 1e9, false, false},
                    "of one iteration of so many");
}

}  // namespace mp2p_icp
