/* How many pixels have each count; see irsim/camera/agc.py. */
#include <stdint.h>

#include "histogram.h"
#include "scratch.h"

#define WORDS (UINT16_MAX + 1)

/* `tables` are two, of a place for each 16-bit word, of zeros: neighbours are often alike, and a pixel need not wait
   until the one before it is counted. */
static void count_pixels(const uint16_t *counts, Py_ssize_t length, int64_t *pixels, Py_ssize_t levels,
                         uint32_t *tables)
{
    uint32_t *const even = tables, *const odd = tables + WORDS;
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
    if (pixels != NULL && (levels > WORDS || length > UINT32_MAX)) {
        PyErr_SetString(PyExc_ValueError, "levels of 16 bits are wanted, and pixels whose number has 32");
    } else if (pixels != NULL) {
        uint32_t *tables = scratch(&held, 2 * WORDS, sizeof *tables);
        if ((done = tables != NULL))
            count_pixels(counts, length, pixels, levels, tables);
    }
    discard(&held);
    release(&arrays);
    if (!done)
        return NULL;
    Py_RETURN_NONE;
}
