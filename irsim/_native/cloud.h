#ifndef IRSIM_CLOUD_H
#define IRSIM_CLOUD_H

#include "arguments.h"

PyObject *cloud(PyObject *self, PyObject *const *given, Py_ssize_t count);

#endif
