/* Response of the focal plane before noise, quantisation after it, and the histogram of counts; see
 * irsim/camera/response.py and irsim/camera/agc.py. Rounded as OpenCV rounds. */
#include "kernels.h"

typedef struct {
    float linear, root, zero, most;
    float unit; /* of the words of gains */
} Response;

/* `out` may be the light itself. */
INLINED void respond(const float *light, const int16_t *gain, float *out, Py_ssize_t length, const Response *by,
                     int rooted, int gaining, int fused)
{
    const Response own = *by;
    EACH_ALONE
    for (Py_ssize_t i = 0; i < length; i++) {
        float lit = light[i], signal = own.zero;
        if (rooted) {
            lit = lit < 0.0f ? 0.0f : lit; /* below 0 by rounding alone */
            signal = plus(signal, sqrtf(lit), own.root, fused);
        }
        signal = plus(signal, lit, own.linear, fused);
        if (gaining)
            signal = plus(signal, signal - own.zero, gain[i] * own.unit, fused);
        out[i] = signal > own.most ? own.most : signal;
    }
}

/* Each case is compiled by itself: without a root or a gain, none is read. */
INLINED void respond_to(const float *light, const int16_t *gain, float *out, Py_ssize_t length, const Response *by,
                        int fused)
{
    if (by->root != 0.0f && gain != NULL)
        respond(light, gain, out, length, by, 1, 1, fused);
    else if (by->root != 0.0f)
        respond(light, gain, out, length, by, 1, 0, fused);
    else if (gain != NULL)
        respond(light, gain, out, length, by, 0, 1, fused);
    else
        respond(light, gain, out, length, by, 0, 0, fused);
}
BOTH(void, respond_to, (const float *light, const int16_t *gain, float *out, Py_ssize_t length, const Response *by),
     light, gain, out, length, by)

#define BLOCK 1024 /* pixels at a time: they stay in the first-level cache */

/* What is added to a signal, and how it becomes counts. */
typedef struct {
    const int16_t *added[MOST_ADDED];
    float weights[MOST_ADDED];
    int count;
    const float *down, *across; /* of each row and column; NULL where there are none */
    Py_ssize_t columns;
    float scale, offset, full;
    int past; /* write past the caches: the counts are read much later, and would displace data in use */
} Digits;

INLINED uint16_t digit(float signal, const Digits *by, int fused)
{
    float level = plus(by->offset, signal, by->scale, fused);
    level = level > 0.0f ? level : 0.0f; /* nan, too */
    level = level < by->full ? level : by->full;
    return (uint16_t)(int32_t)rintf(level);
}

#ifdef SIXTEENS
FUSING INLINED __m256 eight_levels(const float *signal, __m256 down, const float *across, const Digits *by,
                                   Py_ssize_t place)
{
    __m256 sum = _mm256_loadu_ps(signal + place);
    for (int k = 0; k < by->count; k++)
        sum = _mm256_fmadd_ps(eight(by->added[k] + place), _mm256_set1_ps(by->weights[k]), sum);
    if (across != NULL)
        sum = _mm256_add_ps(sum, _mm256_add_ps(down, _mm256_loadu_ps(across)));
    const __m256 level = _mm256_fmadd_ps(sum, _mm256_set1_ps(by->scale), _mm256_set1_ps(by->offset));
    return _mm256_min_ps(_mm256_max_ps(level, _mm256_setzero_ps()), _mm256_set1_ps(by->full)); /* nan is 0 */
}

/* As many pixels of a row as there are by sixteens; returns their number. */
FUSING static Py_ssize_t digitise_sixteens(const float *signal, uint16_t *out, Py_ssize_t from, Py_ssize_t count,
                                           float down, const float *across, const Digits *by)
{
    const Digits own = *by;
    const __m256 row = _mm256_set1_ps(down);
    const int past = own.past && (uintptr_t)(out + from) % sizeof(__m128i) == 0;
    Py_ssize_t i = 0;
    for (; i + 16 <= count; i += 16) {
        const __m256 first = eight_levels(signal, row, across ? across + i : NULL, &own, from + i);
        const __m256 second = eight_levels(signal, row, across ? across + i + 8 : NULL, &own, from + i + 8);
        const __m256i both = _mm256_packus_epi32(_mm256_cvtps_epi32(first), _mm256_cvtps_epi32(second));
        const __m256i counts = _mm256_permute4x64_epi64(both, 0xd8);
        if (past) {
            _mm_stream_si128((__m128i *)(out + from + i), _mm256_castsi256_si128(counts));
            _mm_stream_si128((__m128i *)(out + from + i + 8), _mm256_extracti128_si256(counts, 1));
        } else {
            _mm256_storeu_si256((__m256i *)(out + from + i), counts);
        }
    }
    return i;
}
#else
#define digitise_sixteens(signal, out, from, count, down, across, by) 0
#define _mm_sfence() (void)0
#endif

