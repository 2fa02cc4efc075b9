/* Bodies of convex parts: tables, outlines, visible pieces of edges, and their light in pixels. */
#ifndef IRSIM_BODY_H
#define IRSIM_BODY_H

#include "kernels.h"

typedef struct {
    double x, y;
} Point;

typedef struct {
    Point low, high;
} Extent;

static const Extent NOTHING = {{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};

static inline double lesser(double a, double b)
{
    return a < b ? a : b;
}

static inline double greater(double a, double b)
{
    return a > b ? a : b;
}

static inline Extent with_point(Extent held, Point point)
{
    Extent wider = {{lesser(held.low.x, point.x), lesser(held.low.y, point.y)},
                    {greater(held.high.x, point.x), greater(held.high.y, point.y)}};
    return wider;
}

static inline int meet(const Extent *a, const Extent *b)
{
    return (a->low.x <= b->high.x) & (b->low.x <= a->high.x) & (a->low.y <= b->high.y) & (b->low.y <= a->high.y);
}

typedef struct {
    double x, y, z;
} Place;

static inline double dot(Place a, Place b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

/* Vertices, faces and part of an edge: see `Parts` in irsim/targets/mesh.py. */
typedef struct {
    int64_t tail, head, left, right, part;
} Edge;

/* As `Mesh` in irsim/targets/mesh.py, part after part: a face's plane is normal . v = offset. */
typedef struct {
    Py_ssize_t parts, faces, vertices_count, edges_count, joints;
    const int64_t *first_vertex, *first_face; /* (parts + 1) */
    const int64_t *corner;                    /* (faces) a vertex of each */
    const Edge *edges;
    const int64_t *heat;  /* (parts) parts of one heat shine alike: their order does not matter */
    const Place *vertices, *normals;
    const double *offsets;
    const double *crossing; /* (parts, faces) reach of each part behind each face, at rest */
    const int64_t *joint;   /* (parts) parts of one joint keep their relative position */
    double thin;            /* largest reach behind a face of a part that counts as before it */
} Form;

/* Motion and view of a body. */
typedef struct {
    const double *motions; /* (joints, 12) turn (3, 3) and shift of each */
    double scale;          /* of shifts */
    Place position;
    const double *attitude; /* (3, 3) */
    double ifov;
} Pose;

/* Outline edges of parts, px from the body's place in the picture; layer after layer, the nearest first. */
typedef struct {
    Point *start, *stop;
    int64_t *layer;
    Py_ssize_t count;
    int64_t *rank; /* (parts) the layer of each */
    Extent box;    /* around all of it */
} Rims;

/* A piece of an edge, and the change of opacity and glow across it. */
typedef struct {
    Point start, stop;
    double opacity, glow;
    int64_t layer;
} Piece;

typedef struct {
    Piece *of;
    Py_ssize_t count, room;
} Pieces;

/* Edges start -> stop, clockwise with y down, one convex polygon a layer; layers rise from 0, the nearest, to below
 * `layers`. -1 with an exception where they do not, or without memory. The caller frees pieces->of in either case. */
int visible_pieces(const Point *start, const Point *stop, const int64_t *layer, Py_ssize_t count, const double *glow,
                   Py_ssize_t layers, Pieces *pieces);

#define MOST_FINE 4

/* Spread of the cells of a pixel, `fine` a side, over it and `reach` pixels on either side, on each axis, by several
 * terms: see `PSF.separable_kernels` in irsim/physics/psf.py. For each place of a cell, the shares of even light and of a
 * first moment; it lights places first .. beyond - 1. */
typedef struct {
    Py_ssize_t terms, fine, reach, stride;
    const double *weights; /* (terms) */
    const double *shares;  /* (terms, 2, fine, stride) of 2 reach + 1 pixels, the rest 0 */
    Py_ssize_t first[MOST_FINE], beyond[MOST_FINE];
} Spread;

/* The Spread in a capsule; NULL with an exception. */
const Spread *spread_of(PyObject *given);

/* Integrals of opacity and glow over a field, and their centroids, by Green's theorem; nan where the integral is 0. */
typedef struct {
    double area, light;
    Point center, signal_center;
} Middle;

/* The polygons' light (3, rows + 2 reach, columns + 2 reach) of cover, alpha and emission, on rows x columns pixels from
 * an outer corner. -1 with an exception as `visible_pieces`. */
int draw_polygons(const Point *start, const Point *stop, const int64_t *layer, Py_ssize_t edges, const double *glow,
                  Py_ssize_t layers, Point corner, Py_ssize_t rows, Py_ssize_t columns, const Spread *by, double *light,
                  Middle *middle);

#endif
