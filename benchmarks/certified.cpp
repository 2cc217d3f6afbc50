// What optimal_tf_certified() proves, and how fast: over 15 mixes of pairings, sizes from minimal to 1000,
// and noises from none to 30 % of the scene, against brute force (descents from many random rotations) and
// against other solvers.
#include <mp2p_icp/Solver_Certified.h>
#include <mp2p_icp/icp_pipeline_from_yaml.h>
#include <mp2p_icp/load_map.h>
#include <mp2p_icp/optimal_tf_certified.h>
#include <mp2p_icp/optimal_tf_gauss_newton.h>
#include <mp2p_icp/synthetic/load_obj_mesh.h>
#include <mp2p_icp/synthetic/sample_by_area.h>
#include <mrpt/poses/CPose3DQuat.h>
#include <mrpt/tfest/se3.h>

#include <Eigen/Dense>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "exact_mixes.h"
#include "rotation_certificate.h"
#include "rotation_search.h"
#include "with_threads.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
const char* const HELP =
    R"(What optimal_tf_certified() proves, and how fast.

Usage: bench-certified [--instances COUNT] [--starts COUNT] [--seed NUMBER] [--csv FILE]
                       [--bunny FILE] [--pair LOCAL GLOBAL] [--help]

  --instances COUNT  sets of pairings per mix, size and noise: 15 x 5 x 5 of each. Default 20
  --starts COUNT     random rotations per set from which brute force descends. Default 200
  --seed NUMBER      default 1
  --csv FILE         also write the table there
  --bunny FILE       an OBJ model to align with itself, for the share of an alignment's time.
                     Default /usr/share/glmark2/models/bunny.obj, if it is there
  --pair LOCAL GLOBAL  two clouds to align, for the same
  --help             this text

Examples:
  bench-certified --instances 40              15 000 sets against 200 descents each, a minute
  bench-certified --instances 1 --starts 100000   375 sets against 1e5 descents each, some minutes
)";

struct Options
{
    size_t instances = 20, starts = 200, seed = 1;
    std::string csv, bunny, local, global;
};

/// Empty if only the help was asked for.
std::optional<Options> parse(const std::vector<std::string>& arguments)
{
    Options options;
    const std::map<std::string, size_t*> numbers = {
        {"--instances", &options.instances}, {"--starts", &options.starts}, {"--seed", &options.seed}};
    for (size_t i = 0; i < arguments.size(); i++)
    {
        const std::string& name = arguments[i];
        if (name == "--help" || name == "-h") return {};
        if (name == "--pair" && i + 2 < arguments.size())
        {
            options.local = arguments[++i], options.global = arguments[++i];
            continue;
        }
        if (name != "--csv" && name != "--bunny" && !numbers.count(name))
            throw std::invalid_argument("unknown option '" + name + "'");
        if (i + 1 == arguments.size()) throw std::invalid_argument(name + " needs a value");
        const std::string& value = arguments[++i];
        if (name == "--csv" || name == "--bunny")
            (name == "--csv" ? options.csv : options.bunny) = value;
        else if (value.empty() || value.find_first_not_of("0123456789") != std::string::npos ||
                 value.size() > 9)
            throw std::invalid_argument(name + ": '" + value + "' is not a number");
        else
            *numbers.at(name) = std::stoul(value);
    }
    return options;
}

template <class T>
void use(const T& value)
{
    asm volatile("" : : "r"(&value) : "memory");
}

double median(std::vector<double> v)
{
    if (v.empty()) return 0;
    std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
    return v[v.size() / 2];
}

/// Of one call, us; the shorter of two, so that an interruption does not count.
template <class Call>
double microseconds(const Call& call)
{
    double best = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 2; k++)
    {
        const auto start = std::chrono::steady_clock::now();
        call();
        const std::chrono::duration<double, std::micro> took = std::chrono::steady_clock::now() - start;
        best = std::min(best, took.count());
    }
    return best;
}

