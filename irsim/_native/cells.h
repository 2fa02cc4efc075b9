/* What pieces of outlines change in the cells of a grid that they run through. */
#ifndef IRSIM_CELLS_H
#define IRSIM_CELLS_H

#include <stdint.h>

#include "visible.h"

/* Cells of 1 / fine px, rows x columns of them, from their outer corner on. */
typedef struct {
    Point corner;
    double fine;
    int64_t rows, columns;
} Grid;

/* A cell that a piece runs through: what its area and y moment, and those of its right neighbour, change by from the
 * cell before, and its own x moment; for one unit of what the piece's weights say. */
typedef struct {
    int32_t row, next; /* next: the number of another touch in its column, -1 where there is none */
    double area, area_beyond, y, y_beyond, x;
    double opacity, glow;
} Touch;

typedef struct {
    Touch *of;
    Py_ssize_t count, room;
    int32_t *last; /* (columns) the last touch in each column, -1 where there is none */
} Touches;

/* -1 with an exception where memory runs out. The caller frees touches->of in either case. */
int touch_cells(const Piece *piece, const Grid *grid, Touches *touches);

#endif
