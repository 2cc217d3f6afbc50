#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

namespace mp2p_icp_test
{
/// Path of a file of the optional extra data; empty if it is absent (then the test should GTEST_SKIP()).
inline std::string shared_data(const std::string& name)
{
    const std::string path = std::string(MP2P_ICP_SHARED_DATA) + "/" + name;
    return std::filesystem::exists(path) ? path : std::string();
}

/// Path of a dataset of Debian's package mrpt-common; empty if it is not installed.
inline std::string mrpt_dataset(const std::string& name)
{
    const std::string path = "/usr/share/mrpt/datasets/" + name;
    return std::filesystem::exists(path) ? path : std::string();
}

/// A fresh file name for this test, in the system's temporary folder.
inline std::string temp_path(const std::string& suffix)
{
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    std::string name = std::string("mp2p_icp_") + info->test_suite_name() + "_" + info->name() + suffix;
    for (auto& c : name)
        if (c == '/') c = '_';
    return (std::filesystem::temp_directory_path() / name).string();
}
}  // namespace mp2p_icp_test

#define MP2P_ICP_SKIP_WITHOUT(path) \
    if ((path).empty()) GTEST_SKIP() << "optional test data is absent: " #path
