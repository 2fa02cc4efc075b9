/* What the inner loops of trackers take besides plain arrays: a picture, indices, numbers. */
#ifndef IRTRACK_ARRAYS_H
#define IRTRACK_ARRAYS_H

#include <stdint.h>

#include "irsim/_native/arguments.h"

/* numpy's letter for intp, which is an int64 wherever this runs. */
#define INTP "l"

/* Grey levels of one or two bytes, row after row; `table` gives the bin of each level. */
typedef struct {
    const void *levels;
    Py_ssize_t rows, columns, bytes;
    const uint16_t *table;
} Picture;

/* Stands for the place of what is not in a picture. */
#define OUTSIDE (-1)

/* Of a picture's or a window's side: products of two do not overflow. */
#define MOST_PIXELS ((Py_ssize_t)1 << 24)

static inline int wrong(const char *what)
{
    PyErr_SetString(PyExc_ValueError, what);
    return 0;
}

/* Takes the argument `image` (rows, columns) of uint8 or uint16; 0 with an exception where it is none. */
static inline int levels(Arrays *arrays, PyObject *image, Picture *taken)
{
    Py_buffer *view = &arrays->of[arrays->count];
    if (PyObject_GetBuffer(image, view, PyBUF_C_CONTIGUOUS | PyBUF_FORMAT) < 0)
        return 0;
    arrays->count++;
    if (view->ndim != 2 || view->format == NULL || (strcmp(view->format, "B") != 0 && strcmp(view->format, "H") != 0))
        return wrong("a picture of uint8 or uint16 is wanted");
    taken->levels = view->buf;
    taken->rows = view->shape[0];
    taken->columns = view->shape[1];
    taken->bytes = view->itemsize;
    return 1;
}

static inline uint16_t level_at(const Picture *picture, Py_ssize_t at)
{
    return picture->bytes == 1 ? ((const uint8_t *)picture->levels)[at] : ((const uint16_t *)picture->levels)[at];
}

/* The same, and `table` of uint16; 0 with an exception where it lacks a level, too. */
static inline int picture(Arrays *arrays, PyObject *image, PyObject *table, Picture *taken)
{
    Py_ssize_t bins;
    if (!levels(arrays, image, taken))
        return 0;
    taken->table = array(arrays, table, "H", 0, &bins);
    if (taken->table == NULL)
        return 0;
    return bins >= (Py_ssize_t)1 << (8 * taken->bytes) || wrong("a bin for each level is wanted");
}

static inline uint16_t bin_at(const Picture *picture, Py_ssize_t row, Py_ssize_t column)
{
    return picture->table[level_at(picture, row * picture->columns + column)];
}

#endif
