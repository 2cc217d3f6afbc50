#include "diagnosis_search.h"

#include <mp2p_icp/se3.h>
#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

/** \file diagnosis_search.cpp
 * The first alternative that lays the maps on each other is what was missing. The limits:
 *  - FITS: the share of the local points that fit (see MapFit) when both show the same place. Nearly all do
 * if the local map lies within the global one, but sensors a few metres apart see up to a third of their
 * points without the other's. Wrong places reach a half, by what all places have in common.
 * Maps that share less are judged by what they share (MapFit::fits_where_maps_overlap()).
 *  - OTHER_PLACE: that half, and twice the standard error of a share of 400 points.
 *  - BETTER: by how much an alternative must fit better than what the run found to be blamed for it. A share
 * of 400 points has a standard error of up to 0.025; the difference of two, 0.035; four times that.
 *  - GROSS_SCALE: maps may differ in extent (a scan and a city), and in density; no two maps differ by 20 and
 * more in both at once unless the units do.
 *  - SCALE: what moves the points at the border of a map by 2 % of its radius is more than noise.
 *  - NEAR: nearest neighbours tell the way while a displacement is smaller than the things in the scene. Up
 * to a fifth of the map's rms radius a larger matching distance helps; beyond it is the guess that has to
 * be better.
 *  - WIDE_GATE: pairs of one surface are nearby, so that twice that distance admits more wrong pairs than
 * right ones.
 */
namespace mp2p_icp
{
using mrpt::poses::CPose3D;
using Cause = DiagnosisCause;

namespace
{
constexpr double FITS = 0.65, OTHER_PLACE = 0.55, BETTER = 0.14, GROSS_SCALE = 20, SCALE = 0.02, NEAR = 0.2,
                 WIDE_GATE = 2;

CPose3D turn(double yaw_deg, double pitch_deg, double roll_deg)
{
    return {0, 0, 0, mrpt::DEG2RAD(yaw_deg), mrpt::DEG2RAD(pitch_deg), mrpt::DEG2RAD(roll_deg)};
}

std::vector<CPose3D> heading_turns()
{
    std::vector<CPose3D> turns;
    for (int deg = 0; deg < 360; deg += 30) turns.push_back(turn(deg, 0, 0));
    return turns;
}

/// All ways to name the axes of a right-handed frame that are not headings: upside down first.
std::vector<CPose3D> frame_turns()
{
    std::vector<CPose3D> turns;
    for (const double heading : {0, 90, 180, 270}) turns.push_back(turn(heading, 0, 180));
    for (const double heading : {0, 90, 180, 270})
        for (const auto& tip : {turn(0, 90, 0), turn(0, -90, 0), turn(0, 0, 90), turn(0, 0, -90)})
            turns.push_back(turn(heading, 0, 0) + tip);
    return turns;
}

class Search
{
 public:
    Search(const MapFit& maps, const RunEnds& run, Diagnosis& out)
        : maps_(maps), run_(run), out_(out), found_fits_in_part_(maps.fits_where_maps_overlap(run.found))
    {
    }

    Cause cause()
    {
        if (gross_scale()) return Cause::WrongScale;
        if (run_.ran_out && was_on_its_way()) return Cause::TooFewIterations;
        if (accept(maps_.fit_from(run_.found, maps_.nearby()))) return why_not_there();
        if (run_.trusted && (out_.overlap >= FITS || found_fits_in_part_)) return Cause::AllIsWell;
        if (wider_gate()) return why_not_there();
        if (scale()) return Cause::WrongScale;
        if (inverted()) return Cause::InvertedGuess;
        if (turned(heading_turns())) return Cause::BadGuess;
        if (turned(frame_turns())) return Cause::WrongFrame;
        if (run_.ran_out) return Cause::TooFewIterations;
        return run_.trusted && out_.overlap >= OTHER_PLACE ? Cause::AllIsWell : Cause::Unknown;
    }

