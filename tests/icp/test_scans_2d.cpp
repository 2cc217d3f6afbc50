// Scans of a 2-D laser, by pipelines that look at different things: where they agree, they can be believed.
// bench-scans_2d does the same on all pairs of any rawlog.
#include <gtest/gtest.h>

#include <array>

#include "laser_rawlog.h"
#include "test_data.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;
using mrpt::poses::CPose3D;

namespace
{
struct Share
{
    size_t good = 0, of = 0;
    void count(bool is_good) { good += is_good, of++; }
    double value() const { return static_cast<double>(good) / static_cast<double>(of); }
};
}  // namespace

TEST(scans_2d, points_lines_and_walls_agree_on_consecutive_scans)
{
    const auto path = mrpt_dataset("2006-01ENE-21-SENA_Telecom Faculty_one_loop_only.rawlog");
    MP2P_ICP_SKIP_WITHOUT(path);
    const auto scans = laser_scans(path);
    std::vector<Pipeline> pipelines;
    for (const auto* name : {"icp-2d-laser", "icp-2d-point-to-line", "icp-2d-walls"})
        pipelines.push_back(pipeline_from_yaml(yaml_from_text(shipped_pipeline(name))));
    Share coarse, fine, walls, identity;
    for (size_t k = 0; k + 1 < scans.size(); k += 6)
    {
        std::array<Results, 3> r;
        for (size_t m = 0; m < 3; m++)
            pipelines[m].icp->align(map_of_scan(pipelines[m], *scans[k + 1].scan),
                                    map_of_scan(pipelines[m], *scans[k].scan), {}, pipelines[m].parameters,
                                    r[m], planar_prior({}));
        const CPose3D points = r[0].optimal_tf.mean, line = r[1].optimal_tf.mean, wall = r[2].optimal_tf.mean;
        coarse.count(r[0].trusted() && r[1].trusted() && agree(points, line, 0.05, 1.0));
        fine.count(r[0].trusted() && r[1].trusted() && agree(points, line, 0.02, 0.3));
        identity.count(agree(points, {}, 0.05, 1.0));
        ASSERT_EQ(r[2].finalPairings.paired_pt2pt.size(), 0u);
        if (determines_plane(r[2]))
            walls.count(agree(points, wall, 0.05, 1.0) && agree(line, wall, 0.05, 1.0));
    }
    std::cout << coarse.of << " pairs: points and point to line within 5 cm and 1 deg " << coarse.value()
              << ", 2 cm and 0.3 deg " << fine.value() << "; walls with both " << walls.value() << " of "
              << walls.of << "\n";
    EXPECT_GE(coarse.value(), 0.95);
    EXPECT_GE(fine.value(), 0.80);
    EXPECT_GE(walls.value(), 0.90);
    EXPECT_GE(walls.of, coarse.of / 2);
    EXPECT_LT(identity.value(), 0.5) << "the test must not be passed by the identity";
}
