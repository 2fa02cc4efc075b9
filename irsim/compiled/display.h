#ifndef IRSIM_DISPLAY_H
#define IRSIM_DISPLAY_H

#include "arguments.h"

PyObject *histogram(PyObject *self, PyObject *const *given, Py_ssize_t count);
PyObject *shown(PyObject *self, PyObject *const *given, Py_ssize_t count);

#endif
