#include "outer_sums.h"

namespace mp2p_icp
{
namespace
{
namespace baseline
{
#include "outer_sums_kernel.inc"
}
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define MP2P_ICP_X86_KERNELS
namespace avx2
{
#pragma GCC push_options
#pragma GCC target("arch=haswell")
#include "outer_sums_kernel.inc"
#pragma GCC pop_options
}  // namespace avx2
#endif

using Kernel = void (*)(const double*, int, const double*, int, size_t, double*);

Kernel chosen_kernel()
{
#ifdef MP2P_ICP_X86_KERNELS
    __builtin_cpu_init();  // this may run before the constructors of libgcc
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return avx2::add_outer;
#endif
    return baseline::add_outer;
}
const Kernel KERNEL = chosen_kernel();
}  // namespace

void add_outer_sums(const double* a, int rows, const double* b, int columns, size_t count, double* sums)
{
    KERNEL(a, rows, b, columns, (count + 3) / 4, sums);
}

}  // namespace mp2p_icp
