/* Unit normals drawn in blocks, each used while it is at hand; see irsim/rng.py for what is drawn. */
#ifndef IRSIM_DRAWING_H
#define IRSIM_DRAWING_H

#include "arguments.h"
#include "sfc64.h"

/* What every function that draws takes first: (seed, table, refined). */
typedef struct {
    Sfc64 source;
    const float *table;
    uint16_t refined;
} Drawing;

#define DRAWING_ARGUMENTS 3

/* Uses `count` normals, those of the elements `from` on; `with` is what draw() was given. */
typedef void (*Use)(const float *drawn, Py_ssize_t from, Py_ssize_t count, void *with);

/* Reads the arguments that every function begins with: 0, or -1 with an exception. */
int drawing(Arrays *arrays, PyObject *const *given, Drawing *drawn);

/* Draws `length` normals. Those of words in the table's `refined` cells at either end are 0; they are returned for the
 * caller to make up for: as bytes of (place, word + refined, further word), 64 bits each. */
PyObject *draw(Drawing *drawn, Py_ssize_t length, Use use, void *with);

PyObject *normals(PyObject *self, PyObject *const *given, Py_ssize_t count);

#endif
