#include <mp2p_icp/consistency_graph.h>
#include <mp2p_icp/parallel.h>
#include <mp2p_icp/random.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "finite_point_pairs.h"

namespace mp2p_icp
{
namespace
{
using Eigen::Vector3d;
using Vertex = uint32_t;  // half the memory; more pairings would not fit into it anyway
using Vertices = std::vector<Vertex>;

constexpr size_t JURY_SIZE = 64;
constexpr int MAX_SETS = 8;

/// What one pairing says on another.
class LengthTest
{
 public:
    explicit LengthTest(double tolerance) : tolerance_(tolerance), tolerance_sq_(tolerance * tolerance) {}

    enum class Answer : uint8_t
    {
        TooNear,  ///< consistent, but so they are under any pose
        Consistent,
        Contradiction
    };
    Answer operator()(const PointPair& i, const PointPair& j) const
    {
        const double a = (i.a - j.a).squaredNorm(), b = (i.b - j.b).squaredNorm();
        // Without roots for nearly all: |a|-|b| = (a^2-b^2) / (|a|+|b|), and (|a|+|b|)^2 <= 2 (a^2+b^2). The
        // margin leaves close calls to the roots. Comparisons so that overflow to NaN contradicts.
        const double difference = a - b;
        if (!(difference * difference <= 2.000001 * tolerance_sq_ * (a + b))) return Answer::Contradiction;
        if (!(std::abs(std::sqrt(a) - std::sqrt(b)) <= tolerance_)) return Answer::Contradiction;
        return std::max(a, b) > tolerance_sq_ ? Answer::Consistent : Answer::TooNear;
    }

