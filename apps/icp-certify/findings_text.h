#pragma once

#include <string>

#include "check_certificate.h"

namespace mp2p_icp_certify
{
/// In plain words; the verdict is the last line, or the last ones if more than one check fails.
std::string findings_in_words(const Findings& findings);

/// The same as YAML; docs/formats.md has its keys.
std::string findings_as_yaml(const Findings& findings);

}  // namespace mp2p_icp_certify
