#ifndef IRSIM_SPRITE_H
#define IRSIM_SPRITE_H

#include "arguments.h"

PyObject *sprite_light(PyObject *self, PyObject *const *given, Py_ssize_t count);

#endif
