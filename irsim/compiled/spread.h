/* What changes in the cells of a grid, blurred and binned to pixels. */
#ifndef IRSIM_SPREAD_H
#define IRSIM_SPREAD_H

#include "cells.h"

/* How cells along one axis spread over pixels, of each of several terms: see `Bands` in irsim/shapes/silhouette.py.
 * Of each cell, `width` pixels from `first` on: what light that fills it evenly puts there, and what a first moment
 * does. */
typedef struct {
    const int64_t *first; /* (cells) */
    const double *shares; /* (terms, 2, cells, width) */
    Py_ssize_t cells, width, pixels;
} Bands;

/* Light (3, pixel rows, pixel columns) of cover, alpha and emission, from what is touched; `fine` cells to a pixel,
 * `margin` pixels around the grid; weights (terms). -1 with an exception where memory runs out. */
int spread_touches(const Touches *touches, const Bands *rows, const Bands *columns, const double *weights,
                   Py_ssize_t terms, int64_t fine, int64_t margin, double *light);

#endif
