/* What changes in the cells of a grid, blurred and binned to pixels. */
#ifndef IRSIM_SPREAD_H
#define IRSIM_SPREAD_H

#include "cells.h"

#define MOST_FINE 4

/* How the cells of a pixel, `fine` a side, spread over it and `reach` pixels on either side of it, on each axis, of each
 * of several terms: see `PSF.separable_kernels` in irsim/physics/psf.py. Of each place of a cell, what light that fills
 * it evenly puts there, and what a first moment does; places first .. beyond - 1 are all that it lights. */
typedef struct {
    Py_ssize_t terms, fine, reach, stride;
    const double *weights; /* (terms) */
    const double *shares;  /* (terms, 2, fine, stride) of 2 reach + 1 pixels, the rest 0 */
    Py_ssize_t first[MOST_FINE], beyond[MOST_FINE];
} Spread;

/* spread(weights, shares, fine): a Spread, to be kept and given to what draws. */
PyObject *spread(PyObject *self, PyObject *const *given, Py_ssize_t count);

/* The Spread that a value is; NULL with an exception where it is none. */
const Spread *spread_of(PyObject *given);

/* The light (3, rows + 2 reach, columns + 2 reach) of cover, alpha and emission, from what is touched of a grid of so
 * many pixels. -1 with an exception where memory runs out. */
int spread_touches(const Touches *touches, const Spread *by, Py_ssize_t rows, Py_ssize_t columns, double *light);

#endif
