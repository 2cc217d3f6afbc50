#include "compact_pairings.h"

#include <mrpt/serialization/CArchive.h>

#include "compact_points.h"

/// \file compact_pairings.cpp Points, lines and planes in the forms of compact_points.cpp and
/// compact_surfaces.h, and then all other kinds, as Pairings::serializeTo() writes them.
namespace mp2p_icp
{
using mrpt::serialization::CArchive;

void CompactPairingsWriter::write(CArchive& out, const Pairings& p)
{
    write_compact_points(out, p.paired_pt2pt, global_, local_);
    lines_.write(out, p.paired_pt2ln);
    planes_.write(out, p.paired_pt2pl);
    Pairings rest;
    rest.paired_ln2ln = p.paired_ln2ln, rest.paired_pl2pl = p.paired_pl2pl;
    rest.point_weights = p.point_weights;
    rest.pt2ln_weights = p.pt2ln_weights, rest.pt2pl_weights = p.pt2pl_weights;
    rest.ln2ln_weights = p.ln2ln_weights, rest.pl2pl_weights = p.pl2pl_weights;
    rest.potential_pairings = p.potential_pairings;
    out << rest;
}

Pairings CompactPairingsReader::read(CArchive& in)
{
    MatchedPointList points;
    MatchedPointLineList lines;
    MatchedPointPlaneList planes;
    read_compact_points(in, points, global_, local_);
    lines_.read(in, lines);
    planes_.read(in, planes);
    Pairings out;
    in >> out;
    out.paired_pt2pt = std::move(points), out.paired_pt2ln = std::move(lines);
    out.paired_pt2pl = std::move(planes);
    return out;
}

}  // namespace mp2p_icp
