#ifndef IRSIM_LAYING_H
#define IRSIM_LAYING_H

#include "arguments.h"

PyObject *lay(PyObject *self, PyObject *const *given, Py_ssize_t count);

#endif
