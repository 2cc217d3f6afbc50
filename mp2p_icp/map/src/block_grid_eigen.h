#pragma once

#include <array>
#include <cstddef>

namespace mp2p_icp
{
/// Two numbers, for vector instructions.
using Double2 = double __attribute__((vector_size(16)));

/// One number of each matrix of a batch, two by two.
class BatchNumbers
{
 public:
    static constexpr size_t MAX = 64;
    Double2& pair(size_t p) { return pairs_[p]; }
    const Double2& pair(size_t p) const { return pairs_[p]; }
    double operator[](size_t i) const { return pairs_[i / 2][i % 2]; }
    void set(size_t i, double v) { pairs_[i / 2][i % 2] = v; }

 private:
    std::array<Double2, MAX / 2> pairs_{};
};

/// Symmetric, positive semidefinite matrices, side by side.
struct CovarianceBatch
{
    size_t size = 0;
    BatchNumbers xx, xy, xz, yy, yz, zz;
};

/// Of each matrix of a batch.
struct EigenBatch
{
    BatchNumbers trace;
    BatchNumbers values[3];  ///< increasing
    /// Unit eigenvector of values[0], its largest component positive; 0 where values[0] and values[1] are too
    /// close to tell a direction.
    BatchNumbers normal[3];
    /// The same of values[2].
    BatchNumbers direction[3];
};

/// The outer eigenvectors and all eigenvalues. In closed form, by the characteristic polynomial of the
/// matrices, which are divided by their traces for it.
void outer_eigenvectors(CovarianceBatch& covariances, EigenBatch& out);

}  // namespace mp2p_icp
