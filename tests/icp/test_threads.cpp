#include <gtest/gtest.h>
#include <mp2p_icp/ICP.h>
#include <mrpt/io/CMemoryStream.h>
#include <mrpt/serialization/CArchive.h>

#ifdef MP2P_ICP_TEST_TBB
#include <tbb/global_control.h>
#endif

#include "icp_test_tools.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

#ifdef MP2P_ICP_TEST_TBB
TEST(ICP, same_bits_of_the_whole_result_for_1_2_3_and_8_threads)
{
    const auto truth = pose_deg(0.04, -0.03, 0.02, 5, -3, 4);
    const auto bytes_with = [&](size_t threads)
    {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        // Fresh maps: the indexes are built under this number of threads, too.
        const metric_map_t global = map_of(wavy_surface(8000, 1, 0.002)),
                           local = map_of(seen_from(truth, *wavy_surface(8000, 2, 0.002)));
        Bench bench(0.2);
        bench.matcher->maxLocalPointsPerLayer_ = 6000;
        const Results r = bench.align(local, global);
        EXPECT_EQ(r.verdict, Verdict::aligned);
        mrpt::io::CMemoryStream stream;
        auto archive = mrpt::serialization::archiveFrom(stream);
        r.serializeTo(archive);
        return std::string(static_cast<const char*>(stream.getRawBufferData()), stream.getTotalBytesCount());
    };
    const std::string one = bytes_with(1);
    EXPECT_GT(one.size(), 100000u);  // all the pairings are in it
    for (const size_t threads : {2, 3, 8}) EXPECT_EQ(bytes_with(threads), one) << threads << " threads";
}
#endif
