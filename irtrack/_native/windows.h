#ifndef IRTRACK_WINDOWS_H
#define IRTRACK_WINDOWS_H

#include "arrays.h"

PyObject *distinct_windows(PyObject *self, PyObject *const *given, Py_ssize_t count);
PyObject *window_masses(PyObject *self, PyObject *const *given, Py_ssize_t count);
PyObject *surround_histograms(PyObject *self, PyObject *const *given, Py_ssize_t count);

#endif