// ---- Sets -------------------------------------------------------------------------------------------------

enum class Size
{
    Minimal,
    OneMore,
    Ten,
    Hundred,
    Thousand
};
const char* const SIZE_NAMES[] = {"minimal", "one more", "10", "100", "1000"};
constexpr Size SIZES[] = {Size::Minimal, Size::OneMore, Size::Ten, Size::Hundred, Size::Thousand};
constexpr double NOISES[] = {0, 0.01, 0.03, 0.1, 0.3};  // of the half size of the scene; rad for directions
constexpr double HALF_SIZE = 5;

Mix mix_of(const ExactMix& mix, Size size, SeededRandom& random)
{
    const auto any = [&random](const std::vector<Mix>& of) { return of[random.index(of.size())]; };
    const Mix h = mix.hundred;
    switch (size)
    {
        case Size::Minimal:
            return any(mix.minimal);
        case Size::OneMore:
            return any(mix.one_more);
        case Size::Ten:
            return mix.ten;
        case Size::Hundred:
            return h;
        default:
            return {10 * h.pt2pt, 10 * h.pt2ln, 10 * h.pt2pl, 10 * h.ln2ln, 10 * h.pl2pl};
    }
}

void set_weights(Pairings& p, SeededRandom& random)
{
    const auto weights = [&random](size_t count)
    {
        WeightRuns runs;
        for (size_t i = 0; i < count; i++) runs.emplace_back(1, random.uniform(0.1, 3));
        return runs;
    };
    p.point_weights = weights(p.paired_pt2pt.size()), p.pt2ln_weights = weights(p.paired_pt2ln.size());
    p.pt2pl_weights = weights(p.paired_pt2pl.size()), p.ln2ln_weights = weights(p.paired_ln2ln.size());
    p.pl2pl_weights = weights(p.paired_pl2pl.size());
}

// ---- One cell of the table --------------------------------------------------------------------------------

struct Cell
{
    size_t sets = 0, proven = 0, wrong = 0;
    size_t rivals = 0, rivals_accepted = 0;  ///< local minima that are not the lowest
    std::map<GlobalVerdict, size_t> verdicts;
    double excess = 0;  ///< of the cost over what brute force found, at most, relative to the scale
    std::vector<double> us, umeyama_us;
};

/// The lowest that descents from random rotations come to, at least the cost of the result.
double by_brute_force(const RotationQuadratic& f, size_t starts, double lowest, SeededRandom& random)
{
    for (size_t i = 0; i < starts; i++)
        lowest = std::min(lowest, minimise_rotation(f, any_rotation(random)).cost);
    return lowest;
}

void check_rivals(const RotationQuadratic& f, const CertifiedResult& result, Cell& cell)
{
    for (const auto& m : result.minima)
    {
        if (m.cost - result.cost < 1e-8 * result.scale) continue;
        cell.rivals++;
        cell.rivals_accepted += certify_rotation(f.matrix(), rotation_of(m.pose)).holds;
    }
}

void time_umeyama(Cell& cell, SeededRandom& random)
{
    Eigen::Matrix3Xd a(3, 3), b(3, 3);
    for (int i = 0; i < 3; i++) a.col(i) = random_point(random, 5), b.col(i) = random_point(random, 5);
    // 20 at a time: one is too short for the clock.
    cell.umeyama_us.push_back(microseconds(
                                  [&]()
                                  {
                                      for (int k = 0; k < 20; k++) use(Eigen::umeyama(b, a, false));
                                  }) /
                              20);
}

