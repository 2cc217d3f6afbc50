// Times of the closed-form solvers on one thread, beside those of Eigen and MRPT on the same pairs.
//
// All contenders of one table take turns in one run, many rounds long, so that what else the machine does
// falls on all of them alike: trust the ratios more than the nanoseconds. Accumulation and solving apart have
// no public function: for them this program uses private headers of the solvers.
#include <mp2p_icp/optimal_tf_gauss_newton.h>
#include <mp2p_icp/optimal_tf_horn.h>
#include <mp2p_icp/optimal_tf_olae.h>
#include <mp2p_icp/random.h>
#include <mp2p_icp/se3.h>
#include <mrpt/poses/CPose3DQuat.h>
#include <mrpt/tfest/se3.h>

#include <Eigen/Dense>
#include <Eigen/StdVector>
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <functional>
#include <iostream>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "attitude.h"
#include "pairing_sums.h"
#include "with_threads.h"

using namespace mp2p_icp;
using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace
{
const char* const HELP =
    R"(Times the closed-form solvers on one thread: optimal_tf_horn, optimal_tf_olae, and accumulation and
solving apart, beside Eigen::umeyama<double> and mrpt::tfest::se3_l2 (double) on the same pairs.

Usage: bench-solvers [--rounds COUNT] [--csv FILE] [--help]

  --rounds COUNT  how often every contender runs, in turns; medians are over these. At least 31 (the default)
  --csv FILE      also write all times there, as lines `table,size,contender,ns`
  --help          this text

Example: bench-solvers --rounds 101 --csv solvers.csv
)";

struct Options
{
    size_t rounds = 31;
    std::string csv;
};

/// Empty if only the help was asked for.
std::optional<Options> parse(const std::vector<std::string>& arguments)
{
    Options options;
    for (size_t i = 0; i < arguments.size(); i++)
    {
        const std::string& name = arguments[i];
        if (name == "--help" || name == "-h") return {};
        if (name != "--rounds" && name != "--csv")
            throw std::invalid_argument("unknown option '" + name + "'");
        if (i + 1 == arguments.size()) throw std::invalid_argument(name + " needs a value");
        const std::string& value = arguments[++i];
        if (name == "--csv")
        {
            options.csv = value;
            continue;
        }
        if (value.empty() || value.find_first_not_of("0123456789") != std::string::npos || value.size() > 6)
            throw std::invalid_argument("--rounds: '" + value + "' is not a number of rounds");
        options.rounds = std::stoul(value);
        if (options.rounds < 31) throw std::invalid_argument("--rounds must be at least 31");
    }
    return options;
}

// ---- Taking turns -----------------------------------------------------------------------------------------

/// Keeps the compiler from leaving out the making of `value`.
template <class T>
void use(const T& value)
{
    asm volatile("" : : "r"(&value) : "memory");
}

struct Contender
{
    std::string name;
    std::function<void()> all_sets;  ///< one call per set of pairings
    std::vector<double> ns;          ///< per call, one entry per round
};

template <class Call>
Contender contender(const std::string& name, size_t sets, const Call& call)
{
    return {name,
            [sets, call]()
            {
                for (size_t s = 0; s < sets; s++) call(s);
            },
            {}};
}

