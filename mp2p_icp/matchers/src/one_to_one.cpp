#include "one_to_one.h"

#include <map>

namespace mp2p_icp
{
std::vector<RatedPair> best_per_global(const std::vector<RatedPair>& pairs)
{
    std::map<size_t, size_t> best;  // global -> position in pairs
    for (size_t i = 0; i < pairs.size(); i++)
    {
        const auto [it, is_first] = best.emplace(pairs[i].global, i);
        if (!is_first && pairs[i].cost < pairs[it->second].cost) it->second = i;
    }
    std::vector<RatedPair> out;
    for (size_t i = 0; i < pairs.size(); i++)
        if (best.at(pairs[i].global) == i) out.push_back(pairs[i]);
    return out;
}

}  // namespace mp2p_icp
