#pragma once

#include <gtest/gtest.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp_filters/FilterBase.h>
#include <mrpt/maps/CColouredPointsMap.h>
#include <mrpt/maps/CPointsMapXYZI.h>
#include <mrpt/maps/CSimplePointsMap.h>

#include <string>
#include <vector>

namespace mp2p_icp_test
{
/// All fields of all points, point by point.
inline std::vector<std::vector<float>> all_fields(const mrpt::maps::CPointsMap& m)
{
    std::vector<std::vector<float>> out(m.size());
    for (size_t i = 0; i < m.size(); i++) m.getPointAllFields(i, out[i]);
    return out;
}

inline mrpt::maps::CSimplePointsMap::Ptr cloud_of(const std::vector<mrpt::math::TPoint3Df>& points)
{
    const auto m = mrpt::maps::CSimplePointsMap::Create();
    for (const auto& p : points) m->insertPoint(p.x, p.y, p.z);
    return m;
}

/// The points of a layer, as {x, y, z, other fields...}.
inline std::vector<std::vector<float>> layer_fields(const mp2p_icp::metric_map_t& m, const std::string& layer)
{
    return all_fields(*m.point_layer(layer));
}

/// A filter from the YAML text of its parameters.
template <class Filter>
Filter make_filter(const std::string& params)
{
    Filter f;
    f.initialize(mp2p_icp::yaml_from_text(params, "test.yaml"), {"test.yaml", "params"});
    return f;
}

/// `work` must throw a `Problem` whose text has all of `parts` in it.
template <class Problem, class Work>
void expect_problem(const Work& work, const std::vector<std::string>& parts)
{
    try
    {
        work();
        ADD_FAILURE() << "nothing was thrown; expected: " << (parts.empty() ? "" : parts[0]);
    }
    catch (const Problem& e)
    {
        for (const auto& part : parts)
            EXPECT_NE(std::string(e.what()).find(part), std::string::npos)
                << "'" << part << "' is not in: " << e.what();
    }
}

/// These parameters must be refused with a text that has all of `parts` in it.
template <class Filter>
void expect_refused(const std::string& params, const std::vector<std::string>& parts)
{
    expect_problem<mp2p_icp::ConfigError>([&]() { make_filter<Filter>(params); }, parts);
}

}  // namespace mp2p_icp_test
