/* A body at rest: convex parts, and how their vertices, faces and edges hang together; see irsim/targets/mesh.py. */
#ifndef IRSIM_FORM_H
#define IRSIM_FORM_H

#include <stdint.h>

#define PY_SSIZE_T_CLEAN
#include <Python.h>

typedef struct {
    double x, y, z;
} Place;

static inline double dot(Place a, Place b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

/* How an edge hangs together with the rest: see `Parts` in irsim/targets/mesh.py. */
typedef struct {
    int64_t tail, head, left, right, part;
} Edge;

/* As `Mesh` in irsim/targets/mesh.py, those of each part side by side: a face's plane is normal . v = offset. */
typedef struct {
    Py_ssize_t parts, faces, vertices_count, edges_count, joints;
    const int64_t *first_vertex, *first_face; /* (parts + 1) */
    const int64_t *corner;                    /* (faces) a vertex of each */
    const Edge *edges;
    const int64_t *heat;  /* (parts) those of one heat shine alike: which of them hides which does not matter */
    const Place *vertices, *normals;
    const double *offsets;
    const double *crossing; /* (parts, faces) how far each part reaches behind each face, as they are at rest */
    const int64_t *joint;   /* (parts) what it moves with: those of one joint lie to each other as at rest */
    double thin;            /* a part that reaches no farther behind a face lies wholly before it */
} Form;

/* form(firsts, corner, edges, heat, vertices, normals, offsets, crossing, thin, joint): a Form, to be kept and given to
 * what draws it. */
PyObject *form(PyObject *self, PyObject *const *given, Py_ssize_t count);

/* The Form that a value is; NULL with an exception where it is none. */
const Form *form_of(PyObject *given);

#endif
