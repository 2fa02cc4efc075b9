/* How many pixels have each count; see irsim/display/stretch.py. */
#include <stdint.h>

#include "histogram.h"
#include "scratch.h"

#define TABLES 4 /* neighbours are often alike: a pixel need not wait until the one before is counted */

/* `tables` is (TABLES, levels + 1) of zeros: the last of each takes what lies beyond. */
static void count_pixels(const uint16_t *counts, Py_ssize_t length, int64_t *pixels, Py_ssize_t levels,
                         uint32_t *tables)
{
    const Py_ssize_t wide = levels + 1;
    const unsigned beyond = (unsigned)levels;
    Py_ssize_t i = 0;
    for (; i + TABLES <= length; i += TABLES)
        for (int k = 0; k < TABLES; k++)
            tables[k * wide + (counts[i + k] < beyond ? counts[i + k] : beyond)]++;
    for (; i < length; i++)
        tables[counts[i] < beyond ? counts[i] : beyond]++;
    for (Py_ssize_t level = 0; level < levels; level++) {
        int64_t sum = 0;
        for (int k = 0; k < TABLES; k++)
            sum += tables[k * wide + level];
        pixels[level] = sum;
    }
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
    if (pixels != NULL && (levels > UINT16_MAX + 1 || length > UINT32_MAX)) {
        PyErr_SetString(PyExc_ValueError, "levels of 16 bits are wanted, and pixels whose number has 32");
    } else if (pixels != NULL) {
        uint32_t *tables = scratch(&held, TABLES * (levels + 1), sizeof *tables);
        if ((done = tables != NULL))
            count_pixels(counts, length, pixels, levels, tables);
    }
    discard(&held);
    release(&arrays);
    if (!done)
        return NULL;
    Py_RETURN_NONE;
}
