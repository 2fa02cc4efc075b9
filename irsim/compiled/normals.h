#ifndef IRSIM_NORMALS_H
#define IRSIM_NORMALS_H

#include "arguments.h"

PyObject *table_normals(PyObject *self, PyObject *const *given, Py_ssize_t count);

#endif
