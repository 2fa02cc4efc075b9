/* Response of the focal plane before noise, quantisation after it, and the histogram of counts; see
 * irsim/camera/response.py and irsim/camera/agc.py. Rounded as OpenCV rounds. */
#include "kernels.h"

typedef struct {
    float linear, root, zero, most;
    float unit; /* of the words of gains */
} Answer;

/* `out` may be the light itself. */
INLINED void answer(const float *light, const int16_t *gain, float *out, Py_ssize_t length, const Answer *by,
                    int rooted, int gaining, int fused)
{
    const Answer own = *by;
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

INLINED void answer_each(const float *light, const int16_t *gain, float *out, Py_ssize_t length, const Answer *by,
                         int fused)
{
    if (by->root != 0.0f && gain != NULL)
        answer(light, gain, out, length, by, 1, 1, fused);
    else if (by->root != 0.0f)
        answer(light, gain, out, length, by, 1, 0, fused);
    else if (gain != NULL)
        answer(light, gain, out, length, by, 0, 1, fused);
    else
        answer(light, gain, out, length, by, 0, 0, fused);
}

FUSING static void answer_fused(const float *light, const int16_t *gain, float *out, Py_ssize_t length,
                                const Answer *by)
{
    answer_each(light, gain, out, length, by, 1);
}

static void answer_twice(const float *light, const int16_t *gain, float *out, Py_ssize_t length, const Answer *by)
{
    answer_each(light, gain, out, length, by, 0);
}

#define BLOCK 1024 /* pixels at a time: they stay in the first-level cache */

/* What is added to a signal, and how it becomes counts. */
typedef struct {
    const int16_t *added[MOST_ADDED];
    float weights[MOST_ADDED];
    int count;
    const float *down, *across; /* of each row and column; NULL where there are none */
    Py_ssize_t columns;
    float scale, offset, full;
    int past; /* whether they go past the caches, see store_counts */
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

/* As many pixels of a row as there are by sixteens: how many they are. */
FUSING static Py_ssize_t digitise_sixteens(const float *signal, uint16_t *out, Py_ssize_t from, Py_ssize_t count,
                                           float down, const float *across, const Digits *by)
{
    const Digits own = *by;
    const __m256 row = _mm256_set1_ps(down);
    const int past = own.past && (uintptr_t)(out + from) % sizeof(__m128i) == 0;
    Py_ssize_t i = 0;
    for (; i + 16 <= count; i += 16) {
        const float *beyond = across == NULL ? NULL : across + i + 8;
        store_counts(out + from + i, eight_levels(signal, row, across == NULL ? NULL : across + i, &own, from + i),
                     eight_levels(signal, row, beyond, &own, from + i + 8), past);
    }
    return i;
}
#else
#define digitise_sixteens(signal, out, from, count, down, across, by) 0
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
}

FUSING static void digitise_fused(const float *signal, uint16_t *out, Py_ssize_t length, const Digits *by)
{
    digitise(signal, out, length, by, 1);
#ifdef SIXTEENS
    if (by->past)
        _mm_sfence(); /* or another process might not see them when it is told of them */
#endif
}

static void digitise_twice(const float *signal, uint16_t *out, Py_ssize_t length, const Digits *by)
{
    digitise(signal, out, length, by, 0);
}

static int number(PyObject *given, float *out)
{
    *out = (float)PyFloat_AsDouble(given);
    return PyErr_Occurred() ? -1 : 0;
}

/* An array of as many elements as another has; NULL with an exception where it is none. */
static void *as_long(Arrays *arrays, PyObject *given, const char *format, int writable, Py_ssize_t wanted)
{
    Py_ssize_t length;
    void *found = array(arrays, given, format, writable, &length);
    if (found != NULL && length != wanted) {
        PyErr_SetString(PyExc_ValueError, "arrays of one length are wanted");
        return NULL;
    }
    return found;
}

/* signal_of(light, out, linear, root, zero, most, gain or None, unit) */
PyObject *signal_of(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    if (count != 8)
        return PyErr_Format(PyExc_TypeError, "signal_of takes 8 arguments, not %zd", count);
    Answer by;
    if (number(given[2], &by.linear) < 0 || number(given[3], &by.root) < 0 || number(given[4], &by.zero) < 0 ||
        number(given[5], &by.most) < 0 || number(given[7], &by.unit) < 0)
        return NULL;
    Arrays arrays = {.count = 0};
    Py_ssize_t length;
    const int16_t *gain = NULL;
    const float *light = array(&arrays, given[0], "f", 0, &length);
    float *out = light ? as_long(&arrays, given[1], "f", 1, length) : NULL;
    int done = out != NULL;
    if (done && given[6] != Py_None)
        done = (gain = as_long(&arrays, given[6], "h", 0, length)) != NULL;
    if (done)
        (fuses() ? answer_fused : answer_twice)(light, gain, out, length, &by);
    release(&arrays);
    if (!done)
        return NULL;
    Py_RETURN_NONE;
}

/* Reads a number for each row and each column of a picture, where there are any: 0, or -1 with an exception. */
static int lines_of(Arrays *arrays, PyObject *const *given, Py_ssize_t length, Digits *by)
{
    Py_ssize_t rows;
    if (given[0] == Py_None && given[1] == Py_None)
        return 0;
    if ((by->down = array(arrays, given[0], "f", 0, &rows)) == NULL ||
        (by->across = array(arrays, given[1], "f", 0, &by->columns)) == NULL)
        return -1;
    if (rows * by->columns == length)
        return 0;
    PyErr_SetString(PyExc_ValueError, "a number for each row and column of the signal is wanted");
    return -1;
}

#define FIRST_ADDED 8

/* counts_of(signal, out, scale, offset, full, past, down or None, across or None, then each that is added, and its
 * weight) */
PyObject *counts_of(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Digits by = {.count = (int)((count - FIRST_ADDED) / 2)};
    if (count < FIRST_ADDED || (count - FIRST_ADDED) % 2 != 0 || count > FIRST_ADDED + 2 * MOST_ADDED)
        return PyErr_Format(PyExc_TypeError, "counts_of takes %d arguments and up to %d pairs, not %zd arguments",
                            FIRST_ADDED, MOST_ADDED, count);
    if (number(given[2], &by.scale) < 0 || number(given[3], &by.offset) < 0 || number(given[4], &by.full) < 0)
        return NULL;
    by.past = PyObject_IsTrue(given[5]);
    if (by.past < 0)
        return NULL;
    if (!(by.full >= 0.0f && by.full <= UINT16_MAX)) {
        PyErr_SetString(PyExc_ValueError, "counts of 16 bits are made");
        return NULL;
    }
    Arrays arrays = {.count = 0};
    Py_ssize_t length;
    const float *signal = array(&arrays, given[0], "f", 0, &length);
    uint16_t *out = signal ? as_long(&arrays, given[1], "H", 1, length) : NULL;
    int done = out != NULL && lines_of(&arrays, given + 6, length, &by) == 0;
    for (int k = 0; done && k < by.count; k++)
        done = (by.added[k] = as_long(&arrays, given[FIRST_ADDED + 2 * k], "h", 0, length)) != NULL &&
               number(given[FIRST_ADDED + 1 + 2 * k], &by.weights[k]) == 0;
    if (done)
        (fuses() ? digitise_fused : digitise_twice)(signal, out, length, &by);
    release(&arrays);
    if (!done)
        return NULL;
    Py_RETURN_NONE;
}

#define ENTRIES (UINT16_MAX + 1)

/* `tables` are two, of a place for each 16-bit word, of zeros: neighbours are often alike, and a pixel need not wait
   until the one before it is counted. */
static void count_pixels(const uint16_t *counts, Py_ssize_t length, int64_t *pixels, Py_ssize_t levels,
                         uint32_t *tables)
{
    uint32_t *const even = tables, *const odd = tables + ENTRIES;
    Py_ssize_t i = 0;
    for (; i + 4 <= length; i += 4) {
        even[counts[i]]++;
        odd[counts[i + 1]]++;
        even[counts[i + 2]]++;
        odd[counts[i + 3]]++;
    }
    for (; i < length; i++)
        even[counts[i]]++;
    for (Py_ssize_t level = 0; level < levels; level++)
        pixels[level] = (int64_t)even[level] + odd[level];
}

/* histogram(counts, pixels) */
PyObject *histogram(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    if (count != 2)
        return PyErr_Format(PyExc_TypeError, "histogram takes 2 arguments, not %zd", count);
    Arrays arrays = {.count = 0};
    Scratch held = {.count = 0};
    Py_ssize_t length, levels;
    const uint16_t *counts = array(&arrays, given[0], "H", 0, &length);
    int64_t *pixels = counts ? array(&arrays, given[1], "l", 1, &levels) : NULL;
    int done = 0;
    if (pixels != NULL && (levels > ENTRIES || length > UINT32_MAX)) {
        PyErr_SetString(PyExc_ValueError, "levels of 16 bits are wanted, and pixels whose number has 32");
    } else if (pixels != NULL) {
        uint32_t *tables = scratch(&held, 2 * ENTRIES, sizeof *tables);
        if ((done = tables != NULL))
            count_pixels(counts, length, pixels, levels, tables);
    }
    discard(&held);
    release(&arrays);
    if (!done)
        return NULL;
    Py_RETURN_NONE;
}
