#ifndef IRTRACK_PARTICLES_H
#define IRTRACK_PARTICLES_H

#include "arrays.h"

PyObject *sorted_uniforms(PyObject *self, PyObject *const *given, Py_ssize_t count);
PyObject *pick(PyObject *self, PyObject *const *given, Py_ssize_t count);
PyObject *ar2_drawn(PyObject *self, PyObject *const *given, Py_ssize_t count);

#endif
