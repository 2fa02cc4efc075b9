#ifndef IRSIM_HISTOGRAM_H
#define IRSIM_HISTOGRAM_H

#include "arguments.h"

PyObject *histogram(PyObject *self, PyObject *const *given, Py_ssize_t count);

#endif
