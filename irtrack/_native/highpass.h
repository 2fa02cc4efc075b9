#ifndef IRTRACK_HIGHPASS_H
#define IRTRACK_HIGHPASS_H

#include "arrays.h"

PyObject *high_pass(PyObject *self, PyObject *const *given, Py_ssize_t count);

#endif
