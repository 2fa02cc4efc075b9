/* Shared by irsim's C kernels: fused sums, images, SIMD, and the list of kernels. */
#ifndef IRSIM_KERNELS_H
#define IRSIM_KERNELS_H

#include "arguments.h"

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

/* Compiles name(..., fused) twice, for processors with and without fused sums; CHOSEN(name) is the one for this
 * processor. */
#define BOTH(type, name, parameters, ...)                                                                              \
    FUSING static type name##_fused parameters                                                                         \
    {                                                                                                                  \
        return name(__VA_ARGS__, 1);                                                                                   \
    }                                                                                                                  \
    static type name##_twice parameters                                                                                \
    {                                                                                                                  \
        return name(__VA_ARGS__, 0);                                                                                   \
    }
#define CHOSEN(name) (fuses() ? name##_fused : name##_twice)

/* Before a loop whose steps are independent, although it may write where it reads. */
#if defined(__GNUC__) && !defined(__clang__)
#define EACH_ALONE _Pragma("GCC ivdep")
#else
#define EACH_ALONE
#endif

/* sum + a b */
INLINED float plus(float sum, float a, float b, int fused)
{
    return fused ? fmaf(a, b, sum) : sum + a * b;
}

typedef struct {
    float *data;
    Py_ssize_t rows, columns, stride; /* from row to row, in elements */
} Plane;

typedef struct {
    const int16_t *data;
    Py_ssize_t rows, columns, stride;
} Words;

/* Argument i as rows of `format`, each element of `step` bytes; rows may lie apart. NULL with an exception. */
static inline const Py_buffer *rows_of(Call *call, int i, int flags, const char *format, Py_ssize_t step)
{
    const Py_buffer *found = view(call, i, PyBUF_STRIDES | flags);
    if (found == NULL || (is_of(found, format) && found->ndim == 2 && found->strides[0] % step == 0 &&
                          (found->strides[1] == step || found->shape[1] <= 1)))
        return found;
    PyErr_Format(PyExc_TypeError, "rows of %s are required", *format == 'f' ? "float32" : "int16");
    call->failed = 1;
    return NULL;
}

static inline Plane plane(Call *call, int i, int flags)
{
    const Py_ssize_t step = sizeof(float);
    const Py_buffer *found = rows_of(call, i, flags, "f", step);
    return found ? (Plane){found->buf, found->shape[0], found->shape[1], found->strides[0] / step} : (Plane){NULL, 0, 0, 0};
}

static inline Words words(Call *call, int i)
{
    const Py_ssize_t step = sizeof(int16_t);
    const Py_buffer *found = rows_of(call, i, 0, "h", step);
    return found ? (Words){found->buf, found->shape[0], found->shape[1], found->strides[0] / step} : (Words){NULL, 0, 0, 0};
}

#if defined(__x86_64__) && defined(__GNUC__)
#define SIXTEENS
#include <immintrin.h>

FUSING INLINED __m256i eight_whole(const int16_t *words)
{
    return _mm256_cvtepi16_epi32(_mm_loadu_si128((const __m128i *)words));
}

FUSING INLINED __m256 eight(const int16_t *words)
{
    return _mm256_cvtepi32_ps(eight_whole(words));
}
#endif

#define MOST_ADDED 8 /* images that counts_of adds to a signal */

/* _kernels.pyi documents their arguments. */
#define FOR_ALL_KERNELS(X)                                                                                             \
    X(lay) X(clutter) X(form) X(spread) X(body_light) X(sprite_light) X(add_normals) X(add_shot) X(bridge)             \
    X(signal_of) X(counts_of) X(cloud) X(mixed) X(moved) X(veil) X(histogram)          \
    X(recursive) X(enhance)
FOR_ALL_KERNELS(DECLARE)

#endif
