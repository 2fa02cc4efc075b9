#ifndef IRTRACK_CUES_H
#define IRTRACK_CUES_H

#include "arrays.h"

PyObject *window_gradients(PyObject *self, PyObject *const *given, Py_ssize_t count);
PyObject *window_cues(PyObject *self, PyObject *const *given, Py_ssize_t count);

#endif
