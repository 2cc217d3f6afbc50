// SLAM with the scans of a rawlog (2-D laser, odometry): scan to scan, loops, and a pose graph of both.
//   slam-front-end FILE.rawlog OUTPUT_FOLDER       leaves trajectories there: time x y z qx qy qz qw (TUM)
#include <mp2p_icp/icp_pipeline_from_yaml.h>
#include <mrpt/graphs/CNetworkOfPoses.h>
#include <mrpt/graphslam/levmarq.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/obs/CRawlog.h>

#include <atomic>
#include <fstream>
#include <iostream>
#include <thread>

using mrpt::poses::CPose2D, mrpt::poses::CPose3D, mrpt::poses::CPose3DPDFGaussianInf;
using namespace mrpt::obs;
using namespace mp2p_icp;
using Trajectory = std::vector<CPose3D>;
using Maps = std::vector<metric_map_t>;

/// The pose of scan `to` as seen from scan `from`: what is known before, and what the scans say.
struct Link
{
    size_t from, to;
    CPose3DPDFGaussianInf prior;
    Results result;
};
using Links = std::vector<Link>;

/// Both kinds of rawlogs: actions and frames in turn, or a row of observations. Scans 0.1 m or 5 deg apart.
std::tuple<Trajectory, std::vector<double>, Maps> read_rawlog(
    const std::string& path, const mp2p_icp_filters::GeneratorSet& generators)
{
    CRawlog rawlog;
    if (!rawlog.loadFromRawLogFile(path)) throw std::runtime_error("cannot read " + path);
    std::tuple<Trajectory, std::vector<double>, Maps> out;
    auto& [odometry, times, maps] = out;
    CPose3D now;
    for (const auto& entry : rawlog)
    {
        const auto actions = std::dynamic_pointer_cast<CActionCollection>(entry);
        if (const auto move = actions ? actions->getBestMovementEstimation() : nullptr)
            now = now + CPose3D(move->poseChange->getMeanVal());
        if (const auto wheels = std::dynamic_pointer_cast<CObservationOdometry>(entry))
            now = CPose3D(wheels->odometry);
        auto scan = std::dynamic_pointer_cast<CObservation2DRangeScan>(entry);
        if (const auto frame = std::dynamic_pointer_cast<CSensoryFrame>(entry))
            scan = frame->getObservationByClass<CObservation2DRangeScan>();
        const CPose3D moved = odometry.empty() ? CPose3D(1, 0, 0) : now - odometry.back();
        if (!scan || (moved.norm() < 0.1 && std::abs(moved.yaw()) < mrpt::DEG2RAD(5.0))) continue;
        apply_generators(generators, *scan, maps.emplace_back());
        times.push_back(mrpt::Clock::toDouble(scan->timestamp));
        odometry.push_back(now);
    }
    return out;
}

/// Of planar motion: z, pitch, roll stay. 1 is the weight of a pairing, which is taken to be good to 0.1 m.
CPose3DPDFGaussianInf planar_prior(const CPose3D& mean, double sigma_m, double sigma_rad)
{
    CPose3DPDFGaussianInf prior(mean);
    const double xy = mrpt::square(0.1 / sigma_m), yaw = mrpt::square(0.1 / sigma_rad);
    prior.cov_inv.setDiagonal({xy, xy, 1e6, yaw, 1e6, 1e6});
    return prior;
}

/// On two threads that share the ICP object.
void align_all(const ICP& icp, const Parameters& parameters, const Maps& maps, Links& links)
{
    std::atomic<size_t> next{0};
    const auto work = [&]()
    {
        for (size_t i = next++; i < links.size(); i = next++)
        {
            auto& [from, to, prior, result] = links[i];
            icp.align(maps[to], maps[from], prior.mean.asTPose(), parameters, result, prior);
        }
    };
    std::thread other(work);
    work();
    other.join();
}

