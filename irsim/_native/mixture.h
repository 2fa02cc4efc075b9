#ifndef IRSIM_MIXTURE_H
#define IRSIM_MIXTURE_H

#include "arguments.h"

PyObject *mixed(PyObject *self, PyObject *const *given, Py_ssize_t count);

#endif
