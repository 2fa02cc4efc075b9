#ifndef IRTRACK_VELOCITY_H
#define IRTRACK_VELOCITY_H

#include "arrays.h"

PyObject *velocity_likeness(PyObject *self, PyObject *const *given, Py_ssize_t count);
PyObject *line(PyObject *self, PyObject *const *given, Py_ssize_t count);

#endif
