#ifndef IRSIM_CLUTTER_H
#define IRSIM_CLUTTER_H

#include "arguments.h"

PyObject *clutter(PyObject *self, PyObject *const *given, Py_ssize_t count);

#endif
