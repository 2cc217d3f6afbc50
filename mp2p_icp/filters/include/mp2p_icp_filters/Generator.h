#pragma once

#include <mp2p_icp/Parameterizable.h>
#include <mp2p_icp/metricmap.h>
#include <mp2p_icp/observation_points.h>
#include <mrpt/obs/CObservation.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/rtti/CObject.h>
#include <mrpt/system/COutputLogger.h>

#include <optional>
#include <string>
#include <vector>

namespace mp2p_icp_filters
{
using mrpt::containers::yaml;

/// What process() and apply_generators() did; they add to it.
struct GeneratorsReport
{
    uint64_t points_made = 0;               ///< points that were put into layers
    uint64_t points_dropped_nonfinite = 0;  ///< points left out for a coordinate that is not finite
    size_t observations_used = 0;           ///< observations that some generator took
};

/** Turns the observations it is meant for (by class name and sensor label) into points of one layer.
 * Configured once, const while running: several threads may use one generator at once, on different maps.
 *
 * The regular expressions (ECMAScript) must match the whole text: the class name, with or without its
 * namespace, and the label.
 */
class Generator : public mrpt::rtti::CObject,
                  public mrpt::system::COutputLogger,
                  public mp2p_icp::Parameterizable
{
    DEFINE_MRPT_OBJECT(Generator, mp2p_icp_filters)

 public:
    Generator() : mrpt::system::COutputLogger("Generator") {}

    /// Sets the parameters. \exception mp2p_icp::ConfigError
    void initialize(const yaml& params, const mp2p_icp::YamlPlace& place = {})
    {
        load_parameters(params, place);
    }
    void declare_parameters(mp2p_icp::ParameterDeclaration& declare) override;

    /** Adds the points of the observation to the layer (made if missing), moved by the robot's pose if given;
     * the sensor's pose on the robot is always applied. The layer is also made, and left empty, where an
     * expression is the empty text: the idiom for "make the layer, insert nothing". \param report if given,
     * the numbers of points made and dropped are added to it \return false if the observation is not one for
     * this generator, or is of a kind without points. \exception std::runtime_error for a kind without
     * points, if throw_on_unhandled_observation_class; std::invalid_argument if the layer is there and is not
     * a cloud; mp2p_icp::DataError for an observation with damaged contents.
     */
    virtual bool process(const mrpt::obs::CObservation& observation, mp2p_icp::metric_map_t& out,
                         const std::optional<mrpt::poses::CPose3D>& robotPose = std::nullopt,
                         GeneratorsReport* report = nullptr) const;

    std::string target_layer = mp2p_icp::metric_map_t::PT_LAYER_RAW;
    std::string process_class_names_regex = ".*";
    std::string process_sensor_labels_regex =
        ".*";  ///< the empty text matches nothing: "make the layer, insert nothing"
    bool throw_on_unhandled_observation_class = false;
    std::string layer_class =
        "mrpt::maps::CSimplePointsMap";  ///< a cloud class; from `metric_map_definition: {class: ...}`
    mp2p_icp::ObservationPointsOptions points_options;
};

using GeneratorSet = std::vector<Generator::Ptr>;

/// Offers the observation, or each of a frame, to every generator of the set.
GeneratorsReport apply_generators(const GeneratorSet& generators, const mrpt::obs::CObservation& observation,
                                  mp2p_icp::metric_map_t& out,
                                  const std::optional<mrpt::poses::CPose3D>& robotPose = std::nullopt);
GeneratorsReport apply_generators(const GeneratorSet& generators, const mrpt::obs::CSensoryFrame& frame,
                                  mp2p_icp::metric_map_t& out,
                                  const std::optional<mrpt::poses::CPose3D>& robotPose = std::nullopt);

/// As filter_pipeline_from_yaml(). A null or empty list gives one Generator with default parameters.
GeneratorSet generators_from_yaml(const yaml& list, const mp2p_icp::YamlPlace& place = {},
                                  mrpt::system::VerbosityLevel verbosity = mrpt::system::LVL_INFO);
/// \overload From a file, under its top key `generators`.
GeneratorSet generators_from_yaml_file(const std::string& file_name,
                                       mrpt::system::VerbosityLevel verbosity = mrpt::system::LVL_INFO);

}  // namespace mp2p_icp_filters
