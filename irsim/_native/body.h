/* A body as it is seen: from its form and its pose to its light in one call. */
#ifndef IRSIM_BODY_H
#define IRSIM_BODY_H

#define PY_SSIZE_T_CLEAN
#include <Python.h>

PyObject *body_light(PyObject *self, PyObject *const *given, Py_ssize_t count);

#endif
