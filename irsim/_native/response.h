#ifndef IRSIM_RESPONSE_H
#define IRSIM_RESPONSE_H

#include "arguments.h"

#define MOST_ADDED 8 /* pictures that counts_of adds to a signal */

PyObject *signal_of(PyObject *self, PyObject *const *given, Py_ssize_t count);
PyObject *counts_of(PyObject *self, PyObject *const *given, Py_ssize_t count);

#endif
