#include "uniforms.h"

#include "drawing.h"

/* uniforms(seed, out) */
PyObject *uniforms(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    Sfc64 source;
    Py_ssize_t length;
    PyObject *done = NULL;
    if (count != 2) {
        PyErr_SetString(PyExc_TypeError, "uniforms takes 2 arguments");
        return NULL;
    }
    if (begin(&arrays, given[0], &source) == 0) {
        double *out = array(&arrays, given[1], "d", 1, &length);
        if (out != NULL) {
            for (Py_ssize_t i = 0; i < length; i++)
                out[i] = (double)(next_word(&source) >> 11) * 0x1p-53; /* as numpy makes them */
            done = Py_NewRef(Py_None);
        }
    }
    release(&arrays);
    return done;
}
