#pragma once

namespace mp2p_icp_filters
{
/** Registers the filters and generators of this library in MRPT's class factory. Runs at start-up by itself;
 * the YAML loaders call it too, because a static library's start-up code is dropped by the linker where
 * nothing refers to it. Cheap after the first call.
 */
void register_classes();
}  // namespace mp2p_icp_filters
