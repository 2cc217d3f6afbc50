#include "metadata_text.h"

#include <mp2p_icp/errors.h>
#include <mp2p_icp/yaml_text.h>

namespace mp2p_icp
{
std::string metadata_to_text(const yaml& metadata)
{
    return to_yaml_text(metadata);
}

yaml metadata_from_text(const std::string& text)
{
    const yaml metadata = yaml_from_text(text);
    if (!metadata.isMap())
        throw ConfigError("metadata: expected a map, found a " + metadata.node().typeName());
    return metadata;
}

}  // namespace mp2p_icp