void add_set(const ExactMix& mix, Size size, double noise, const Options& options, SeededRandom& random,
             Cell& cell)
{
    Pairings pairings = random_pairings(mix_of(mix, size, random), any_rotation(random),
                                        random_point(random, 20), random, noise * HALF_SIZE, HALF_SIZE);
    set_weights(pairings, random);
    CertifiedParameters p;
    p.weights.pair_weights.pl2pl_sign = mix.normals;
    const PoseQuadratic sums = pose_quadratic(pairings, p.weights.pair_weights);
    CertifiedResult result;
    cell.us.push_back(microseconds([&]() { use(optimal_tf_certified(sums, result, p)); }));
    time_umeyama(cell, random);
    cell.sets++, cell.verdicts[result.verdict]++;
    const bool proven = result.gap <= p.tolerance * result.scale;
    cell.proven += proven;
    const RotationQuadratic f(sums);
    const double lowest = by_brute_force(f, options.starts, result.cost, random),
                 excess = (result.cost - lowest) / result.scale;
    cell.excess = std::max(cell.excess, excess);
    // Rounding of the sums and of the cost.
    cell.wrong += proven && result.cost - lowest > p.tolerance * result.scale + 4e-15 * f.matrix().norm();
    p.all_minima = true;
    optimal_tf_certified(sums, result, p);
    check_rivals(f, result, cell);
}

void print_cell(const std::string& name, const Cell& c)
{
    const auto count = [&c](GlobalVerdict v) { return c.verdicts.count(v) ? c.verdicts.at(v) : size_t(0); };
    std::printf("%-24s %7zu %7zu %6zu %8.1e | %7zu %7zu %5zu %5zu | %8zu %5zu | %8.1f %7.1f\n", name.c_str(),
                c.sets, c.proven, c.wrong, c.excess, count(GlobalVerdict::Global),
                count(GlobalVerdict::GlobalAmbiguous), count(GlobalVerdict::Unobservable),
                count(GlobalVerdict::Gap), c.rivals, c.rivals_accepted, median(c.us),
                median(c.us) / median(c.umeyama_us));
    std::fflush(stdout);
}

void add(const Cell& c, Cell& to)
{
    to.sets += c.sets, to.proven += c.proven, to.wrong += c.wrong, to.rivals += c.rivals,
        to.rivals_accepted += c.rivals_accepted, to.excess = std::max(to.excess, c.excess);
    for (const auto& [verdict, count] : c.verdicts) to.verdicts[verdict] += count;
    to.us.insert(to.us.end(), c.us.begin(), c.us.end());
    to.umeyama_us.insert(to.umeyama_us.end(), c.umeyama_us.begin(), c.umeyama_us.end());
}

void print_proofs(const Options& options)
{
    std::printf(
        "Proofs. wrong: proven, though brute force (%zu descents a set) found less. rivals: other local "
        "minima, of\n"
        "which none may be accepted. Time after accumulation, in us and as a multiple of umeyama's at N = "
        "3.\n\n",
        options.starts);
    std::printf("%-24s %7s %7s %6s %8s | %7s %7s %5s %5s | %8s %5s | %8s %7s\n", "mix, size", "sets",
                "proven", "wrong", "excess", "global", "ambig.", "free", "gap", "rivals", "acc.", "us", "x");
    std::ofstream csv;
    if (!options.csv.empty())
        csv.open(options.csv), csv << "mix,size,noise,sets,proven,wrong,rivals,accepted,us,umeyama_us\n";
    SeededRandom random(options.seed);
    Cell all, minimal, ten_and_more;
    for (const auto& mix : exact_mixes())
        for (const Size size : SIZES)
        {
            Cell line;
            for (const double noise : NOISES)
            {
                Cell cell;
                for (size_t i = 0; i < options.instances; i++)
                    add_set(mix, size, noise, options, random, cell);
                add(cell, line);
                if (csv)
                    csv << mix.name << "," << SIZE_NAMES[static_cast<int>(size)] << "," << noise << ","
                        << cell.sets << "," << cell.proven << "," << cell.wrong << "," << cell.rivals << ","
                        << cell.rivals_accepted << "," << median(cell.us) << "," << median(cell.umeyama_us)
                        << "\n";
            }
            print_cell(std::string(mix.name) + ", " + SIZE_NAMES[static_cast<int>(size)], line);
            add(line, all);
            if (size >= Size::Ten) add(line, ten_and_more);
            if (size == Size::Minimal && std::string(mix.name) != "ll") add(line, minimal);
        }
    std::printf("\n");
    print_cell("all", all);
    print_cell("10 pairings and more", ten_and_more);
    print_cell("minimal, but 2 lines", minimal);
}

