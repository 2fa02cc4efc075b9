/* The outlines of a body's parts in the picture, by layers; see irsim/shapes/rims.py. */
#include "outline.h"

#include "hiding.h"

/* How an edge hangs together with the rest: see `Parts` in irsim/shapes/mesh.py. */
typedef struct {
    int64_t tail, head, left, right, part;
} Edge;

/* A body at rest, and how it is moved and seen: what `outline` is given. */
typedef struct {
    Form form;
    Py_ssize_t vertices, edges, joints;
    const int64_t *corner;
    const Edge *edge;
    const double *motions;         /* (joints, 12) turn (3, 3) and shift of each */
    double scale;                  /* of shifts */
    const double *attitude;        /* (3, 3) */
    const Place *position;
    Point middle; /* of the body, px */
    double ifov;
    const double *shine; /* (parts) light of each, times the brightness */
    double brightness;
} Body;

static Place turned(const double *turn, Place place)
{
    return (Place){
        turn[0] * place.x + turn[1] * place.y + turn[2] * place.z,
        turn[3] * place.x + turn[4] * place.y + turn[5] * place.z,
        turn[6] * place.x + turn[7] * place.y + turn[8] * place.z,
    };
}

/* Vertices, normals and offsets of a body's parts, those on joints moved. */
static int pose(Body *body, Scratch *held)
{
    Form *form = &body->form;
    Place *vertices = scratch(held, body->vertices, sizeof(Place));
    Place *normals = vertices ? scratch(held, form->faces, sizeof(Place)) : NULL;
    double *offsets = normals ? scratch(held, form->faces, sizeof(double)) : NULL;
    if (offsets == NULL)
        return -1;
    memcpy(vertices, form->vertices, (size_t)body->vertices * sizeof(Place));
    memcpy(normals, form->normals, (size_t)form->faces * sizeof(Place));
    memcpy(offsets, form->offsets, (size_t)form->faces * sizeof(double));
    for (Py_ssize_t part = 0; part < form->parts; part++) {
        if (form->joint[part] < 0)
            continue;
        const double *turn = body->motions + 12 * form->joint[part], *shift = turn + 9;
        for (int64_t i = form->first_vertex[part]; i < form->first_vertex[part + 1]; i++) {
            Place place = turned(turn, vertices[i]);
            vertices[i] = (Place){place.x + shift[0] * body->scale, place.y + shift[1] * body->scale,
                                  place.z + shift[2] * body->scale};
        }
        for (int64_t face = form->first_face[part]; face < form->first_face[part + 1]; face++) {
            normals[face] = turned(turn, normals[face]);
            offsets[face] = dot(normals[face], vertices[body->corner[face]]);
        }
    }
    form->vertices = vertices;
    form->normals = normals;
    form->offsets = offsets;
    return 0;
}

/* Where vertices are in the picture, px from the body's middle, and the boxes of parts; 0 where one is behind the
 * camera. As differences, which lose no digits: the edges of a small body, far from the picture's corner, keep
 * theirs. */
static int project(const Body *body, Point *pixels, Extent *boxes, Extent *box)
{
    const Form *form = &body->form;
    Place middle = *body->position;
    *box = NOTHING;
    if (middle.z <= 0)
        return 0;
    for (Py_ssize_t part = 0; part < form->parts; part++) {
        boxes[part] = NOTHING;
        for (int64_t i = form->first_vertex[part]; i < form->first_vertex[part + 1]; i++) {
            Place place = turned(body->attitude, form->vertices[i]);
            double depth = place.z + middle.z;
            if (depth <= 0)
                return 0;
            double scale = 1 / (depth * body->ifov), across = middle.x / middle.z, down = middle.y / middle.z;
            pixels[i] = (Point){(place.x - across * place.z) * scale, (place.y - down * place.z) * scale};
            boxes[part] = with_point(boxes[part], pixels[i]);
        }
        *box = with_point(with_point(*box, boxes[part].low), boxes[part].high);
    }
    return 1;
}

static void look(const Body *body, char *to_eye)
{
    const double *a = body->attitude;
    Place p = *body->position;
    Place eye = {-p.x * a[0] + -p.y * a[3] + -p.z * a[6], -p.x * a[1] + -p.y * a[4] + -p.z * a[7],
                 -p.x * a[2] + -p.y * a[5] + -p.z * a[8]};
    for (Py_ssize_t face = 0; face < body->form.faces; face++)
        to_eye[face] = dot(body->form.normals[face], eye) > body->form.offsets[face];
}

/* The edges on the rims of parts, those of each layer together; their number. */
static Py_ssize_t sort_rims(const Body *body, const char *to_eye, const Point *pixels, const int64_t *rank,
                            Py_ssize_t *next, Point *start, Point *stop, int64_t *layer)
{
    for (Py_ssize_t i = 0; i < body->edges; i++)
        if (to_eye[body->edge[i].left] != to_eye[body->edge[i].right])
            next[rank[body->edge[i].part]]++;
    Py_ssize_t count = 0;
    for (Py_ssize_t i = 0; i < body->form.parts; i++) {
        Py_ssize_t begin = count;
        count += next[i];
        next[i] = begin;
    }
    for (Py_ssize_t i = 0; i < body->edges; i++) {
        const Edge *edge = &body->edge[i];
        int left = to_eye[edge->left];
        if (left == to_eye[edge->right])
            continue;
        /* A face seen from outside runs clockwise in x right, y down where its edges are read backwards. */
        Py_ssize_t place = next[rank[edge->part]]++;
        start[place] = pixels[left ? edge->head : edge->tail];
        stop[place] = pixels[left ? edge->tail : edge->head];
        layer[place] = rank[edge->part];
    }
    return count;
}

