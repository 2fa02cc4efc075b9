/* Unit normals drawn in blocks, each used while it is at hand; see irsim/rng.py for what is drawn. */
#ifndef IRSIM_DRAWING_H
#define IRSIM_DRAWING_H

#include "arguments.h"
#include "sfc64.h"

/* What every function that draws takes first: (seed, table, pieces, deep, refined). */
typedef struct {
    Sfc64 source;
    const int16_t *table;
    const float *pieces;
    const double *deep;
    uint16_t refined;
} Drawing;

#define DRAWING_ARGUMENTS 5

#define NORMAL_UNIT 0x1p-13f /* of the table's words; see irsim/normal.py */

/* Uses `count` normals, words that count NORMAL_UNIT, those of the elements `from` on; `with` is what draw() was given. */
typedef void (*Use)(const int16_t *drawn, Py_ssize_t from, Py_ssize_t count, void *with);

/* Uses the normal of one element. */
typedef void (*Mend)(float drawn, Py_ssize_t place, void *with);

/* The generator that a seed of 32 bytes begins: 0, or -1 with an exception. */
int begin(Arrays *arrays, PyObject *given, Sfc64 *source);

/* Reads the arguments that every function begins with: 0, or -1 with an exception. */
int drawing(Arrays *arrays, PyObject *const *given, Drawing *drawn);

/* Draws `length` normals: None, or NULL with an exception. Those of words in the table's `refined` cells at either end
 * are taken for 0 by `use`, and made up for when all others are drawn, one by one, by `mend`. */
PyObject *draw(const Drawing *drawn, Py_ssize_t length, Use use, Mend mend, void *with);

PyObject *normals(PyObject *self, PyObject *const *given, Py_ssize_t count);

#endif
