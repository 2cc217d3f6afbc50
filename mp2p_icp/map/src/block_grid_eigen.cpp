#include "block_grid_eigen.h"

#include <cmath>
#include <limits>

namespace mp2p_icp
{
namespace
{
/// Halley steps from 0: cubic for a simple root; for a double one each leaves a third of the error.
constexpr int ROOT_STEPS = 6;

/// After a smaller step (of a root between 0 and 1/3) the next one would be rounding, or the root is double.
constexpr double SMALL_STEP = 1e-6;

/// Below this (of the matrix divided by its trace) the product of the gaps to the other eigenvalues is
/// rounding.
constexpr double SMALLEST_GAPS = 1e-10;

Double2 larger(const Double2& a, const Double2& b)
{
    return a > b ? a : b;
}

/// Divides the matrices by their traces. A zero matrix stays one.
void normalize(CovarianceBatch& c, size_t p, EigenBatch& out)
{
    out.trace.pair(p) = c.xx.pair(p) + c.yy.pair(p) + c.zz.pair(p);
    const Double2 scale = 1 / larger(out.trace.pair(p), Double2{} + std::numeric_limits<double>::min());
    for (BatchNumbers* n : {&c.xx, &c.xy, &c.xz, &c.yy, &c.yz, &c.zz}) n->pair(p) *= scale;
}

struct Roots
{
    Double2 smallest, minors;  ///< minors: the sum of the products of two eigenvalues
};

/** The smallest root of det - minors l + l^2 - l^3, for matrices with trace 1: between 0 and 1/3. From 0,
 * which is left of all roots, Halley's steps rise to it and do not pass it (rounding aside).
 */
Roots smallest_roots(const CovarianceBatch& c, size_t p)
{
    const Double2 xx = c.xx.pair(p), xy = c.xy.pair(p), xz = c.xz.pair(p), yy = c.yy.pair(p),
                  yz = c.yz.pair(p), zz = c.zz.pair(p);
    const Double2 minor_x = yy * zz - yz * yz;
    const Double2 minors = minor_x + (xx * zz - xz * xz) + (xx * yy - xy * xy);
    const Double2 det = xx * minor_x - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
    Double2 l{}, last_step = Double2{} + 1;
    for (int k = 0; k < ROOT_STEPS && (last_step[0] > SMALL_STEP || last_step[1] > SMALL_STEP); k++)
    {
        const Double2 value = det + l * (l * (1 - l) - minors);
        const Double2 descent = minors - l * (2 - 3 * l), bend = 2 - 6 * l;
        const Double2 divisor = 2 * descent * descent - value * bend;
        // One lane ends without regard to the other: what is found does not depend on who is beside.
        last_step = (divisor > 0) & (last_step > SMALL_STEP) ? 2 * value * descent / divisor : Double2{};
        l += last_step;
    }
    const Double2 third = Double2{} + 1.0 / 3;
    return {larger(l < third ? l : third, Double2{}), minors};
}

/// The column of the adjugate of (C - l I) with the largest diagonal element, which is positive for the
/// smallest and for the largest eigenvalue l.
void adjugate_column(const CovarianceBatch& c, size_t p, const Double2& l, BatchNumbers out[3])
{
    const Double2 xx = c.xx.pair(p) - l, yy = c.yy.pair(p) - l, zz = c.zz.pair(p) - l;
    const Double2 xy = c.xy.pair(p), xz = c.xz.pair(p), yz = c.yz.pair(p);
    const Double2 axx = yy * zz - yz * yz, ayy = xx * zz - xz * xz, azz = xx * yy - xy * xy;
    const Double2 axy = xz * yz - xy * zz, axz = xy * yz - xz * yy, ayz = xy * xz - xx * yz;
    const auto by_y = ayy > axx;
    const auto by_z = azz > larger(axx, ayy);
    out[0].pair(p) = by_z ? axz : by_y ? axy : axx;
    out[1].pair(p) = by_z ? ayz : by_y ? ayy : axy;
    out[2].pair(p) = by_z ? azz : by_y ? ayz : axz;
}

void normalize_column(size_t i, BatchNumbers out[3])
{
    const double x = out[0][i], y = out[1][i], z = out[2][i];
    const double length = std::sqrt(x * x + y * y + z * z);
    const double scale = length > SMALLEST_GAPS ? 1 / length : 0;
    out[0].set(i, x * scale), out[1].set(i, y * scale), out[2].set(i, z * scale);
}

/// The other two: their sum and product follow from the trace and the minors. \return the largest, of the
/// matrix divided by its trace
double set_eigenvalues(size_t i, double smallest, double minors, EigenBatch& out)
{
    const double sum = 1 - smallest, product = minors - smallest * sum;
    const double discriminant = sum * sum - 4 * product;
    const double largest = 0.5 * (sum + (discriminant > 0 ? std::sqrt(discriminant) : 0));
    const double middle = product / largest;
    out.values[0].set(i, smallest * out.trace[i]);
    out.values[1].set(i, (middle > smallest ? middle : smallest) * out.trace[i]);
    out.values[2].set(i, largest * out.trace[i]);
    return largest;
}
}  // namespace

void outer_eigenvectors(CovarianceBatch& c, EigenBatch& out)
{
    for (size_t p = 0; 2 * p < c.size; p++)
    {
        normalize(c, p, out);
        const Roots roots = smallest_roots(c, p);
        const Double2 largest = {set_eigenvalues(2 * p, roots.smallest[0], roots.minors[0], out),
                                 set_eigenvalues(2 * p + 1, roots.smallest[1], roots.minors[1], out)};
        adjugate_column(c, p, roots.smallest, out.normal);
        adjugate_column(c, p, largest, out.direction);
        for (size_t i = 2 * p; i < 2 * p + 2; i++)
            normalize_column(i, out.normal), normalize_column(i, out.direction);
    }
}

}  // namespace mp2p_icp
