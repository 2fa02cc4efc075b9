/* Convex polygons that hide each other: the pieces of their edges that can be seen. */
#ifndef IRSIM_VISIBLE_H
#define IRSIM_VISIBLE_H

#include <stdint.h>

#include "points.h"
#include "scratch.h"

/* A piece of an edge, and what opacity and glow gain across it. */
typedef struct {
    Point start, stop;
    double opacity, glow;
    int64_t layer;
} Piece;

typedef struct {
    Piece *of;
    Py_ssize_t count, room;
} Pieces;

/* Edges start -> stop (count of them), clockwise with y down, one convex polygon a layer; layers rise from 0, which
 * is the nearest, to below `layers`. -1 with an exception where that is not so or memory runs out. The caller frees
 * pieces->of in either case. */
int visible_pieces(const Point *start, const Point *stop, const int64_t *layer, Py_ssize_t count, const double *glow,
                   Py_ssize_t layers, Pieces *pieces);

#endif
