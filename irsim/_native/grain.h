#ifndef IRSIM_GRAIN_H
#define IRSIM_GRAIN_H

#include "arguments.h"

PyObject *add_normals(PyObject *self, PyObject *const *given, Py_ssize_t count);
PyObject *add_shot(PyObject *self, PyObject *const *given, Py_ssize_t count);
PyObject *bridge(PyObject *self, PyObject *const *given, Py_ssize_t count);

#endif