/// Each scan with the nearest of those taken 50 or more before it, if that is near, judged by the trajectory.
Links possible_loops(const Trajectory& path, double distance)
{
    Links links;
    for (size_t to = 50; to < path.size(); to++)
    {
        const auto nearer = [&](auto& a, auto& b) { return path[to].distanceTo(a) < path[to].distanceTo(b); };
        const auto at = std::min_element(path.data(), path.data() + to - 49, nearer);
        if (path[to].distanceTo(*at) < distance)
            links.push_back({size_t(at - path.data()), to, planar_prior(path[to] - *at, 1.0, 0.2), {}});
    }
    return links;
}

/// Adds a factor: what was known before plus what the scans say, which is nothing if the verdict is against
/// them. Three of ICP's standard deviations count as one: pairings of one wall err together.
void add_factor(mrpt::graphs::CNetworkOfPoses2DInf& graph, const Link& link)
{
    auto both = link.prior;
    both.mean = link.result.optimal_tf.mean;
    both.cov_inv.asEigen() += link.result.information.asEigen() * mrpt::square(0.1 / 3);
    graph.insertEdge(link.from, link.to, mrpt::poses::CPosePDFGaussianInf(both));
}

/// Writes a trajectory, and prints how far it has the ends of loops from where the scans have them.
void report(const Trajectory& path, const std::vector<double>& times, const Links& loops, std::string name)
{
    std::ofstream file(name);
    for (size_t i = 0; i < path.size(); i++)
        file << mrpt::format("%.6f %f %f 0 0 0 %.9f %.9f\n", times[i], path[i].x(), path[i].y(),
                             std::sin(path[i].yaw() / 2), std::cos(path[i].yaw() / 2));
    double sum = 0;
    for (const Link& c : loops) sum += (path[c.to] - path[c.from]).distanceTo(c.result.optimal_tf.mean);
    std::cout << name << ": mean closing error " << sum / double(loops.size()) << " m\n";
}

int main(int argc, char** argv)
{
    if (argc != 3) return std::cerr << "usage: slam-front-end FILE.rawlog OUTPUT_FOLDER\n", 1;
    const std::string folder = argv[2];
    const auto pipeline = pipeline_from_yaml(yaml_from_text(shipped_pipeline("icp-2d-laser")));
    std::atomic<size_t> iterations{0};
    pipeline.icp->setIterationHook([&](auto&) { return iterations++, ICP::IterationHook_Output(); });
    const auto [odometry, times, maps] = read_rawlog(argv[1], *pipeline.generators);
    Links links;
    for (size_t i = 1; i < odometry.size(); i++)
        links.push_back({i - 1, i, planar_prior(odometry[i] - odometry[i - 1], 0.1, 0.05), {}});
    align_all(*pipeline.icp, pipeline.parameters, maps, links);
    Trajectory chain = {odometry.at(0)}, optimised;
    for (const Link& step : links) chain.push_back(chain.back() + step.result.optimal_tf.mean);
    Links loops = possible_loops(chain, 3.0);
    align_all(*pipeline.icp, pipeline.parameters, maps, loops);
    loops.erase(std::remove_if(loops.begin(), loops.end(), [](auto& l) { return !l.result.trusted(); }),
                loops.end());
    mrpt::graphs::CNetworkOfPoses2DInf graph;
    for (const auto* list : {&links, &loops})
        for (const Link& link : *list) add_factor(graph, link);
    for (size_t i = 0; i < chain.size(); i++) graph.nodes[i] = CPose2D(chain[i]);
    mrpt::graphslam::TResultInfoSpaLevMarq info;
    mrpt::graphslam::optimize_graph_spa_levmarq(graph, info);
    for (const auto& [id, pose] : graph.nodes) optimised.push_back(CPose3D(pose));
    std::cout << chain.size() << " scans, " << loops.size() << " loops, " << iterations << " iterations\n";
    report(odometry, times, loops, folder + "/odometry.txt");
    report(chain, times, loops, folder + "/scan-to-scan.txt");
    report(optimised, times, loops, folder + "/graph.txt");
}
