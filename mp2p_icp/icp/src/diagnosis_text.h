#pragma once

#include <mp2p_icp/diagnosis.h>

#include <string>
#include <vector>

#include "diagnosis_search.h"

namespace mp2p_icp
{
/// Of the layer that is matched.
struct PointCount
{
    size_t all = 0, finite = 0;
    layer_name_t layer;
};
PointCount count_points(const mrpt::maps::CPointsMap::ConstPtr& cloud);

/// What the sentences tell, besides the log and the diagnosis.
struct DiagnosisFacts
{
    PointCount local, global;
    RunEnds run;
    double nearby = 0;  ///< see MapFit, m; 0: not known
    double overlap_at_guess = 0;
    double missed_by = 0;  ///< what the local points move from the guess to the better pose, m
    std::string trouble;   ///< why the cause could not be looked for
};

std::vector<std::string> sentences_for(const LogRecord& log, const Diagnosis& diagnosis,
                                       const DiagnosisFacts& facts);

}  // namespace mp2p_icp
