#pragma once

#include <mp2p_icp/OptimalTF_Result.h>
#include <mp2p_icp/Pairings.h>
#include <mp2p_icp/WeightParameters.h>

#include <array>
#include <limits>
#include <memory>
#include <vector>

#include "residual_terms.h"

namespace mp2p_icp
{
/// The weights of the pairings of one kind: one for all, or one each.
struct ListWeights
{
    double common = 1;
    std::vector<double> each;  ///< factors on `common`; empty: all 1

    double operator[](size_t i) const { return each.empty() ? common : common * each[i]; }
};

/** Pairings as solvers use them: with a weight each, and without those that cannot be used. Numbers that are
 * not finite (or beyond 1e20) are found by drop_unusable(), which is called only when a sum over the
 * pairings shows that there are some: looking for them each time would cost as much as solving.
 */
class PreparedPairings
{
 public:
    /// `in` and `kinds` must outlive it. \exception std::invalid_argument for a weight that is negative or
    /// not finite.
    PreparedPairings(const Pairings& in, const PairWeights& kinds);

    const Pairings& pairings() const { return clean_ ? *clean_ : *in_; }
    const PairWeights& kinds() const { return *kinds_; }
    size_t size() const { return pairings().size(); }
    size_t skipped() const { return skipped_; }
    /// How many scalar equations count.
    size_t rows() const;

    /// Of a kind's positions.
    const ListWeights& weights(PairingKind kind) const { return weights_[static_cast<size_t>(kind)]; }
    double weight(const PairingId& id) const { return weights(id.kind)[id.index]; }
    /** Of a pairing's direction, `L` being the length that turns rad into m. The pairing's own weight and all
     * factors count for it as for its position.
     */
    double direction_weight(const PairingId& id, double L) const;
    /// What a kind's directions weigh, before pairings' own weights.
    double direction_weight(PairingKind kind, double L) const;

    /// Does the pairing count at all?
    bool in_use(const PairingId& id) const
    {
        return weight(id) > 0 || (id.kind >= PairingKind::Line2Line && direction_weight(id, 1) > 0);
    }

    PairingTerms terms(const PairingId& id) const { return terms_of(pairings(), id, *kinds_); }

    /// Multiplies the weight of one pairing, of its position and of its direction.
    void scale_weight(const PairingId& id, double factor);
    /// The pairings as they are now, with these factors (in the order of pairing_id()) on their weights.
    PreparedPairings with_factors(const std::vector<double>& factors) const;

    /// Is there surely nothing that drop_unusable() leaves out? Costs a fraction of that.
    bool all_usable() const;
    /// Leaves out what is not finite, or has a direction of zero length. \return were there any?
    bool drop_unusable();

    /// Adds a pairing to the list of outliers, by its index in the original lists.
    void note_outlier(const PairingId& id, OutlierIndices& outliers) const;

 private:
    const Pairings* in_;
    const PairWeights* kinds_;
    std::array<ListWeights, 5> weights_;
    size_t skipped_ = 0;
    std::shared_ptr<const Pairings> clean_;              ///< if something had to be left out
    std::array<std::vector<size_t>, 5> original_index_;  ///< of clean_'s pairings
};

}  // namespace mp2p_icp
