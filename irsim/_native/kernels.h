/* Shared by irsim's C kernels: temporary memory, rounding, images, SIMD, and the list of kernels. */
#ifndef IRSIM_KERNELS_H
#define IRSIM_KERNELS_H

#include <math.h>

#include "arguments.h"

#define MOST_SCRATCH 32

typedef struct {
    void *of[MOST_SCRATCH];
    int count;
} Scratch;

static inline void *held_by(Scratch *held, void *room)
{
    if (room == NULL) {
        PyErr_NoMemory();
        return NULL;
    }
    held->of[held->count++] = room;
    return room;
}

/* Room for `count` things of `size` bytes, all zero; NULL with an exception where there is none. */
static inline void *scratch(Scratch *held, Py_ssize_t count, size_t size)
{
    const size_t things = (size_t)(count > 0 ? count : 1);
    return held_by(held, held->count < MOST_SCRATCH ? PyMem_Calloc(things, size) : NULL);
}

/* The same, with whatever was in it: for what is written before it is read. */
static inline void *scratch_as_is(Scratch *held, Py_ssize_t count, size_t size)
{
    const size_t things = (size_t)(count > 0 ? count : 1);
    const int fits = things <= PY_SSIZE_T_MAX / size && held->count < MOST_SCRATCH;
    return held_by(held, fits ? PyMem_Malloc(things * size) : NULL);
}

static inline void discard(Scratch *held)
{
    while (held->count > 0)
        PyMem_Free(held->of[--held->count]);
}

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

typedef struct {
    float *data;
    Py_ssize_t rows, columns, stride; /* from row to row, in elements */
} Plane;

typedef struct {
    const int16_t *data;
    Py_ssize_t rows, columns, stride;
} Words;

/* The buffer of rows of `format`, each element of `step` bytes; NULL with an exception where it is none. */
static inline const Py_buffer *rows_of(Arrays *arrays, PyObject *given, int writable, const char *format,
                                       Py_ssize_t step)
{
    Py_buffer *view = &arrays->of[arrays->count];
    if (PyObject_GetBuffer(given, view, PyBUF_STRIDES | PyBUF_FORMAT | (writable ? PyBUF_WRITABLE : 0)) < 0)
        return NULL;
    arrays->count++;
    if (view->format == NULL || strcmp(view->format, format) != 0 || view->ndim != 2 || view->strides[0] % step != 0 ||
        (view->strides[1] != step && view->shape[1] > 1)) {
        PyErr_Format(PyExc_TypeError, "rows of %s are wanted", *format == 'f' ? "float32" : "int16");
        return NULL;
    }
    return view;
}

/* 0, or -1 with an exception where it is none. */
static inline int plane(Arrays *arrays, PyObject *given, int writable, Plane *out)
{
    const Py_ssize_t step = sizeof *out->data;
    const Py_buffer *view = rows_of(arrays, given, writable, "f", step);
    if (view == NULL)
        return -1;
    *out = (Plane){view->buf, view->shape[0], view->shape[1], view->strides[0] / step};
    return 0;
}

/* The same of words that are only read. */
static inline int words(Arrays *arrays, PyObject *given, Words *out)
{
    const Py_ssize_t step = sizeof *out->data;
    const Py_buffer *view = rows_of(arrays, given, 0, "h", step);
    if (view == NULL)
        return -1;
    *out = (Words){view->buf, view->shape[0], view->shape[1], view->strides[0] / step};
    return 0;
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

/* Rounded to the nearest (halves to even); what is beyond the least or the greatest word, within 2^31, is that one. */
FUSING INLINED void store_words(int16_t *out, __m256 first, __m256 second)
{
    const __m256i both = _mm256_packs_epi32(_mm256_cvtps_epi32(first), _mm256_cvtps_epi32(second));
    _mm256_storeu_si256((__m256i *)out, _mm256_permute4x64_epi64(both, 0xd8));
}

/* `past` the caches: where whoever reads them comes much later, they would only take the place of what is used
 * before. */
FUSING INLINED void store_counts(uint16_t *out, __m256 first, __m256 second, int past)
{
    const __m256i both = _mm256_packus_epi32(_mm256_cvtps_epi32(first), _mm256_cvtps_epi32(second));
    const __m256i counts = _mm256_permute4x64_epi64(both, 0xd8);
    if (past) {
        _mm_stream_si128((__m128i *)out, _mm256_castsi256_si128(counts));
        _mm_stream_si128((__m128i *)(out + 8), _mm256_extracti128_si256(counts, 1));
    } else {
        _mm256_storeu_si256((__m256i *)out, counts);
    }
}
#endif

#define MOST_ADDED 8 /* images that counts_of adds to a signal */

/* _kernels.pyi documents their arguments. */
#define FOR_ALL_KERNELS(X)                                                                                             \
    X(lay) X(clutter) X(form) X(spread) X(body_light) X(sprite_light) X(add_normals) X(add_shot) X(bridge) \
    X(signal_of) X(counts_of) X(cloud) X(mixed) X(moved) X(veil) X(histogram)
#define DECLARE(name) PyObject *name(PyObject *self, PyObject *const *given, Py_ssize_t count);
FOR_ALL_KERNELS(DECLARE)

#endif