// ---- Other solvers ----------------------------------------------------------------------------------------

/// On points: the whole call, accumulation included.
void print_points()
{
    std::printf("\nPoints, whole calls, us (medians of 201 sets, taking turns):\n\n%8s %10s %10s %10s\n", "N",
                "certified", "umeyama", "se3_l2");
    for (const size_t n : {3, 10, 100, 1000, 10000})
    {
        SeededRandom random(n);
        std::vector<double> certified, umeyama, mrpt;
        for (int k = 0; k < 201; k++)
        {
            const Pairings p = random_pairings({n, 0, 0, 0, 0}, any_rotation(random),
                                               random_point(random, 20), random, 0.01);
            Eigen::Matrix3Xd a(3, n), b(3, n);
            std::vector<mrpt::math::TPoint3D> global, local;
            for (size_t i = 0; i < n; i++)
            {
                a.col(static_cast<Eigen::Index>(i)) = global_of(p, i),
                b.col(static_cast<Eigen::Index>(i)) = local_of(p, i);
                global.push_back(to_mrpt(global_of(p, i))), local.push_back(to_mrpt(local_of(p, i)));
            }
            CertifiedResult result;
            certified.push_back(microseconds([&]() { use(optimal_tf_certified(p, result)); }));
            umeyama.push_back(microseconds([&]() { use(Eigen::umeyama(b, a, false)); }));
            mrpt.push_back(microseconds(
                [&]()
                {
                    mrpt::poses::CPose3DQuat pose;
                    double scale = 1;
                    mrpt::tfest::se3_l2(global, local, pose, scale, true);
                    use(pose);
                }));
        }
        std::printf("%8zu %10.2f %10.2f %10.2f\n", n, median(certified), median(umeyama), median(mrpt));
    }
}

/// What one would do without the certified solver: Gauss-Newton from many starts, the best of which is taken.
void print_multistart()
{
    constexpr int STARTS = 100;
    std::printf(
        "\nMixed sets, whole calls, us (medians of 15 sets): certified, against the best of %d Gauss-Newton "
        "runs:\n\n"
        "%-10s %8s %10s %12s %8s %s\n",
        STARTS, "mix", "N", "certified", "multistart", "ratio", "multistart missed the optimum");
    for (const auto& mix : exact_mixes())
        for (const Size size : {Size::Ten, Size::Hundred})
        {
            SeededRandom random(7);
            std::vector<double> certified, multistart;
            size_t missed = 0, count = 0;
            for (int k = 0; k < 15; k++)
            {
                const Pairings p =
                    random_pairings(mix_of(mix, size, random), any_rotation(random), random_point(random, 20),
                                    random, 0.03 * HALF_SIZE, HALF_SIZE);
                count = p.size();
                CertifiedParameters cp;
                cp.weights.pair_weights.pl2pl_sign = mix.normals;
                CertifiedResult result;
                certified.push_back(microseconds([&]() { use(optimal_tf_certified(p, result, cp)); }));
                OptimalTF_GN_Parameters gn;
                gn.pairWeights = cp.weights.pair_weights, gn.maxInnerLoopIterations = 30;
                std::vector<mrpt::poses::CPose3D> starts;
                for (int i = 0; i < STARTS; i++) starts.push_back(any_pose(random));
                double best = 0;
                multistart.push_back(microseconds(
                    [&]()
                    {
                        best = std::numeric_limits<double>::infinity();
                        for (const auto& start : starts)
                        {
                            gn.linearizationPoint = start;
                            OptimalTF_Result r;
                            GaussNewtonReport report;
                            optimal_tf_gauss_newton(p, r, gn, &report);
                            best = std::min(best, report.cost);
                        }
                    }));
                missed += best > result.cost + 1e-6 * result.scale;
            }
            std::printf("%-10s %8zu %10.1f %12.0f %8.0f %zu of 15\n", mix.name, count, median(certified),
                        median(multistart), median(multistart) / median(certified), missed);
            std::fflush(stdout);
        }
}

