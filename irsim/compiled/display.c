/* What an AGC does with every pixel: it counts them, and shows them by a table; see irsim/display/stretch.py and
 * base.py. */
#include <stdint.h>

#include "display.h"
#include "scratch.h"

#define GREYS (UINT16_MAX + 1)
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

static void show(const uint8_t *restrict greys, const uint16_t *restrict counts, uint8_t *restrict picture,
                 Py_ssize_t length)
{
    Py_ssize_t i = 0;
    for (; i + 4 <= length; i += 4) { /* a third faster than one by one */
        picture[i] = greys[counts[i]];
        picture[i + 1] = greys[counts[i + 1]];
        picture[i + 2] = greys[counts[i + 2]];
        picture[i + 3] = greys[counts[i + 3]];
    }
    for (; i < length; i++)
        picture[i] = greys[counts[i]];
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

/* shown(greys, counts, picture) */
PyObject *shown(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    if (count != 3)
        return PyErr_Format(PyExc_TypeError, "shown takes 3 arguments, not %zd", count);
    Arrays arrays = {.count = 0};
    Py_ssize_t levels, length, wanted;
    const uint8_t *greys = array(&arrays, given[0], "B", 0, &levels);
    const uint16_t *counts = greys ? array(&arrays, given[1], "H", 0, &length) : NULL;
    uint8_t *picture = counts ? array(&arrays, given[2], "B", 1, &wanted) : NULL;
    int done = picture != NULL && levels == GREYS && wanted == length;
    if (done)
        show(greys, counts, picture, length);
    else if (picture != NULL)
        PyErr_Format(PyExc_ValueError, "%d greys are wanted, and a pixel for each count", GREYS);
    release(&arrays);
    if (!done)
        return NULL;
    Py_RETURN_NONE;
}
