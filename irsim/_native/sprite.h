/* The light of convex polygons that hide each other, in the pixels of a patch; see irsim/geometry/silhouette.py. */
#ifndef IRSIM_SPRITE_H
#define IRSIM_SPRITE_H

#include "spread.h"

/* Integrals of opacity and glow over a field, and their centroids, by Green's theorem; nan where the integral is 0. */
typedef struct {
    double area, light;
    Point center, signal_center;
} Middle;

/* The polygons' light (3, rows + 2 reach, columns + 2 reach) of cover, alpha and emission, on a grid of so many pixels
 * whose outer corner is given. -1 with an exception where layers do not rise or memory runs out. */
int draw_polygons(const Point *start, const Point *stop, const int64_t *layer, Py_ssize_t edges, const double *glow,
                  Py_ssize_t layers, Point corner, Py_ssize_t rows, Py_ssize_t columns, const Spread *by, double *light,
                  Middle *middle);

PyObject *sprite_light(PyObject *self, PyObject *const *given, Py_ssize_t count);

#endif
