/* Several convex polyhedra as they lie, and which of them hides which. */
#ifndef IRSIM_HIDING_H
#define IRSIM_HIDING_H

#include <stdint.h>

#include "points.h"
#include "scratch.h"

typedef struct {
    double x, y, z;
} Place;

static inline double dot(Place a, Place b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

/* As `Mesh` in irsim/shapes/mesh.py, those of each part side by side: a face's plane is normal . v = offset. */
typedef struct {
    Py_ssize_t parts, faces;
    const int64_t *first_vertex, *first_face; /* (parts + 1) */
    const Place *vertices, *normals;
    const double *offsets;
    const double *crossing; /* (parts, faces) how far each part reaches behind each face, as they are at rest */
    const int64_t *heat;    /* (parts) those of one heat shine alike: which of them hides which does not matter */
    const int64_t *joint;   /* (parts) what it moves with: those of one joint lie to each other as at rest */
    double thin;            /* a part that reaches no farther behind a face lies wholly before it */
} Form;

/* rank (parts) of each part as seen from an eye whose side faces are `to_eye` of, the parts filling boxes in the
 * picture. -1 with an exception where memory runs out. */
int hiding_order(const Form *form, const char *to_eye, const Extent *boxes, int64_t *rank);

#endif
