/* Sums of products that are rounded as OpenCV's: once where the processor multiplies and adds in one step, which is
 * asked when the program runs, else twice. */
#ifndef IRSIM_FUSED_H
#define IRSIM_FUSED_H

#include <math.h>

#if defined(__GNUC__)
#define INLINED static inline __attribute__((always_inline))
#define RARE __attribute__((noinline, cold)) /* kept out of the loop that calls it */
#else
#define INLINED static inline
#define RARE
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

/* The same by registers of 512 bits, for a loop that they make faster. */
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define WIDE_VECTORS
#define FUSING_WIDELY __attribute__((target("avx512f,avx512bw,avx512dq,avx512vl,fma,prefer-vector-width=512")))
static inline int fuses_widely(void)
{
    return fuses() && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
           __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
}
#else
#define FUSING_WIDELY
static inline int fuses_widely(void)
{
    return 0;
}
#endif

/* Before a loop whose steps have nothing to do with each other: for what it writes to may be what it reads. */
#if defined(__GNUC__) && !defined(__clang__)
#define EACH_ALONE _Pragma("GCC ivdep")
#else
#define EACH_ALONE
#endif

/* sum + a b. A loop that has it is compiled twice, `fused` being known in each. */
INLINED float plus(float sum, float a, float b, int fused)
{
    return fused ? fmaf(a, b, sum) : sum + a * b;
}

#endif