double seconds_of(const Contender& c, size_t repeats)
{
    const auto start = std::chrono::steady_clock::now();
    for (size_t k = 0; k < repeats; k++) c.all_sets();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Every round runs every contender once, for some 2 ms, in a random order. A pass before the clock starts
/// puts a contender's data where they fit in the caches, whoever came before it.
void race(std::vector<Contender>& contenders, size_t sets, size_t rounds)
{
    std::vector<size_t> repeats, order;
    for (size_t i = 0; i < contenders.size(); i++)
    {
        order.push_back(i);
        seconds_of(contenders[i], 1);
        repeats.push_back(1 + static_cast<size_t>(2e-3 / std::max(1e-7, seconds_of(contenders[i], 1))));
    }
    SeededRandom random(1);
    for (size_t r = 0; r < rounds; r++)
    {
        for (size_t k = order.size(); k > 1; k--) std::swap(order[k - 1], order[random.index(k)]);
        for (const size_t i : order)
        {
            seconds_of(contenders[i], 1);
            const double seconds = seconds_of(contenders[i], repeats[i]);
            contenders[i].ns.push_back(1e9 * seconds / static_cast<double>(repeats[i] * sets));
        }
    }
}

double median(std::vector<double> v)
{
    std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
    return v[v.size() / 2];
}

double time_of(const std::vector<Contender>& contenders, const std::string& name)
{
    for (const auto& c : contenders)
        if (c.name == name) return median(c.ns);
    throw std::logic_error("no contender is called " + name);
}

// ---- Points -----------------------------------------------------------------------------------------------

Vector3d in_cube(SeededRandom& random, double half_side)
{
    const double x = random.uniform(-half_side, half_side), y = random.uniform(-half_side, half_side);
    return {x, y, random.uniform(-half_side, half_side)};
}
Vector3d gaussian(SeededRandom& random, double sigma)
{
    const double x = random.gaussian(sigma), y = random.gaussian(sigma);
    return {x, y, random.gaussian(sigma)};
}
Matrix3d any_rotation(SeededRandom& random)
{
    const Vector3d v = gaussian(random, 1);
    return Eigen::Quaterniond(random.gaussian(), v.x(), v.y(), v.z()).normalized().toRotationMatrix();
}

/// The same pairs as everyone wants them.
struct PointSet
{
    Pairings pairings;
    Eigen::Matrix3Xd global, local;
    std::vector<mrpt::math::TPoint3D> global_list, local_list;
    PointSums sums;
    Vector3d a_mean, b_mean;  ///< of the sums
};

PointSums point_sums_of(const Pairings& pairings, PointSet& out)
{
    const PairWeights kinds;
    PreparedPairings in(pairings, kinds);
    const PairingSums sums = pairing_sums(in);
    out.a_mean = sums.a_origin + sums.a_mean, out.b_mean = sums.b_origin + sums.b_mean;
    return sums.points;
}

/// In a cube of 20 m, with noise of 1 cm, moved by any pose.
PointSet point_set(size_t count, SeededRandom& random)
{
    const Matrix3d R = any_rotation(random);
    const Vector3d t = in_cube(random, 50);
    PointSet set;
    const auto n = static_cast<Eigen::Index>(count);
    set.global.resize(3, n), set.local.resize(3, n);
    for (Eigen::Index i = 0; i < n; i++)
    {
        const Vector3d b = in_cube(random, 10), a = R * b + t + gaussian(random, 0.01);
        set.global.col(i) = a, set.local.col(i) = b;
        set.global_list.push_back(to_mrpt(a)), set.local_list.push_back(to_mrpt(b));
        set.pairings.paired_pt2pt.push_back(mrpt::tfest::TMatchingPair_d(
            static_cast<uint32_t>(i), static_cast<uint32_t>(i), to_mrpt(a), to_mrpt(b)));
    }
    set.sums = point_sums_of(set.pairings, set);
    return set;
}

/// Different ones, so many that branch predictors do not learn them, and so few that they stay in the cache.
size_t sets_for(size_t count)
{
    return count <= 10 ? 256 : count <= 100 ? 64 : count <= 1000 ? 16 : count <= 10000 ? 4 : 2;
}

OlaeParameters report_olae()
{
    return {};
}
OlaeParameters length_olae()
{
    OlaeParameters p;
    p.normalize_points = false;
    return p;
}

/// What follows the accumulation: the rotation, and the translation between the means.
std::pair<Matrix3d, Vector3d> solve(const PointSet& set, AttitudeMethod method)
{
    const Matrix3d R = fast_attitude(set.sums, method).q.toRotationMatrix();
    return {R, set.a_mean - R * set.b_mean};
}

Eigen::Matrix4d by_umeyama(const PointSet& set)
{
    return Eigen::umeyama(set.local, set.global, false);
}
mrpt::poses::CPose3DQuat by_mrpt(const PointSet& set)
{
    mrpt::poses::CPose3DQuat pose;  // fresh, as its contents would be a start
    double scale = 1;
    mrpt::tfest::se3_l2(set.global_list, set.local_list, pose, scale, true);
    return pose;
}
OptimalTF_Result by_horn(const PointSet& set)
{
    static const WeightParameters wp;
    OptimalTF_Result result;
    optimal_tf_horn(set.pairings, wp, result);
    return result;
}
OptimalTF_Result by_olae(const PointSet& set, const OlaeParameters& parameters)
{
    static const WeightParameters wp;
    OptimalTF_Result result;
    optimal_tf_olae(set.pairings, wp, result, std::nullopt, parameters);
    return result;
}

/// Nobody is timed for a wrong answer: the four of least squares must agree, OLAE must be near.
void check_answers(const PointSet& set, size_t count)
{
    const Matrix3d R = by_umeyama(set).topLeftCorner<3, 3>();
    const auto check = [&](const Matrix3d& other, double limit, const char* name)
    {
        const double angle = rotation_angle(R.transpose() * other);
        if (!(angle < limit))
            throw std::logic_error(std::string(name) + " and umeyama differ by " + std::to_string(angle) +
                                   " rad at N = " + std::to_string(count));
    };
    // Three points may lie almost on a line: rounding and noise count more then.
    const double exact = count > 3 ? 1e-9 : 1e-6, near = count > 3 ? 0.05 : 3.2;
    check(rotation_of(by_horn(set).optimalPose), exact, "optimal_tf_horn");
    check(rotation_of(mrpt::poses::CPose3D(by_mrpt(set))), exact, "se3_l2");
    check(solve(set, AttitudeMethod::Horn).first, exact, "Horn after sums");
    check(rotation_of(by_olae(set, report_olae()).optimalPose), near, "optimal_tf_olae");
    check(rotation_of(by_olae(set, length_olae()).optimalPose), near, "length-weighted optimal_tf_olae");
}

std::vector<Contender> time_points(size_t count, size_t rounds)
{
    SeededRandom random(count);
    std::vector<PointSet> sets(sets_for(count));
    for (auto& set : sets) set = point_set(count, random), check_answers(set, count);
    const size_t n = sets.size();
    const PairWeights kinds;
    std::vector<Contender> c;
    c.push_back(contender("horn", n, [&](size_t s) { use(by_horn(sets[s])); }));
    c.push_back(contender("olae", n, [&](size_t s) { use(by_olae(sets[s], report_olae())); }));
    c.push_back(contender("olae-length", n, [&](size_t s) { use(by_olae(sets[s], length_olae())); }));
    c.push_back(contender("umeyama", n, [&](size_t s) { use(by_umeyama(sets[s])); }));
    c.push_back(contender("se3_l2", n, [&](size_t s) { use(by_mrpt(sets[s])); }));
    c.push_back(contender("sums", n,
                          [&](size_t s)
                          {
                              PreparedPairings in(sets[s].pairings, kinds);
                              use(pairing_sums(in));
                          }));
    c.push_back(contender("horn-solve", n, [&](size_t s) { use(solve(sets[s], AttitudeMethod::Horn)); }));
    c.push_back(
        contender("olae-solve", n, [&](size_t s) { use(solve(sets[s], AttitudeMethod::OlaeReport)); }));
    race(c, n, rounds);
    return c;
}

/// One line of the table of points.
struct PointTimes
{
    size_t count = 0;
    std::vector<Contender> contenders;

    double of(const std::string& name) const { return time_of(contenders, name); }
    double ratio(const std::string& a, const std::string& b) const { return of(a) / of(b); }
    /// How many times the better of the others takes.
    double best_other() const { return std::min(of("umeyama"), of("se3_l2")); }
    double gain() const { return best_other() / of("horn"); }
    double gain_of_kernels() const { return best_other() / (of("sums") + of("horn-solve")); }
};

const std::array<const char*, 8> POINT_CONTENDERS = {"horn",   "olae", "olae-length", "umeyama",
                                                     "se3_l2", "sums", "horn-solve",  "olae-solve"};

void print_head()
{
    std::printf("Points, ns per call: whole calls, then accumulation and solving apart; and ratios.\n\n");
    std::printf("%7s", "N");
    for (const char* name : POINT_CONTENDERS) std::printf(" %11s", name);
    std::printf(" | %9s %9s %9s %9s %9s\n", "best/horn", "olae/horn", "len/horn", "h-sol/ume", "o-sol/ume");
}

void print_line(const PointTimes& t)
{
    std::printf("%7zu", t.count);
    for (const char* name : POINT_CONTENDERS) std::printf(" %11.0f", t.of(name));
    std::printf(" | %9.2f %9.2f %9.3f %9.3f %9.3f\n", t.gain(), t.ratio("olae", "horn"),
                t.ratio("olae-length", "horn"), t.ratio("horn-solve", "umeyama"),
                t.ratio("olae-solve", "umeyama"));
    std::fflush(stdout);
}

// ---- The limits -------------------------------------------------------------------------------------------

void print_limit(const std::string& what, size_t count, double measured, bool at_most, double limit)
{
    const bool met = at_most ? measured <= limit : measured >= limit;
    std::printf("  %-52s N = %-7zu %7.3f  (%s %.2f)  %s\n", what.c_str(), count, measured,
                at_most ? "at most" : "at least", limit, met ? "yes" : "NO");
}

void print_limits(const std::vector<PointTimes>& lines)
{
    std::printf("\nLimits:\n");
    for (const auto& t : lines)
        if (t.count >= 10 && t.count <= 10000)
            print_limit("accumulation + horn: faster than umeyama and se3_l2", t.count, t.gain_of_kernels(),
                        false, 2.5);
    for (const auto& t : lines)
        if (t.count >= 10 && t.count <= 10000)
            print_limit("whole call of horn: faster than both", t.count, t.gain(), false, 2.5);
    print_limit("solving after accumulation / umeyama: horn", lines[0].count,
                lines[0].ratio("horn-solve", "umeyama"), true, 0.2);
    print_limit("solving after accumulation / umeyama: olae", lines[0].count,
                lines[0].ratio("olae-solve", "umeyama"), true, 0.15);
    // The same code but for the solving: 5 % are the noise of such a measurement.
    for (const auto& t : lines)
        print_limit("length-weighted olae / horn", t.count, t.ratio("olae-length", "horn"), true, 1.05);
    for (const auto& t : lines)
        print_limit("the report's olae / horn", t.count, t.ratio("olae", "horn"), true, 2.5);
}

// ---- The other kinds --------------------------------------------------------------------------------------

constexpr size_t KIND_COUNT = 1000, KIND_SETS = 8;
const std::array<const char*, 5> KINDS = {"point-point", "point-line", "point-plane", "line-line",
                                          "plane-plane"};

mrpt::math::TLine3D line(const Vector3d& base, const Vector3d& direction)
{
    mrpt::math::TLine3D l;
    l.pBase = to_mrpt(base), l.director = to_mrpt(direction);
    return l;
}
plane_patch_t patch(const Vector3d& centroid, const Vector3d& normal)
{
    plane_patch_t p;
    for (int i = 0; i < 3; i++) p.plane.coefs[i] = normal(i);
    p.plane.coefs[3] = -normal.dot(centroid), p.centroid = to_mrpt(centroid);
    return p;
}

void add_pairing(size_t kind, const Matrix3d& R, const Vector3d& t, SeededRandom& random, Pairings& out)
{
    const Vector3d b = in_cube(random, 10), a = R * b + t + gaussian(random, 0.01),
                   local = gaussian(random, 1).normalized(),
                   global = (R * local + gaussian(random, 0.001)).normalized();
    if (kind == 0) out.paired_pt2pt.push_back(mrpt::tfest::TMatchingPair_d(0, 0, to_mrpt(a), to_mrpt(b)));
    if (kind == 1) out.paired_pt2ln.push_back({line(a, global), to_mrpt(b)});
    if (kind == 2) out.paired_pt2pl.push_back({patch(a, global), to_mrpt(b)});
    if (kind == 3) out.paired_ln2ln.push_back({line(a, global), line(b, local)});
    if (kind == 4) out.paired_pl2pl.push_back({patch(a, global), patch(b, local)});
}

struct KindSet
{
    Pairings pairings;
    mrpt::poses::CPose3D start;  ///< near the pose, so that all steps go down
};

KindSet kind_set(size_t kind, SeededRandom& random)
{
    KindSet set;
    const Matrix3d R = any_rotation(random);
    const Vector3d t = in_cube(random, 50);
    for (size_t i = 0; i < KIND_COUNT; i++) add_pairing(kind, R, t, random, set.pairings);
    const Matrix3d turn = Eigen::AngleAxisd(0.1, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
    set.start = make_pose(R * turn, t + Vector3d(0.3, -0.2, 0.1));
    return set;
}

GaussNewtonReport gauss_newton_steps(const KindSet& set, uint32_t steps)
{
    OptimalTF_GN_Parameters p;
    p.linearizationPoint = set.start, p.maxInnerLoopIterations = steps, p.minDelta = 0;
    OptimalTF_Result result;
    GaussNewtonReport report;
    optimal_tf_gauss_newton(set.pairings, result, p, &report);
    use(result);
    return report;
}

/// Per call: the accumulation, and Gauss-Newton with one step and with three.
std::vector<Contender> time_kind(size_t kind, size_t rounds)
{
    SeededRandom random(kind + 1);
    std::vector<KindSet> sets(KIND_SETS);
    for (auto& set : sets) set = kind_set(kind, random);
    for (const auto& set : sets)
        if (gauss_newton_steps(set, 3).iterations != 3)
            throw std::logic_error(std::string("Gauss-Newton ended early on ") + KINDS[kind]);
    const PairWeights kinds;
    std::vector<Contender> c;
    c.push_back(contender("sums", KIND_SETS,
                          [&](size_t s)
                          {
                              PreparedPairings in(sets[s].pairings, kinds);
                              use(pairing_sums(in));
                          }));
    c.push_back(contender("1 step", KIND_SETS, [&](size_t s) { gauss_newton_steps(sets[s], 1); }));
    c.push_back(contender("3 steps", KIND_SETS, [&](size_t s) { gauss_newton_steps(sets[s], 3); }));
    race(c, KIND_SETS, rounds);
    return c;
}

void time_kinds(size_t rounds, const std::function<void(const std::string&, const Contender&)>& save)
{
    const double n = static_cast<double>(KIND_COUNT);
    std::printf("\nOther kinds, %zu pairings, ns per pairing:\n\n%12s %13s %24s\n", KIND_COUNT, "kind",
                "accumulation", "one Gauss-Newton step");
    for (size_t kind = 0; kind < KINDS.size(); kind++)
    {
        const auto times = time_kind(kind, rounds);
        std::printf("%12s %13.1f %24.1f\n", KINDS[kind], time_of(times, "sums") / n,
                    0.5 * (time_of(times, "3 steps") - time_of(times, "1 step")) / n);
        std::fflush(stdout);
        for (const auto& c : times) save(KINDS[kind], c);
    }
}

void run(const Options& options)
{
    std::ofstream csv;
    if (!options.csv.empty())
    {
        csv.open(options.csv);
        if (!csv) throw std::runtime_error("cannot write '" + options.csv + "'");
        csv << "table,size,contender,ns\n";
    }
    const auto save = [&csv](const std::string& table, size_t size, const Contender& c)
    {
        if (csv.is_open()) csv << table << "," << size << "," << c.name << "," << median(c.ns) << "\n";
    };
    std::printf("One thread; medians over %zu rounds in which all contenders take turns.\n", options.rounds);
    print_head();
    std::vector<PointTimes> lines;
    for (const size_t count : {3, 10, 100, 1000, 10000, 100000})
    {
        lines.push_back({count, time_points(count, options.rounds)});
        print_line(lines.back());
        for (const auto& c : lines.back().contenders) save("points", count, c);
    }
    print_limits(lines);
    time_kinds(options.rounds,
               [&](const std::string& kind, const Contender& c) { save(kind, KIND_COUNT, c); });
    if (csv.is_open() && !csv.flush()) throw std::runtime_error("cannot write '" + options.csv + "'");
}
}  // namespace

int main(int argc, char** argv)
{
    try
    {
        const auto options = parse(std::vector<std::string>(argv + 1, argv + argc));
        if (!options)
        {
            std::cout << HELP;
            return 0;
        }
        mp2p_icp_test::with_threads(1, [&]() { run(*options); });
        return 0;
    }
    catch (const std::exception& e)
    {
        std::cerr << "bench-solvers: " << e.what() << " (see --help)\n";
        return 1;
    }
}
