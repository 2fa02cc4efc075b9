#ifndef IRSIM_VEIL_H
#define IRSIM_VEIL_H

#include "arguments.h"

PyObject *moved(PyObject *self, PyObject *const *given, Py_ssize_t count);
PyObject *veil(PyObject *self, PyObject *const *given, Py_ssize_t count);

#endif
