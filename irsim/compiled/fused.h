/* Sums of products that are rounded as OpenCV's: once where the processor multiplies and adds in one step, which is
 * asked when the program runs, else twice. */
#ifndef IRSIM_FUSED_H
#define IRSIM_FUSED_H

#include <math.h>

#if defined(__GNUC__)
#define INLINED static inline __attribute__((always_inline))
#else
#define INLINED static inline
#endif

#if defined(__x86_64__) && defined(__GNUC__)
#define FUSING __attribute__((target("avx2,fma")))
static inline int fuses(void)
{
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
}
#else
#define FUSING
static inline int fuses(void)
{
#ifdef FP_FAST_FMAF
    return 1;
#else
    return 0;
#endif
}
#endif

/* sum + a b. A loop that has it is compiled twice, `fused` being known in each. */
INLINED float plus(float sum, float a, float b, int fused)
{
    return fused ? fmaf(a, b, sum) : sum + a * b;
}

#endif
