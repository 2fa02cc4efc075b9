#ifndef IRTRACK_LIKENESS_H
#define IRTRACK_LIKENESS_H

#include "arrays.h"

PyObject *bhattacharyya(PyObject *self, PyObject *const *given, Py_ssize_t count);
PyObject *below_best(PyObject *self, PyObject *const *given, Py_ssize_t count);
PyObject *weighted(PyObject *self, PyObject *const *given, Py_ssize_t count);

#endif
