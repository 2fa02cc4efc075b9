/* Part of a sum of periodic fields, which come two by two; see irsim/backgrounds/cloud_evolution.py. */
#include "fused.h"
#include "mixture.h"
#include "plane.h"

#define FIELDS 4
#define BLOCK 256 /* pixels at a time: what is summed of them stays in the nearest cache */

/* Four times two fields side by side, of side x side each. */
typedef struct {
    const float *fields[FIELDS];
    float shares[FIELDS], scales[2];
    Py_ssize_t side;
} Mixture;

/* A stretch of a row within the fields, whose first pixel is their number `place`. They are summed side by side, and
 * only then taken apart. */
INLINED void mix_stretch(const Mixture *of, Py_ssize_t place, Py_ssize_t count, float *restrict ones,
                         float *restrict others, int fused)
{
    const Mixture own = *of;
    float both[2 * BLOCK];
    for (Py_ssize_t from = 0; from < count; from += BLOCK) {
        const Py_ssize_t length = count - from < BLOCK ? count - from : BLOCK, first = 2 * (place + from);
        for (Py_ssize_t i = 0; i < 2 * length; i++) {
            float sum = own.fields[0][first + i] * own.shares[0];
            for (int j = 1; j < FIELDS; j++)
                sum = plus(sum, own.fields[j][first + i], own.shares[j], fused);
            both[i] = sum;
        }
        for (Py_ssize_t i = 0; i < length; i++) {
            ones[from + i] = both[2 * i] * own.scales[0];
            others[from + i] = both[2 * i + 1] * own.scales[1];
        }
    }
}

INLINED void mix(const Mixture *of, Py_ssize_t row, Py_ssize_t column, const Plane *first, const Plane *second,
                 int fused)
{
    const Mixture own = *of;
    for (Py_ssize_t y = 0; y < first->rows; y++) {
        float *restrict ones = first->data + y * first->stride, *restrict others = second->data + y * second->stride;
        Py_ssize_t begin = (row + y) % own.side * own.side + column, x = 0;
        while (x < first->columns) { /* up to where the fields begin anew */
            const Py_ssize_t left = own.side - (column + x) % own.side;
            const Py_ssize_t end = x + left < first->columns ? x + left : first->columns;
            mix_stretch(&own, begin + x, end - x, ones + x, others + x, fused);
            x = end;
            begin -= own.side;
        }
    }
}

FUSING static void mix_fused(const Mixture *of, Py_ssize_t row, Py_ssize_t column, const Plane *first,
                             const Plane *second)
{
    mix(of, row, column, first, second, 1);
}

static void mix_twice(const Mixture *of, Py_ssize_t row, Py_ssize_t column, const Plane *first, const Plane *second)
{
    mix(of, row, column, first, second, 0);
}

/* As many numbers as there are in a tuple; -1 with an exception where it holds something else. */
static int numbers(PyObject *given, float *out, Py_ssize_t count)
{
    if (!PyTuple_Check(given) || PyTuple_Size(given) != count) {
        PyErr_Format(PyExc_TypeError, "a tuple of %zd is wanted", count);
        return -1;
    }
    for (Py_ssize_t i = 0; i < count; i++) {
        out[i] = (float)PyFloat_AsDouble(PyTuple_GetItem(given, i));
        if (PyErr_Occurred())
            return -1;
    }
    return 0;
}

/* mixed(shares, scales, side, row, column, first, second, four fields two by two) */
PyObject *mixed(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    if (count != 7 + FIELDS)
        return PyErr_Format(PyExc_TypeError, "mixed takes %d arguments, not %zd", 7 + FIELDS, count);
    Mixture of;
    if (numbers(given[0], of.shares, FIELDS) < 0 || numbers(given[1], of.scales, 2) < 0)
        return NULL;
    of.side = PyLong_AsSsize_t(given[2]);
    const Py_ssize_t row = PyLong_AsSsize_t(given[3]), column = PyLong_AsSsize_t(given[4]);
    if (PyErr_Occurred())
        return NULL;
    Arrays arrays = {.count = 0};
    Plane first, second;
    int done = plane(&arrays, given[5], 1, &first) == 0 && plane(&arrays, given[6], 1, &second) == 0;
    for (int j = 0; done && j < FIELDS; j++) {
        Py_ssize_t length;
        of.fields[j] = array(&arrays, given[7 + j], "f", 0, &length);
        done = of.fields[j] != NULL;
        if (done && (of.side < 1 || length != 2 * of.side * of.side)) {
            PyErr_SetString(PyExc_ValueError, "two fields of side x side, side by side, are wanted");
            done = 0;
        }
    }
    if (done && (row < 0 || column < 0 || second.rows != first.rows || second.columns != first.columns)) {
        PyErr_SetString(PyExc_ValueError, "two pictures of one size from a row and a column on are wanted");
        done = 0;
    }
    if (done)
        (fuses() ? mix_fused : mix_twice)(&of, row, column % of.side, &first, &second);
    release(&arrays);
    if (!done)
        return NULL;
    Py_RETURN_NONE;
}
