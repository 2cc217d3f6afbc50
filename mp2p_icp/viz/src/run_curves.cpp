#include <mp2p_icp/errorTerms.h>
#include <mp2p_icp/run_curves.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <stdexcept>

#include "stored_run.h"

namespace mp2p_icp
{
using mrpt::poses::CPose3D;

namespace
{
constexpr double UPPER_SHARE = 0.9;   // of the pairings ...
constexpr double UPPER_FACTOR = 2.0;  // ... whose distances fill this fraction of the histogram (1 / factor)

double distance(const mrpt::tfest::TMatchingPair_d& pair, const CPose3D& pose)
{
    return error_point2point(pair, pose).norm();
}
double distance(const point_line_pair_t& pair, const CPose3D& pose)
{
    return error_point2line(pair, pose).norm();
}
double distance(const point_plane_pair_t& pair, const CPose3D& pose)
{
    return error_point2plane(pair, pose).norm();
}
double distance(const matched_line_t& pair, const CPose3D& pose)
{
    return distance(point_line_pair_t{pair.ln_global, pair.ln_local.pBase}, pose);
}
double distance(const matched_plane_t& pair, const CPose3D& pose)
{
    return distance(point_plane_pair_t{pair.p_global, pair.p_local.centroid}, pose);
}

template <class List>
std::vector<double> distances(const List& pairs, const CPose3D& pose)
{
    std::vector<double> all;
    all.reserve(pairs.size());
    for (const auto& pair : pairs) all.push_back(distance(pair, pose));
    return all;
}

/// See ResidualHistogram::upper.
double upper_bound_of(const PerPairingKind<std::vector<double>>& all)
{
    std::vector<double> finite;
    for (const auto& kind : all)
        std::copy_if(kind.begin(), kind.end(), std::back_inserter(finite),
                     [](double d) { return std::isfinite(d); });
    if (finite.empty()) return 0;
    const double largest = *std::max_element(finite.begin(), finite.end());
    const auto at = static_cast<std::ptrdiff_t>(UPPER_SHARE * static_cast<double>(finite.size() - 1));
    std::nth_element(finite.begin(), finite.begin() + at, finite.end());
    const double usual = finite[static_cast<size_t>(at)];
    return usual > 0 ? std::min(largest, UPPER_FACTOR * usual) : largest;
}

ResidualHistogram::Counts counts_of(const std::vector<double>& distances, double upper, size_t bins)
{
    ResidualHistogram::Counts out;
    out.bins.assign(bins, 0);
    const auto bin_of = [&](double d)
    { return upper > 0 ? static_cast<size_t>(d / upper * static_cast<double>(bins)) : 0; };
    for (const double d : distances)
        if (!std::isfinite(d))
            out.not_finite++;
        else if (d > upper)
            out.beyond++;
        else
            out.bins[std::min(bins - 1, bin_of(d))]++;
    return out;
}
}  // namespace

PerPairingKind<size_t> pairing_counts(const Pairings& p)
{
    return {p.paired_pt2pt.size(), p.paired_pt2ln.size(), p.paired_pt2pl.size(), p.paired_ln2ln.size(),
            p.paired_pl2pl.size()};
}

PerPairingKind<std::vector<double>> residual_distances(const Pairings& p, const CPose3D& localWrtGlobal)
{
    return {distances(p.paired_pt2pt, localWrtGlobal), distances(p.paired_pt2ln, localWrtGlobal),
            distances(p.paired_pt2pl, localWrtGlobal), distances(p.paired_ln2ln, localWrtGlobal),
            distances(p.paired_pl2pl, localWrtGlobal)};
}

RunCurves run_curves(const LogRecord& log)
{
    // Steps are told in stored coordinates, as the run measured them: original ones may be so far away that
    // the least rotation moves their origin by metres.
    const StoredRun run(log);
    RunCurves curves;
    for (const auto& r : log.iterations)
    {
        RunCurvePoint point;
        point.iteration = r.iteration;
        point.step = {r.step_trans, r.step_rot};
        point.to_final = step_between(r.pose, run.end);
        std::copy(r.pairings.begin(), r.pairings.end(), point.pairings.begin());
        point.rms_residual = r.residual_rms, point.cost = r.cost;
        curves.push_back(point);
    }
    return curves;
}

ResidualHistogram residual_histogram(const Pairings& pairings, const CPose3D& localWrtGlobal, size_t bins)
{
    if (bins == 0) throw std::invalid_argument("residual_histogram: `bins` must be at least 1");
    const auto all = residual_distances(pairings, localWrtGlobal);
    ResidualHistogram out;
    out.upper = upper_bound_of(all);
    for (size_t kind = 0; kind < PAIRING_KIND_COUNT; kind++)
        out.kinds[kind] = counts_of(all[kind], out.upper, bins);
    return out;
}

}  // namespace mp2p_icp
