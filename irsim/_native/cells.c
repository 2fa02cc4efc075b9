/* See irsim/geometry/polygon.py, whose `changes` does the same with arrays. */
#include "cells.h"

#include "wide.h"

/* The lines of the grid that an edge still crosses on one axis, in the order in which it does. */
typedef struct {
    double start, extent; /* of the edge */
    double line, step;
    double place; /* where the edge crosses the line, 0..1 */
    int64_t left;
} Crossings;

static Crossings crossings(double start, double stop, int64_t lines)
{
    double first = greater(floor(lesser(start, stop)) + 1, 0.0);
    double last = lesser(ceil(greater(start, stop)) - 1, (double)lines);
    Crossings found = {.start = start, .extent = stop - start};
    if (!(first <= last)) /* nan, too */
        return found;
    found.left = (int64_t)(last - first) + 1;
    found.line = start < stop ? first : last;
    found.step = start < stop ? 1.0 : -1.0;
    found.place = (found.line - start) / found.extent;
    return found;
}

static double pass(Crossings *crossings)
{
    double place = crossings->place;
    crossings->line += crossings->step;
    crossings->left--;
    crossings->place = (crossings->line - crossings->start) / crossings->extent;
    return place;
}

static double next_cut(Crossings *across, Crossings *down)
{
    if (across->left > 0 && !(down->left > 0 && down->place < across->place))
        return pass(across);
    return pass(down);
}

/* A part of an edge that lies within one cell, by its middle and its extent. */
static int touch(Point middle, double wide, double high, const Piece *piece, const Grid *grid, Touches *touches)
{
    if (!(middle.y >= 0 && middle.y < (double)grid->rows && middle.x < (double)grid->columns))
        return 0;
    /* Left of the grid an edge still bounds all the cells to its right, like an edge on the border. */
    if (middle.x < 0)
        wide = middle.x = 0.0;
    int64_t column = (int64_t)middle.x, row = (int64_t)middle.y;
    if (touches->count == touches->room) {
        Py_ssize_t room = 2 * touches->room + 1024;
        Touch *grown = room > INT32_MAX ? NULL : PyMem_Realloc(touches->of, (size_t)room * sizeof(Touch));
        if (grown == NULL) {
            PyErr_NoMemory();
            return -1;
        }
        touches->of = grown;
        touches->room = room;
    }
    double x = middle.x - (double)column, y = middle.y - ((double)row + 0.5);
    /* Of the cell: what is right of the piece. Of its neighbour: what the cell lacks to a whole one. */
    double area = -high * (1 - x);
    double y_moment = area * y + high * wide * high / 12;
    touches->of[touches->count] = (Touch){
        .row = (int32_t)row,
        .next = touches->last[column],
        .area = area,
        .area_beyond = -high - area,
        .y = y_moment,
        .y_beyond = -high * y - y_moment,
        .x = -high * (0.125 - ((x - 0.5) * (x - 0.5) + wide * wide / 12) / 2),
        .opacity = piece->opacity,
        .glow = piece->glow,
    };
    touches->last[column] = (int32_t)touches->count++;
    return 0;
}

WIDE int touch_cells(const Piece *piece, const Grid *grid, Touches *touches)
{
    Point start = {(piece->start.x - grid->corner.x) * grid->fine, (piece->start.y - grid->corner.y) * grid->fine};
    Point stop = {(piece->stop.x - grid->corner.x) * grid->fine, (piece->stop.y - grid->corner.y) * grid->fine};
    double wide = stop.x - start.x, high = stop.y - start.y;
    Crossings across = crossings(start.x, stop.x, grid->columns), down = crossings(start.y, stop.y, grid->rows);
    int64_t cuts = across.left + down.left;
    double begin = 0.0;
    for (int64_t i = 0; i <= cuts; i++) {
        double end = i < cuts ? next_cut(&across, &down) : 1.0;
        double at = (begin + end) / 2, length = end - begin;
        Point middle = {start.x + wide * at, start.y + high * at};
        if (touch(middle, wide * length, high * length, piece, grid, touches) < 0)
            return -1;
        begin = end;
    }
    return 0;
}