 private:
    bool accept(const Fit& fit)
    {
        const bool fits = fit.share >= FITS && fit.share >= out_.overlap + BETTER;
        if (!fits && !fits_in_part(fit)) return false;
        out_.better_pose = fit.pose, out_.better_scale = fit.scale, out_.better_overlap = fit.share;
        return true;
    }

    bool fits_in_part(const Fit& fit) const
    {
        return !found_fits_in_part_ && fit.scale == 1 && fit.share >= out_.overlap &&
               maps_.fits_where_maps_overlap(fit.pose);
    }

    /// To where the maps fit, that is.
    bool was_on_its_way()
    {
        return out_.overlap >= FITS ||
               accept(maps_.fit_from(run_.found, std::min(run_.last_gate, widest_gate())));
    }

    /// What is farther away is left to other starts.
    double widest_gate() const { return 0.5 * maps_.radius(); }

    Cause why_not_there() const
    {
        const double missed_by = maps_.displacement(run_.guess, *out_.better_pose);
        if (missed_by > run_.first_gate)
            return missed_by <= NEAR * maps_.radius() ? Cause::ThresholdTooSmall : Cause::BadGuess;
        return run_.last_gate > WIDE_GATE * maps_.nearby() ? Cause::ThresholdTooLarge : Cause::BadGuess;
    }

    bool gross_scale()
    {
        const double size = maps_.global_radius() / maps_.radius(),
                     density = maps_.spacing() / maps_.local_spacing();
        const bool gross = (size > GROSS_SCALE && density > GROSS_SCALE) ||
                           (size * GROSS_SCALE < 1 && density * GROSS_SCALE < 1);
        if (gross) out_.better_scale = std::sqrt(size * density);
        return gross;
    }

    bool wider_gate()
    {
        for (const double times : {1.0, 3.0, 10.0})
            if (times * run_.first_gate <= widest_gate() &&
                accept(maps_.fit_from(run_.guess, times * run_.first_gate)))
                return true;
        return accept(maps_.fit_from(run_.guess, widest_gate()));
    }

    bool scale()
    {
        Fit best;
        for (const double step : {1.03, 1.06, 1.1, 1.15, 1.2, 1.3})
            for (const double factor : {step, 1 / step})
                for (const CPose3D& start : {run_.guess, run_.found})
                    if (const Fit fit = maps_.fit_from(start, widest_gate(), factor); fit.share > best.share)
                        best = fit;
        for (int i = 0; i < 5; i++)
            best = maps_.fit_from(best.pose, maps_.nearby(), maps_.better_scale(best));
        return std::abs(std::log(best.scale)) > SCALE && accept(best);
    }

    bool inverted()
    {
        const CPose3D inverse = -run_.guess;
        return maps_.displacement(run_.guess, inverse) > maps_.nearby() &&
               accept(maps_.fit_from(inverse, std::min(run_.first_gate, widest_gate())));
    }

    /// The best one that is found from the guess turned in these ways, in its place and with the means of
    /// both maps together.
    bool turned(const std::vector<CPose3D>& turns)
    {
        constexpr double no_doubt = 0.9;
        Fit best;
        std::optional<Fit> in_part;
        for (const auto& t : turns)
            for (const CPose3D& start : {run_.guess + t, maps_.means_together(run_.guess + t)})
            {
                if (best.share >= no_doubt) return accept(best);
                const Fit fit = maps_.fit_from(start, widest_gate());
                if (fit.share > best.share) best = fit;
                if ((!in_part || fit.share > in_part->share) && fits_in_part(fit)) in_part = fit;
            }
        return accept(best) || (in_part && accept(*in_part));
    }

    const MapFit& maps_;
    const RunEnds& run_;
    Diagnosis& out_;
    const bool found_fits_in_part_;
};
}  // namespace

Cause search_cause(const MapFit& maps, const RunEnds& run, Diagnosis& out)
{
    out.overlap = maps.share(run.found);
    return Search(maps, run, out).cause();
}

}  // namespace mp2p_icp
