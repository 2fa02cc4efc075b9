/* Numbers spread evenly; see irsim/rng.py. */
#ifndef IRSIM_UNIFORMS_H
#define IRSIM_UNIFORMS_H

#include "arguments.h"

PyObject *uniforms(PyObject *self, PyObject *const *given, Py_ssize_t count);

#endif