/* Pixels of one row, to which `down` is added, and `across` where that is not NULL. */
INLINED void digitise_row(const float *signal, uint16_t *out, Py_ssize_t from, Py_ssize_t count, float down,
                          const float *across, const Digits *by, int fused)
{
    float block[BLOCK];
    const Py_ssize_t begin = from, end = from + count;
    from += fused ? digitise_sixteens(signal, out, from, count, down, across, by) : 0;
    for (; from < end; from += BLOCK) {
        const Py_ssize_t run = end - from < BLOCK ? end - from : BLOCK;
        memcpy(block, signal + from, (size_t)run * sizeof *block);
        for (int k = 0; k < by->count; k++) {
            const int16_t *restrict added = by->added[k] + from;
            const float weight = by->weights[k];
            for (Py_ssize_t i = 0; i < run; i++)
                block[i] = plus(block[i], added[i], weight, fused);
        }
        for (Py_ssize_t i = 0; i < run; i++)
            out[from + i] = digit(across == NULL ? block[i] : block[i] + (down + across[from - begin + i]), by, fused);
    }
}

INLINED void digitise(const float *signal, uint16_t *out, Py_ssize_t length, const Digits *by, int fused)
{
    if (by->down == NULL)
        digitise_row(signal, out, 0, length, 0.0f, NULL, by, fused);
    else
        for (Py_ssize_t row = 0; row * by->columns < length; row++)
            digitise_row(signal, out, row * by->columns, by->columns, by->down[row], by->across, by, fused);
    if (fused && by->past)
        _mm_sfence(); /* so that another process sees them */
}
BOTH(void, digitise, (const float *signal, uint16_t *out, Py_ssize_t length, const Digits *by), signal, out, length, by)

/* Argument i as an array of as many elements as another has. */
static const void *as_long(Call *call, int i, const char *format, int flags, Py_ssize_t wanted)
{
    Py_ssize_t length;
    const void *found = array(call, i, format, flags, &length);
    return found == NULL || length == wanted ? found : wrong(call, "arrays of one length are required");
}

KERNEL(signal_of, 8)
{
    Py_ssize_t length;
    const float *light = input(call, 0, "f", &length);
    float *out = (float *)as_long(call, 1, "f", PyBUF_WRITABLE, length);
    const int16_t *gain = call->given[6] == Py_None ? NULL : as_long(call, 6, "h", 0, length);
    const Response by = {(float)number(call, 2), (float)number(call, 3), (float)number(call, 4), (float)number(call, 5),
                         (float)number(call, 7)};
    if (!call->failed)
        CHOSEN(respond_to)(light, gain, out, length, &by);
    return done(call);
}

#define FIRST_ADDED 8

KERNEL_OF(counts_of, FIRST_ADDED, FIRST_ADDED + 2 * MOST_ADDED)
{
    if (call->count % 2 != 0)
        return PyErr_Format(PyExc_TypeError, "counts_of takes pairs of an array and a weight");
    Py_ssize_t length, rows = 0;
    const float *signal = input(call, 0, "f", &length);
    uint16_t *out = (uint16_t *)as_long(call, 1, "H", PyBUF_WRITABLE, length);
    Digits by = {.count = (int)(call->count - FIRST_ADDED) / 2,
                 .scale = (float)number(call, 2),
                 .offset = (float)number(call, 3),
                 .full = (float)number(call, 4),
                 .past = truth(call, 5)};
    if (call->given[6] != Py_None || call->given[7] != Py_None) {
        by.down = input(call, 6, "f", &rows);
        by.across = input(call, 7, "f", &by.columns);
    }
    for (int k = 0; k < by.count; k++) {
        by.added[k] = as_long(call, FIRST_ADDED + 2 * k, "h", 0, length);
        by.weights[k] = (float)number(call, FIRST_ADDED + 2 * k + 1);
    }
    if (call->failed)
        return NULL;
    if (!(by.full >= 0.0f && by.full <= UINT16_MAX))
        return wrong(call, "counts of 16 bits are made");
    if (by.down != NULL && rows * by.columns != length)
        return wrong(call, "a number for each row and column of the signal is required");
    CHOSEN(digitise)(signal, out, length, &by);
    return done(call);
}

#define ENTRIES (UINT16_MAX + 1)

/* Two tables, of even and of odd pixels: neighbours are often alike, and their additions need not wait for each other. */
KERNEL(histogram, 2)
{
    Py_ssize_t length, levels, i = 0;
    const uint16_t *counts = input(call, 0, "H", &length);
    int64_t *pixels = output(call, 1, "l", &levels);
    if (!call->failed && (levels > ENTRIES || length > UINT32_MAX))
        return wrong(call, "levels of 16 bits are required, and a number of pixels of 32 bits");
    uint32_t *even = room(call, 2 * ENTRIES, sizeof *even), *odd = even + ENTRIES;
    if (call->failed)
        return NULL;
    for (; i + 2 <= length; i += 2) {
        even[counts[i]]++;
        odd[counts[i + 1]]++;
    }
    if (i < length)
        even[counts[i]]++;
    for (Py_ssize_t level = 0; level < levels; level++)
        pixels[level] = (int64_t)even[level] + odd[level];
    return done(call);
}
