#ifndef IRTRACK_MEAN_SHIFT_H
#define IRTRACK_MEAN_SHIFT_H

#include "arrays.h"

PyObject *mean_shift(PyObject *self, PyObject *const *given, Py_ssize_t count);

#endif
