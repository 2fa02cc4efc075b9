#ifndef IRSIM_OUTLINE_H
#define IRSIM_OUTLINE_H

#include "arguments.h"

PyObject *outline(PyObject *self, PyObject *const *given, Py_ssize_t count);

#endif
