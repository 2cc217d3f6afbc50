#include <mp2p_icp/ICP.h>
#include <mp2p_icp/PipelineRecord.h>
#include <mp2p_icp/modules_from_yaml.h>
#include <mp2p_icp/numbers.h>
#include <mp2p_icp/yaml_text.h>
#include <mrpt/serialization/CArchive.h>
#include <mrpt/serialization/stl_serialization.h>

#include <typeinfo>

namespace mp2p_icp
{
using mrpt::serialization::CArchive;

namespace
{
/// A part's own variables are for the part alone, and for its log.
class VariablesOf : public Parameterizable
{
 public:
    static RunVariables get(const Parameterizable& part) { return (part.*&VariablesOf::variables)({}); }
};

template <class Module>
StageRecord record_of(const Module& module, double weight = 1.0)
{
    const auto made = mrpt::rtti::CObject::Ptr(module.GetRuntimeClass()->createObject());
    return {module.GetRuntimeClass()->className,
            module.save_parameters(),
            module.enabled,
            weight,
            VariablesOf::get(module),
            !made || typeid(*made) != typeid(module)};
}

yaml to_list(const std::vector<StageRecord>& stages, bool with_weight)
{
    yaml list = yaml::Sequence();
    for (const auto& stage : stages)
    {
        yaml entry = yaml::Map();
        entry.asMap()["class"] = yaml::node_t(stage.class_name);
        entry.asMap()["params"] = stage.params.node();
        entry.asMap()["enabled"] = yaml::node_t(std::string(stage.enabled ? "true" : "false"));
        if (with_weight) entry.asMap()["weight"] = yaml::node_t(to_text(stage.weight));
        list.asSequence().push_back(entry.node());
    }
    return list;
}

void attach(Parameterizable& part, const StageRecord& stage)
{
    ParameterSource source;
    source.updateVariables(stage.variables);
    part.attachToParameterSource(source);
}

void write_stages(CArchive& out, const std::vector<StageRecord>& stages)
{
    out.WriteAs<uint32_t>(stages.size());
    for (const auto& s : stages)
        out << s.class_name << to_yaml_text(s.params) << s.enabled << s.weight << s.variables << s.nameless;
}

std::vector<StageRecord> read_stages(CArchive& in)
{
    std::vector<StageRecord> stages;
    for (auto left = in.ReadAs<uint32_t>(); left > 0; left--)
    {
        StageRecord s;
        std::string params;
        in >> s.class_name >> params >> s.enabled >> s.weight >> s.variables >> s.nameless;
        s.params = yaml_from_text(params);
        stages.push_back(std::move(s));
    }
    return stages;
}
}  // namespace

PipelineRecord PipelineRecord::of(const ICP& icp)
{
    PipelineRecord out;
    out.class_name = icp.GetRuntimeClass()->className;
    for (const auto& m : icp.matchers()) out.matchers.push_back(record_of(*m));
    for (const auto& s : icp.solvers()) out.solvers.push_back(record_of(*s));
    for (const auto& q : icp.quality_evaluators()) out.quality.push_back(record_of(*q.obj, q.relativeWeight));
    return out;
}

yaml PipelineRecord::to_yaml(const Parameters& parameters) const
{
    yaml out = yaml::Map();
    out.asMap()["class_name"] = yaml::node_t(class_name);
    out.asMap()["params"] = parameters.save_parameters().node();
    out.asMap()["matchers"] = to_list(matchers, false).node();
    out.asMap()["solvers"] = to_list(solvers, false).node();
    out.asMap()["quality"] = to_list(quality, true).node();
    return out;
}

std::shared_ptr<ICP> PipelineRecord::make() const
{
    const YamlPlace place = {"", "the logged pipeline"};
    const auto icp = std::dynamic_pointer_cast<ICP>(
        object_from_yaml(yaml::node_t(class_name), place, CLASS_ID(ICP), "ICP"));
    icp->initialize_matchers(to_list(matchers, false), place.key("matchers"));
    icp->initialize_solvers(to_list(solvers, false), place.key("solvers"));
    icp->initialize_quality_evaluators(to_list(quality, true), place.key("quality"));
    for (size_t i = 0; i < matchers.size(); i++) attach(*icp->matchers()[i], matchers[i]);
    for (size_t i = 0; i < solvers.size(); i++) attach(*icp->solvers()[i], solvers[i]);
    for (size_t i = 0; i < quality.size(); i++) attach(*icp->quality_evaluators()[i].obj, quality[i]);
    return icp;
}

void PipelineRecord::serializeTo(CArchive& out) const
{
    out << class_name;
    for (const auto* stages : {&matchers, &solvers, &quality}) write_stages(out, *stages);
}

void PipelineRecord::serializeFrom(CArchive& in)
{
    in >> class_name;
    for (auto* stages : {&matchers, &solvers, &quality}) *stages = read_stages(in);
}

}  // namespace mp2p_icp
