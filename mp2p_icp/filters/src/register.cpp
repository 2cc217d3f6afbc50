#include "register.h"

#include <mp2p_icp_filters/FilterBoundingBox.h>
#include <mp2p_icp_filters/FilterByRange.h>
#include <mp2p_icp_filters/FilterDecimateVoxels.h>
#include <mp2p_icp_filters/FilterDeleteLayer.h>
#include <mp2p_icp_filters/FilterEdgesPlanes.h>
#include <mp2p_icp_filters/FilterLines.h>
#include <mp2p_icp_filters/FilterPlanes.h>
#include <mp2p_icp_filters/Generator.h>
#include <mrpt/core/initializer.h>

namespace mp2p_icp_filters
{
void register_classes()
{
    static const bool done = []()
    {
        for (const auto* id :
             {CLASS_ID(FilterBase), CLASS_ID(FilterBoundingBox), CLASS_ID(FilterByRange),
              CLASS_ID(FilterDecimateVoxels), CLASS_ID(FilterDeleteLayer), CLASS_ID(FilterEdgesPlanes),
              CLASS_ID(FilterLines), CLASS_ID(FilterPlanes), CLASS_ID(Generator)})
            mrpt::rtti::registerClass(id);
        return true;
    }();
    static_cast<void>(done);
}
}  // namespace mp2p_icp_filters

MRPT_INITIALIZER(register_mp2p_icp_filters)
{
    mp2p_icp_filters::register_classes();
}