// ---- In ICP -----------------------------------------------------------------------------------------------

/// Solver_Certified, with a clock.
class TimedSolver : public Solver_Certified
{
 public:
    mutable double seconds = 0;

 protected:
    bool impl_optimal_pose(const Pairings& pairings, OptimalTF_Result& out,
                           const SolverContext& context) const override
    {
        const auto start = std::chrono::steady_clock::now();
        const bool solved = Solver_Certified::impl_optimal_pose(pairings, out, context);
        seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        return solved;
    }
};

void print_share(const std::string& name, metric_map_t local, metric_map_t global)
{
    Pipeline pipeline = pipeline_from_yaml(
        yaml_from_text(shipped_pipeline(default_pipeline_for(local, global))), {}, mrpt::system::LVL_WARN);
    ParameterSource source;
    source.updateVariables(extent_variables(local, global));
    pipeline.attachToParameterSource(source);
    if (pipeline.filters.count("filters"))
        for (auto* map : {&local, &global})
            mp2p_icp_filters::apply_filter_pipeline(pipeline.filters["filters"], *map);
    std::vector<double> shares, totals;
    Results r;
    for (int k = 0; k < 11; k++)
    {
        const auto solver = std::make_shared<TimedSolver>();
        pipeline.icp->solvers() = {solver};
        const auto start = std::chrono::steady_clock::now();
        pipeline.icp->align(local, global, {}, pipeline.parameters, r);
        totals.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
        shares.push_back(solver->seconds / totals.back());
    }
    std::printf("%-8s %10zu %12.1f %10.2f %%   %s\n", name.c_str(), r.nIterations, 1e3 * median(totals),
                100 * median(shares), to_string(r.verdict).c_str());
}

metric_map_t map_of(const mrpt::maps::CPointsMap::Ptr& points)
{
    metric_map_t map;
    map.layers[metric_map_t::PT_LAYER_RAW] = points;
    return map;
}

void print_icp(const Options& options)
{
    std::printf("\nSolver_Certified in every iteration of ICP, default pipelines:\n\n%-8s %10s %12s %12s\n",
                "", "iterations", "align, ms", "its share");
    const std::string bunny = options.bunny.empty() ? "/usr/share/glmark2/models/bunny.obj" : options.bunny;
    if (std::ifstream(bunny))
    {
        const auto mesh = synthetic::load_obj_mesh(bunny);
        const auto local = synthetic::sample_by_area(mesh, 3000, 1);
        local->changeCoordinatesReference(mrpt::poses::CPose3D(0.1, -0.15, 0.05, 0.2, -0.1, 0.15));
        print_share("bunny", map_of(local), map_of(synthetic::sample_by_area(mesh, 3000, 2)));
    }
    if (!options.local.empty())
        print_share("pair", *load_map(options.local).map, *load_map(options.global).map);
}

void run(const Options& options)
{
    with_threads(1,
                 [&]()
                 {
                     print_proofs(options);
                     print_points();
                     print_multistart();
                     print_icp(options);
                     return 0;
                 });
}
}  // namespace

int main(int argc, char** argv)
{
    try
    {
        const auto options = parse({argv + 1, argv + argc});
        if (!options)
            std::cout << HELP;
        else
            run(*options);
        return 0;
    }
    catch (const std::exception& e)
    {
        std::cerr << "bench-certified: " << e.what() << "\nSee bench-certified --help\n";
        return 1;
    }
}