static int rises(const int64_t *first, Py_ssize_t parts, Py_ssize_t end)
{
    for (Py_ssize_t i = 0; i < parts; i++)
        if (first[i] >= first[i + 1])
            return 0;
    return first[0] == 0 && first[parts] == end;
}

static int within(int64_t number, Py_ssize_t end)
{
    return 0 <= number && number < end;
}

/* Do all numbers in the tables mean something? */
static int holds_together(const Body *body)
{
    const Form *form = &body->form;
    int holds = rises(form->first_vertex, form->parts, body->vertices) &&
                rises(form->first_face, form->parts, form->faces);
    for (Py_ssize_t i = 0; i < form->faces; i++)
        holds &= within(body->corner[i], body->vertices);
    for (Py_ssize_t i = 0; i < body->edges; i++) {
        const Edge *edge = &body->edge[i];
        holds &= within(edge->tail, body->vertices) && within(edge->head, body->vertices);
        holds &= within(edge->left, form->faces) && within(edge->right, form->faces) && within(edge->part, form->parts);
    }
    for (Py_ssize_t i = 0; i < form->parts; i++)
        holds &= form->joint[i] < body->joints;
    return holds;
}

/* The parts' light, in layers. */
static void shine(const Body *body, const int64_t *rank, double *glow)
{
    for (Py_ssize_t part = 0; part < body->form.parts; part++)
        glow[rank[part]] = body->shine[part] * body->brightness;
}

static PyObject *outlined(Body *body, Point *ends, int64_t *layer, double *glow)
{
    Scratch held = {.count = 0};
    PyObject *result = NULL;
    Py_ssize_t parts = body->form.parts;
    Point *pixels = scratch(&held, body->vertices, sizeof(Point));
    Extent *boxes = pixels ? scratch(&held, parts, sizeof(Extent)) : NULL;
    char *to_eye = boxes ? scratch(&held, body->form.faces, 1) : NULL;
    int64_t *rank = to_eye ? scratch(&held, parts, sizeof(int64_t)) : NULL;
    Py_ssize_t *next = rank ? scratch(&held, parts, sizeof(Py_ssize_t)) : NULL;
    if (next && (body->joints == 0 || pose(body, &held) == 0)) {
        Extent box;
        if (!project(body, pixels, boxes, &box)) {
            result = Py_None;
            Py_INCREF(result);
        } else {
            look(body, to_eye);
            if (hiding_order(&body->form, to_eye, boxes, rank) == 0) {
                Py_ssize_t count = sort_rims(body, to_eye, pixels, rank, next, ends, ends + body->edges, layer);
                Point middle = body->middle;
                shine(body, rank, glow);
                result = Py_BuildValue("(ndddd)", count, middle.x + box.low.x, middle.y + box.low.y,
                                       middle.x + box.high.x, middle.y + box.high.y);
            }
        }
    }
    discard(&held);
    return result;
}

#define ARGUMENTS 22
#define OUT 19 /* the first that is written to */

/* outline(firsts, corner, edges, heat, vertices, normals, offsets, crossing, thin, joint, motions, scale, attitude,
 * position, x, y, ifov, shine, brightness, ends, layer, glow): x, y is where the position lies in the picture. ends
 * (2, edges, 2) takes starts and stops of edges on rims, from there, layer theirs, glow (parts) the light of each layer.
 * Returned are their number and left, top, right and bottom of the body, px; None where it is behind the camera. */
PyObject *outline(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    if (count != ARGUMENTS) {
        PyErr_SetString(PyExc_TypeError, "outline takes 22 arguments");
        return NULL;
    }
    static const char *const formats[ARGUMENTS] = {"l", "l", "l", "l", "d", "d", "d", "d", NULL, "l", "d",
                                          NULL, "d", "d", NULL, NULL, NULL, "d", NULL, "d", "l", "d"};
    Arrays arrays = {.count = 0};
    PyObject *result = NULL;
    void *data[ARGUMENTS];
    Py_ssize_t length[ARGUMENTS];
    double number[ARGUMENTS];
    for (int i = 0; i < ARGUMENTS; i++) {
        if (formats[i])
            data[i] = array(&arrays, given[i], formats[i], i >= OUT, &length[i]);
        else
            number[i] = PyFloat_AsDouble(given[i]);
        if (formats[i] ? data[i] == NULL : PyErr_Occurred() != NULL)
            goto done;
    }
    Py_ssize_t parts = length[9], faces = length[6], edges = length[2] / 5, joints = length[10] / 12;
    Body body = {
        .form = {parts, faces, data[0], (int64_t *)data[0] + parts + 1, data[4], data[5], data[6], data[7], data[3],
                 data[9], number[8]},
        .vertices = length[4] / 3,
        .edges = edges,
        .joints = joints,
        .corner = data[1],
        .edge = data[2],
        .motions = data[10],
        .scale = number[11],
        .attitude = data[12],
        .position = data[13],
        .middle = {number[14], number[15]},
        .ifov = number[16],
        .shine = data[17],
        .brightness = number[18],
    };
    const Py_ssize_t wanted[ARGUMENTS] = {2 * (parts + 1), faces, 5 * edges, parts, 3 * body.vertices, 3 * faces, faces,
                                   parts * faces, 0, parts, 12 * joints, 0, 9, 3, 0, 0, 0,
                                   parts, 0, 4 * edges, edges, parts};
    int fits = parts > 0;
    for (int i = 0; i < ARGUMENTS; i++)
        fits &= formats[i] == NULL || length[i] == wanted[i];
    if (fits && holds_together(&body))
        result = outlined(&body, data[OUT], data[OUT + 1], data[OUT + 2]);
    else
        PyErr_SetString(PyExc_ValueError, "outline: its arrays do not agree");
done:
    release(&arrays);
    return result;
}
