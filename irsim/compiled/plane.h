/* Pictures given to a compiled function: float32, whose rows may lie apart, as those of a window do. */
#ifndef IRSIM_PLANE_H
#define IRSIM_PLANE_H

#include "arguments.h"

typedef struct {
    float *data;
    Py_ssize_t rows, columns, stride; /* from row to row, in elements */
} Plane;

/* 0, or -1 with an exception where it is none. */
static inline int plane(Arrays *arrays, PyObject *given, int writable, Plane *out)
{
    Py_buffer *view = &arrays->of[arrays->count];
    if (PyObject_GetBuffer(given, view, PyBUF_STRIDES | PyBUF_FORMAT | (writable ? PyBUF_WRITABLE : 0)) < 0)
        return -1;
    arrays->count++;
    const Py_ssize_t step = sizeof *out->data;
    if (view->format == NULL || strcmp(view->format, "f") != 0 || view->ndim != 2 || view->strides[0] % step != 0 ||
        (view->strides[1] != step && view->shape[1] > 1)) {
        PyErr_SetString(PyExc_TypeError, "rows of float32 are wanted");
        return -1;
    }
    *out = (Plane){view->buf, view->shape[0], view->shape[1], view->strides[0] / step};
    return 0;
}

#endif
