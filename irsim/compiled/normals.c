/* Unit normals by table from 16-bit words; see irsim/rng.py. */
#include <stdint.h>

#include "normals.h"

/* table_normals(words, table, refined, out, outer): out[i] = table[words[i]]; the places of words in the `refined`
 * cells of either end are written to outer (int64); their number is returned. */
PyObject *table_normals(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    Py_ssize_t length, room;
    if (count != 5) {
        PyErr_SetString(PyExc_TypeError, "table_normals takes 5 arguments");
        return NULL;
    }
    const uint16_t *words = array(&arrays, given[0], "H", 0, &length);
    const float *table = words ? array(&arrays, given[1], "f", 0, NULL) : NULL;
    float *out = table ? array(&arrays, given[3], "f", 1, NULL) : NULL;
    int64_t *outer = out ? array(&arrays, given[4], "l", 1, &room) : NULL;
    long refined = outer ? PyLong_AsLong(given[2]) : -1;
    if (outer == NULL || PyErr_Occurred()) {
        release(&arrays);
        return NULL;
    }
    Py_ssize_t found = 0;
    for (Py_ssize_t i = 0; i < length; i++) {
        uint16_t word = words[i];
        out[i] = table[word];
        if ((uint16_t)(word + refined) < 2 * refined && found < room)
            outer[found++] = i;
    }
    release(&arrays);
    return PyLong_FromSsize_t(found);
}
