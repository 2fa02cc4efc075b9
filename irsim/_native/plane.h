/* Pictures given to a compiled function: float32 or int16, whose rows may lie apart, as those of a window do. */
#ifndef IRSIM_PLANE_H
#define IRSIM_PLANE_H

#include <stdint.h>

#include "arguments.h"

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

#endif
