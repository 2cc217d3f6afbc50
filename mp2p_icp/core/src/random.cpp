#include <mp2p_icp/random.h>

#include <cmath>
#include <numeric>
#include <set>

namespace mp2p_icp
{
SeededRandom::result_type SeededRandom::operator()()
{
    uint64_t z = (state_ += 0x9E3779B97F4A7C15u);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

double SeededRandom::uniform()
{
    return static_cast<double>((*this)() >> 11) * 0x1.0p-53;
}

double SeededRandom::uniform(double lo, double hi)
{
    const double value = lo + (hi - lo) * uniform();
    return value < hi ? value : std::nextafter(hi, lo);  // the sum may round up to hi
}

double SeededRandom::gaussian(double sigma)
{
    // Box-Muller; 1-uniform() is in (0,1], so that the logarithm is finite.
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return sigma * radius * std::cos(2.0 * M_PI * uniform());
}

size_t SeededRandom::index(size_t count)
{
    const uint64_t limit = UINT64_MAX - UINT64_MAX % count;  // reject the incomplete last cycle
    uint64_t draw = (*this)();
    while (draw >= limit) draw = (*this)();
    return static_cast<size_t>(draw % count);
}

std::vector<size_t> random_subset(size_t count, size_t wanted, uint64_t seed)
{
    if (wanted >= count)
    {
        std::vector<size_t> all(count);
        std::iota(all.begin(), all.end(), size_t(0));
        return all;
    }
    SeededRandom random(seed);
    std::set<size_t> chosen;
    for (size_t last = count - wanted; last < count; last++)
    {
        const size_t candidate = random.index(last + 1);
        chosen.insert(chosen.count(candidate) ? last : candidate);
    }
    return {chosen.begin(), chosen.end()};
}

}  // namespace mp2p_icp