 private:
    double tolerance_, tolerance_sq_;
};
using Answer = LengthTest::Answer;

struct Problem
{
    PointPairs pairs;
    LengthTest test;
    ConsistencyGraphParameters params;
};

Problem make_problem(const MatchedPointList& pairs, const ConsistencyGraphParameters& params)
{
    return {finite_pairs(pairs), LengthTest(params.tolerance), params};
}

void shuffle(Vertices& v, uint64_t seed)
{
    SeededRandom random(seed);
    for (size_t left = v.size(); left > 1; left--) std::swap(v[left - 1], v[random.index(left)]);
}

/// 1 .. count-1, shuffled: vertex i tries i + offset, modulo the number of vertices.
Vertices offsets(size_t count, uint64_t seed)
{
    Vertices out(count - 1);
    std::iota(out.begin(), out.end(), Vertex(1));
    shuffle(out, seed);
    return out;
}

struct Partners
{
    std::vector<Vertices> of;  ///< the partners that each vertex found
    bool any = false, contradictions = false;
};

Partners find_partners(const Problem& in)
{
    const size_t n = in.pairs.size();
    const Vertices order = offsets(n, in.params.seed);
    Partners out{std::vector<Vertices>(n)};
    std::vector<char> contradicted(n, 0);
    parallel_for_blocks(n,
                        [&](size_t first, size_t last)
                        {
                            for (size_t i = first; i < last; i++)
                                for (size_t k = 0; k < n - 1 && out.of[i].size() < in.params.max_partners;
                                     k++)
                                {
                                    const size_t j = i + order[k] < n ? i + order[k] : i + order[k] - n;
                                    const Answer answer = in.test(in.pairs[i], in.pairs[j]);
                                    if (answer == Answer::Consistent)
                                        out.of[i].push_back(static_cast<Vertex>(j));
                                    else if (answer == Answer::Contradiction)
                                        contradicted[i] = 1;
                                }
                        });
    for (size_t i = 0; i < n; i++)
    {
        out.any = out.any || !out.of[i].empty();
        out.contradictions = out.contradictions || contradicted[i];
    }
    return out;
}

/// Undirected; the neighbours of v are neighbour[first[v]] .. neighbour[first[v + 1] - 1], each once.
struct Graph
{
    std::vector<size_t> first;
    Vertices neighbour;
    size_t size() const { return first.size() - 1; }
};

Graph make_undirected(const std::vector<Vertices>& partners)
{
    const size_t n = partners.size();
    std::vector<size_t> start(n + 1, 0);
    for (size_t i = 0; i < n; i++)
    {
        start[i + 1] += partners[i].size();
        for (const Vertex j : partners[i]) start[j + 1]++;
    }
    std::partial_sum(start.begin(), start.end(), start.begin());
    Graph g{std::vector<size_t>(n + 1, 0), Vertices(start[n])};
    std::vector<size_t> end(start.begin(), start.end() - 1);
    for (size_t i = 0; i < n; i++)
        for (const Vertex j : partners[i])
        {
            g.neighbour[end[i]++] = j;
            g.neighbour[end[j]++] = static_cast<Vertex>(i);
        }
    size_t kept = 0;  // edges that both ends have found are there twice
    for (size_t i = 0; i < n; i++)
    {
        const auto from = g.neighbour.begin() + static_cast<std::ptrdiff_t>(start[i]),
                   to = g.neighbour.begin() + static_cast<std::ptrdiff_t>(start[i + 1]);
        std::sort(from, to);
        for (auto it = from; it != to; ++it)
            if (it == from || *it != *(it - 1)) g.neighbour[kept++] = *it;
        g.first[i + 1] = kept;
    }
    g.neighbour.resize(kept);
    return g;
}

/// The core number of every vertex in the graph without the removed ones (theirs is 0): Batagelj and
/// Zaversnik.
Vertices core_numbers(const Graph& g, const std::vector<char>& removed)
{
    const size_t n = g.size();
    Vertices degree(n, 0), order(n), place(n);
    for (size_t v = 0; v < n; v++)
        for (size_t e = g.first[v]; e < g.first[v + 1] && !removed[v]; e++)
            degree[v] += !removed[g.neighbour[e]];
    // order: vertices sorted by degree; bucket[d]: where those of degree d begin
    std::vector<size_t> bucket(n + 1, 0);
    for (const Vertex d : degree) bucket[d + 1]++;
    std::partial_sum(bucket.begin(), bucket.end(), bucket.begin());
    std::vector<size_t> next(bucket);
    for (size_t v = 0; v < n; v++)
    {
        place[v] = static_cast<Vertex>(next[degree[v]]++);
        order[place[v]] = static_cast<Vertex>(v);
    }
    for (size_t k = 0; k < n; k++)  // peel the vertex of least degree
    {
        const Vertex v = order[k];
        if (removed[v]) continue;
        for (size_t e = g.first[v]; e < g.first[v + 1]; e++)
        {
            const Vertex u = g.neighbour[e];
            if (degree[u] <= degree[v]) continue;  // peeled already, removed, or in the same core
            // u moves to the front of its bucket, and then the bucket begins one later
            const Vertex front = order[bucket[degree[u]]];
            std::swap(order[place[u]], order[place[front]]);
            std::swap(place[u], place[front]);
            bucket[degree[u]--]++;
        }
    }
    return degree;
}

/// The core vertex with most neighbours in the core.
Vertex best_connected(const Graph& g, const Vertices& core, Vertex core_number)
{
    Vertex best = 0, best_degree = 0;
    for (Vertex v = 0; v < g.size(); v++)
    {
        if (core[v] != core_number) continue;
        Vertex degree = 0;
        for (size_t e = g.first[v]; e < g.first[v + 1]; e++) degree += core[g.neighbour[e]] == core_number;
        if (degree > best_degree) best_degree = degree, best = v;
    }
    return best;
}

/// A random choice from the members, such that each juror can tell on each other.
Vertices choose_jury(const Problem& in, Vertices members)
{
    shuffle(members, in.params.seed);
    Vertices jury;
    for (const Vertex m : members)
    {
        if (jury.size() == JURY_SIZE) break;
        if (std::none_of(jury.begin(), jury.end(),
                         [&](Vertex j) { return in.test(in.pairs[j], in.pairs[m]) == Answer::TooNear; }))
            jury.push_back(m);
    }
    return jury;
}

/// All pairings that agree with most of those jurors that can tell.
Vertices verdict(const Problem& in, const Vertices& jury)
{
    if (jury.empty()) return {};
    std::vector<char> accepted(in.pairs.size(), 0);
    parallel_for_blocks(in.pairs.size(),
                        [&](size_t first, size_t last)
                        {
                            for (size_t i = first; i < last; i++)
                            {
                                int votes = 0, consistent = 0;
                                for (const Vertex j : jury)
                                {
                                    const Answer answer = in.test(in.pairs[i], in.pairs[j]);
                                    votes += answer != Answer::TooNear;
                                    consistent += answer == Answer::Consistent;
                                }
                                accepted[i] = votes == 0 || 2 * consistent > votes;
                            }
                        });
    Vertices out;
    for (Vertex i = 0; i < accepted.size(); i++)
        if (accepted[i]) out.push_back(i);
    return out;
}

/// All pairings that agree with the part of the core around its best connected vertex.
Vertices set_around(const Problem& in, const Vertices& core, Vertex core_number, Vertex centre)
{
    Vertices members;  // if several sets have joined in the core, those of one
    for (Vertex v = 0; v < core.size(); v++)
        if (core[v] == core_number && in.test(in.pairs[v], in.pairs[centre]) != Answer::Contradiction)
            members.push_back(v);
    for (int round = 0; round < 2; round++) members = verdict(in, choose_jury(in, members));
    return members;
}

Vertices largest_set(const Problem& in, const Graph& g)
{
    Vertices best;
    std::vector<char> removed(g.size(), 0);
    for (int set = 0; set < MAX_SETS; set++)
    {
        const Vertices core = core_numbers(g, removed);
        const Vertex number = *std::max_element(core.begin(), core.end());
        // In a set as large as the best, each has about min(size, cap) neighbours.
        if (number == 0 || 2 * number < std::min(best.size(), in.params.max_partners)) break;
        const Vertex centre = best_connected(g, core, number);
        const Vertices found = set_around(in, core, number, centre);
        removed[centre] = 1;
        for (const Vertex v : found) removed[v] = 1;
        if (found.size() > best.size()) best = found;
    }
    return best;
}

void check(const ConsistencyGraphParameters& p)
{
    if (!(p.tolerance > 0) || !std::isfinite(p.tolerance))
        throw std::invalid_argument(
            "consistency_graph_inliers: tolerance must be positive and finite, in metres");
    if (p.max_partners == 0)
        throw std::invalid_argument("consistency_graph_inliers: max_partners must be at least 1");
}
}  // namespace

std::vector<size_t> consistency_graph_inliers(const MatchedPointList& pairs,
                                              const ConsistencyGraphParameters& params)
{
    check(params);
    const Problem problem = make_problem(pairs, params);
    if (problem.pairs.empty()) return {};
    const Partners partners = find_partners(problem);
    if (!partners.any) return partners.contradictions ? std::vector<size_t>() : indices_of(problem.pairs);
    std::vector<size_t> indices;
    for (const Vertex v : largest_set(problem, make_undirected(partners.of)))
        indices.push_back(problem.pairs[v].index);
    return indices;
}

}  // namespace mp2p_icp
