#ifndef IRSIM_LOOKUP_H
#define IRSIM_LOOKUP_H

#include "arguments.h"

PyObject *lookup(PyObject *self, PyObject *const *given, Py_ssize_t count);

#endif
