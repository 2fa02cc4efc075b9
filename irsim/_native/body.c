/* A body's tables, the order in which its parts hide each other, its outlines and its light; plain twins:
 * irsim/targets/polyhedra.py, irsim/targets/visibility.py and irsim/geometry/silhouette.py. */
#include "body.h"

static const char NAME[] = "irsim.form";

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
static int holds_together(const Form *form)
{
    int holds = rises(form->first_vertex, form->parts, form->vertices_count) &&
                rises(form->first_face, form->parts, form->faces);
    for (Py_ssize_t i = 0; i < form->faces; i++)
        holds &= within(form->corner[i], form->vertices_count);
    for (Py_ssize_t i = 0; i < form->edges_count; i++) {
        const Edge *edge = &form->edges[i];
        holds &= within(edge->tail, form->vertices_count) && within(edge->head, form->vertices_count);
        holds &= within(edge->left, form->faces) && within(edge->right, form->faces) && within(edge->part, form->parts);
    }
    return holds;
}

/* How many joints its parts name. */
static Py_ssize_t joints_of(const int64_t *joint, Py_ssize_t parts)
{
    int64_t most = -1;
    for (Py_ssize_t i = 0; i < parts; i++)
        most = joint[i] > most ? joint[i] : most;
    return (Py_ssize_t)most + 1;
}

#define ARGUMENTS 10
#define THIN 8 /* the one that is a number */

static void let_go(PyObject *capsule)
{
    PyMem_Free(PyCapsule_GetPointer(capsule, NAME));
}

/* A copy of them all, behind the Form that points there. */
static Form *kept(void *const *data, const Py_ssize_t *bytes, double thin)
{
    Py_ssize_t room = sizeof(Form);
    for (int i = 0; i < ARGUMENTS; i++)
        room += bytes[i];
    Form *form = PyMem_Malloc((size_t)room);
    if (form == NULL) {
        PyErr_NoMemory();
        return NULL;
    }
    const void *copies[ARGUMENTS];
    char *next = (char *)(form + 1);
    for (int i = 0; i < ARGUMENTS; i++) {
        copies[i] = next;
        memcpy(next, data[i], (size_t)bytes[i]);
        next += bytes[i];
    }
    const Py_ssize_t parts = bytes[9] / 8;
    *form = (Form){
        .parts = parts,
        .faces = bytes[6] / 8,
        .vertices_count = bytes[4] / 24,
        .edges_count = bytes[2] / 40,
        .joints = joints_of(copies[9], parts),
        .first_vertex = copies[0],
        .first_face = (const int64_t *)copies[0] + parts + 1,
        .corner = copies[1],
        .edges = copies[2],
        .heat = copies[3],
        .vertices = copies[4],
        .normals = copies[5],
        .offsets = copies[6],
        .crossing = copies[7],
        .joint = copies[9],
        .thin = thin,
    };
    return form;
}

PyObject *form(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    if (count != ARGUMENTS)
        return PyErr_Format(PyExc_TypeError, "form takes %d arguments, not %zd", ARGUMENTS, count);
    static const char *const formats[ARGUMENTS] = {"l", "l", "l", "l", "d", "d", "d", "d", NULL, "l"};
    Arrays arrays = {.count = 0};
    PyObject *capsule = NULL;
    double thin = PyFloat_AsDouble(given[THIN]);
    void *data[ARGUMENTS] = {[THIN] = &thin};
    Py_ssize_t length[ARGUMENTS] = {0}, bytes[ARGUMENTS];
    for (int i = 0; i < ARGUMENTS && !PyErr_Occurred(); i++)
        if (i != THIN)
            data[i] = array(&arrays, given[i], formats[i], 0, &length[i]);
    if (PyErr_Occurred())
        goto done;
    const Py_ssize_t parts = length[9], faces = length[6];
    const Py_ssize_t wanted[ARGUMENTS] = {2 * (parts + 1), faces,  length[2] / 5 * 5, parts, length[4] / 3 * 3,
                                          3 * faces,       faces, parts * faces,     0,     parts};
    int fits = parts > 0;
    for (int i = 0; i < ARGUMENTS; i++) {
        fits &= length[i] == wanted[i];
        bytes[i] = 8 * length[i]; /* all are of 64 bits */
    }
    Form *found = fits ? kept(data, bytes, thin) : NULL;
    if (found != NULL && holds_together(found))
        capsule = PyCapsule_New(found, NAME, let_go);
    else if (!PyErr_Occurred())
        PyErr_SetString(PyExc_ValueError, "form: its arrays do not agree");
    if (capsule == NULL)
        PyMem_Free(found);
done:
    release(&arrays);
    return capsule;
}

static const Form *form_of(PyObject *given)
{
    return PyCapsule_GetPointer(given, NAME);
}

/* How a part lies to the faces of another. */
typedef struct {
    int before;   /* wholly before one that the eye is before */
    int beyond;   /* wholly before one that the eye is not before */
    double least; /* how far it reaches behind the face that it reaches behind least */
    int64_t wall; /* that face */
} Relation;

typedef struct {
    uint64_t *hiders; /* (parts, words) bit i of row j: part i hides part j */
    Py_ssize_t words;
} Hiding;

static double crosses(const Form *form, Py_ssize_t part, int64_t face, int moved)
{
    if (!moved)
        return form->crossing[part * form->faces + face];
    double lowest = INFINITY;
    for (int64_t i = form->first_vertex[part]; i < form->first_vertex[part + 1]; i++)
        lowest = lesser(lowest, dot(form->vertices[i], form->normals[face]));
    return form->offsets[face] - lowest;
}

static Relation relation(const Form *form, Py_ssize_t part, Py_ssize_t other, const char *to_eye)
{
    Relation found = {.least = INFINITY, .wall = form->first_face[other]};
    int moved = form->joint[part] != form->joint[other];
    for (int64_t face = form->first_face[other]; face < form->first_face[other + 1]; face++) {
        double crossing = crosses(form, part, face, moved);
        if (crossing <= form->thin) {
            found.before |= to_eye[face];
            found.beyond |= !to_eye[face];
        }
        if (crossing < found.least) {
            found.least = crossing;
            found.wall = face;
        }
    }
    return found;
}

static void note(Hiding *hiding, Py_ssize_t hider, Py_ssize_t hidden)
{
    hiding->hiders[hidden * hiding->words + hider / 64] |= (uint64_t)1 << (hider % 64);
}

static int is_noted(const Hiding *hiding, Py_ssize_t hider, Py_ssize_t hidden)
{
    return hiding->hiders[hidden * hiding->words + hider / 64] >> (hider % 64) & 1;
}

static void compare(const Form *form, const char *to_eye, Py_ssize_t first, Py_ssize_t second, Hiding *hiding)
{
    Relation to_second = relation(form, first, second, to_eye), to_first = relation(form, second, first, to_eye);
    int first_cannot = to_first.before || to_second.beyond, second_cannot = to_second.before || to_first.beyond;
    if (!first_cannot && !second_cannot) {
        int of_second = to_second.least <= to_first.least;
        int nearer = to_eye[of_second ? to_second.wall : to_first.wall] == of_second;
        first_cannot = !nearer;
        second_cannot = nearer;
    }
    if (!first_cannot)
        note(hiding, first, second);
    if (!second_cannot)
        note(hiding, second, first);
}

/* Who hides those that hide a part hides it, too. */
static void close_chains(Hiding *hiding, Py_ssize_t parts)
{
    for (Py_ssize_t through = 0; through < parts; through++)
        for (Py_ssize_t hidden = 0; hidden < parts; hidden++)
            if (is_noted(hiding, through, hidden))
                for (Py_ssize_t word = 0; word < hiding->words; word++)
                    hiding->hiders[hidden * hiding->words + word] |= hiding->hiders[through * hiding->words + word];
}

/* Those that fewer hide come first, of equals the one with the lower number. */
static void rank_by_hiders(const Hiding *hiding, Py_ssize_t parts, int64_t *counts, int64_t *rank)
{
    for (Py_ssize_t part = 0; part < parts; part++) {
        counts[part] = 0;
        for (Py_ssize_t hider = 0; hider < parts; hider++)
            counts[part] += is_noted(hiding, hider, part);
    }
    for (Py_ssize_t part = 0; part < parts; part++) {
        rank[part] = 0;
        for (Py_ssize_t other = 0; other < parts; other++)
            rank[part] += counts[other] < counts[part] || (counts[other] == counts[part] && other < part);
    }
}

/* rank (parts) of each part seen by an eye that is before the faces `to_eye`; parts fill `boxes` in the image. -1 with
 * an exception without memory. */
static int hiding_order(const Form *form, const char *to_eye, const Extent *boxes, int64_t *rank)
{
    Scratch held = {.count = 0};
    Hiding hiding = {.words = (form->parts + 63) / 64};
    hiding.hiders = scratch(&held, form->parts * hiding.words, sizeof(uint64_t));
    int64_t *counts = hiding.hiders ? scratch_as_is(&held, form->parts, sizeof(int64_t)) : NULL;
    if (counts) {
        for (Py_ssize_t first = 0; first < form->parts; first++)
            for (Py_ssize_t second = first + 1; second < form->parts; second++)
                if (form->heat[first] != form->heat[second] && meet(&boxes[first], &boxes[second]))
                    compare(form, to_eye, first, second, &hiding);
        close_chains(&hiding, form->parts);
        rank_by_hiders(&hiding, form->parts, counts, rank);
    }
    discard(&held);
    return counts ? 0 : -1;
}

static Place turned(const double *turn, Place place)
{
    return (Place){
        turn[0] * place.x + turn[1] * place.y + turn[2] * place.z,
        turn[3] * place.x + turn[4] * place.y + turn[5] * place.z,
        turn[6] * place.x + turn[7] * place.y + turn[8] * place.z,
    };
}

/* Vertices, normals and offsets of a body's parts, those on joints moved. */
static int move_parts(Form *form, const Pose *pose, Scratch *held)
{
    Place *vertices = scratch_as_is(held, form->vertices_count, sizeof(Place));
    Place *normals = vertices ? scratch_as_is(held, form->faces, sizeof(Place)) : NULL;
    double *offsets = normals ? scratch_as_is(held, form->faces, sizeof(double)) : NULL;
    if (offsets == NULL)
        return -1;
    memcpy(vertices, form->vertices, (size_t)form->vertices_count * sizeof(Place));
    memcpy(normals, form->normals, (size_t)form->faces * sizeof(Place));
    memcpy(offsets, form->offsets, (size_t)form->faces * sizeof(double));
    for (Py_ssize_t part = 0; part < form->parts; part++) {
        if (form->joint[part] < 0)
            continue;
        const double *turn = pose->motions + 12 * form->joint[part], *shift = turn + 9;
        for (int64_t i = form->first_vertex[part]; i < form->first_vertex[part + 1]; i++) {
            Place place = turned(turn, vertices[i]);
            vertices[i] = (Place){place.x + shift[0] * pose->scale, place.y + shift[1] * pose->scale,
                                  place.z + shift[2] * pose->scale};
        }
        for (int64_t face = form->first_face[part]; face < form->first_face[part + 1]; face++) {
            normals[face] = turned(turn, normals[face]);
            offsets[face] = dot(normals[face], vertices[form->corner[face]]);
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
static int project(const Form *form, const Pose *pose, Point *pixels, Extent *boxes, Extent *box)
{
    const Place middle = pose->position;
    *box = NOTHING;
    if (middle.z <= 0)
        return 0;
    const double across = middle.x / middle.z, down = middle.y / middle.z;
    for (Py_ssize_t part = 0; part < form->parts; part++) {
        boxes[part] = NOTHING;
        for (int64_t i = form->first_vertex[part]; i < form->first_vertex[part + 1]; i++) {
            Place place = turned(pose->attitude, form->vertices[i]);
            double depth = place.z + middle.z;
            if (depth <= 0)
                return 0;
            double scale = 1 / (depth * pose->ifov);
            pixels[i] = (Point){(place.x - across * place.z) * scale, (place.y - down * place.z) * scale};
            boxes[part] = with_point(boxes[part], pixels[i]);
        }
        *box = with_point(with_point(*box, boxes[part].low), boxes[part].high);
    }
    return 1;
}

static void look(const Form *form, const Pose *pose, char *to_eye)
{
    const double *a = pose->attitude;
    const Place p = pose->position;
    Place eye = {-p.x * a[0] + -p.y * a[3] + -p.z * a[6], -p.x * a[1] + -p.y * a[4] + -p.z * a[7],
                 -p.x * a[2] + -p.y * a[5] + -p.z * a[8]};
    for (Py_ssize_t face = 0; face < form->faces; face++)
        to_eye[face] = dot(form->normals[face], eye) > form->offsets[face];
}

/* The edges on the rims of parts, those of each layer together. */
static void sort_rims(const Form *form, const char *to_eye, const Point *pixels, Py_ssize_t *next, Rims *rims)
{
    for (Py_ssize_t i = 0; i < form->edges_count; i++)
        if (to_eye[form->edges[i].left] != to_eye[form->edges[i].right])
            next[rims->rank[form->edges[i].part]]++;
    rims->count = 0;
    for (Py_ssize_t i = 0; i < form->parts; i++) {
        Py_ssize_t begin = rims->count;
        rims->count += next[i];
        next[i] = begin;
    }
    for (Py_ssize_t i = 0; i < form->edges_count; i++) {
        const Edge *edge = &form->edges[i];
        int left = to_eye[edge->left];
        if (left == to_eye[edge->right])
            continue;
        /* A face seen from outside runs clockwise in x right, y down where its edges are read backwards. */
        Py_ssize_t place = next[rims->rank[edge->part]]++;
        rims->start[place] = pixels[left ? edge->head : edge->tail];
        rims->stop[place] = pixels[left ? edge->tail : edge->head];
        rims->layer[place] = rims->rank[edge->part];
    }
}

/* 1 with the rims of a body, in memory of `held`; 0 where any part is behind the camera; -1 with an exception. */
static int outline(const Form *form, const Pose *pose, Scratch *held, Rims *rims)
{
    Form posed = *form;
    Point *pixels = scratch_as_is(held, form->vertices_count, sizeof(Point));
    Extent *boxes = pixels ? scratch_as_is(held, form->parts, sizeof(Extent)) : NULL;
    char *to_eye = boxes ? scratch_as_is(held, form->faces, 1) : NULL;
    Py_ssize_t *next = to_eye ? scratch(held, form->parts, sizeof(Py_ssize_t)) : NULL;
    rims->rank = next ? scratch_as_is(held, form->parts, sizeof(int64_t)) : NULL;
    rims->start = rims->rank ? scratch_as_is(held, form->edges_count, sizeof(Point)) : NULL;
    rims->stop = rims->start ? scratch_as_is(held, form->edges_count, sizeof(Point)) : NULL;
    rims->layer = rims->stop ? scratch_as_is(held, form->edges_count, sizeof(int64_t)) : NULL;
    if (rims->layer == NULL || (form->joints > 0 && move_parts(&posed, pose, held) < 0))
        return -1;
    if (!project(&posed, pose, pixels, boxes, &rims->box))
        return 0;
    look(&posed, pose, to_eye);
    if (hiding_order(&posed, to_eye, boxes, rims->rank) < 0)
        return -1;
    sort_rims(&posed, to_eye, pixels, next, rims);
    return 1;
}

/* A box by its middle and its sides, as `Box` in irsim/types: its edges are rounded as those of one. */
typedef struct {
    Point middle;
    double wide, high;
} Box;

static Box box_of(Extent edges)
{
    return (Box){{(edges.low.x + edges.high.x) / 2, (edges.low.y + edges.high.y) / 2},
                 edges.high.x - edges.low.x,
                 edges.high.y - edges.low.y};
}

static Extent edges_of(Box box)
{
    return (Extent){{box.middle.x - box.wide / 2, box.middle.y - box.high / 2},
                    {box.middle.x + box.wide / 2, box.middle.y + box.high / 2}};
}

/* The part of a box whose light can reach a frame of so many columns and rows; a corner of it where none can. */
static Box drawn_part(Box box, double reach, double columns, double rows)
{
    const double out = -(reach + 0.5), right = columns - 1 + reach + 0.5, bottom = rows - 1 + reach + 0.5;
    Extent edges = edges_of(box);
    if (out <= edges.low.x && edges.low.x < edges.high.x && edges.high.x <= right && out <= edges.low.y &&
        edges.low.y < edges.high.y && edges.high.y <= bottom)
        return box;
    Extent part = {{greater(edges.low.x, out), greater(edges.low.y, out)},
                   {lesser(edges.high.x, right), lesser(edges.high.y, bottom)}};
    if (part.low.x < part.high.x && part.low.y < part.high.y)
        return box_of(part);
    return (Box){edges.low, 1.0, 1.0};
}

/* The pixels that hold a window. */
typedef struct {
    Py_ssize_t left, top, columns, rows;
} Pixels;

#define FAR 1e15 /* px: what is farther away has no whole pixels any more */
#define MOST 1e9 /* more pixels than any picture has */

static int is_number(double value)
{
    return fabs(value) < INFINITY; /* nan is none */
}

/* 0 where the box that the window is of is nowhere, or the window far away or too large to be drawn. */
static int pixels_of(Box box, Box window, Pixels *pixels)
{
    const Extent edges = edges_of(window);
    const double left = floor(edges.low.x + 0.5), top = floor(edges.low.y + 0.5);
    const double columns = greater(ceil(edges.high.x - 0.5) - left + 1, 1);
    const double rows = greater(ceil(edges.high.y - 0.5) - top + 1, 1);
    if (!(is_number(box.middle.x + box.wide) && is_number(box.middle.y + box.high) && fabs(left) < FAR &&
          fabs(top) < FAR && columns * rows < MOST))
        return 0;
    *pixels = (Pixels){(Py_ssize_t)left, (Py_ssize_t)top, (Py_ssize_t)columns, (Py_ssize_t)rows};
    return 1;
}

/* The spread for what is so large, of pairs of the largest side that each is for and itself; the last is for all. */
static const Spread *spread_for(PyObject *pairs, double side)
{
    const Py_ssize_t count = PyTuple_Check(pairs) ? PyTuple_Size(pairs) : 0;
    for (Py_ssize_t i = 0; i < count; i++) {
        PyObject *pair = PyTuple_GetItem(pairs, i);
        if (!PyTuple_Check(pair) || PyTuple_Size(pair) != 2)
            break;
        const double limit = PyFloat_AsDouble(PyTuple_GetItem(pair, 0));
        if (limit == -1.0 && PyErr_Occurred())
            return NULL;
        if (side <= limit || i + 1 == count)
            return spread_of(PyTuple_GetItem(pair, 1));
    }
    PyErr_SetString(PyExc_TypeError, "pairs of a size and a spread are wanted");
    return NULL;
}

/* The motions (12 numbers each) of so many joints; NULL with an exception where there are not as many. */
static double *motions_of(PyObject *given, Py_ssize_t joints, Scratch *held)
{
    if (!PyTuple_Check(given) || PyTuple_Size(given) < joints) {
        PyErr_SetString(PyExc_ValueError, "body_light: a motion is wanted for each joint");
        return NULL;
    }
    double *motions = scratch(held, 12 * joints, sizeof(double));
    for (Py_ssize_t joint = 0; joint < joints && motions; joint++) {
        PyObject *numbers = PyTuple_GetItem(given, joint);
        if (!PyTuple_Check(numbers) || PyTuple_Size(numbers) != 12) {
            PyErr_SetString(PyExc_ValueError, "body_light: a motion is of twelve numbers");
            return NULL;
        }
        for (int i = 0; i < 12; i++)
            motions[12 * joint + i] = PyFloat_AsDouble(PyTuple_GetItem(numbers, i));
    }
    return PyErr_Occurred() ? NULL : motions;
}

/* Where the picture's middle axis and the edges of the frame are. */
typedef struct {
    double columns, rows, shift_x, shift_y;
} Frame;

static PyObject *lit(const Form *form, const Pose *pose, const Frame *frame, const double *shine, double brightness,
                     PyObject *spreads, Scratch *held)
{
    Rims rims;
    const int found = outline(form, pose, held, &rims);
    if (found == 0)
        Py_RETURN_NONE;
    double *glow = found > 0 ? scratch(held, form->parts, sizeof(double)) : NULL;
    if (glow == NULL)
        return NULL;
    for (Py_ssize_t part = 0; part < form->parts; part++)
        glow[rims.rank[part]] = shine[part] * brightness;
    const Place at = pose->position;
    const double scale = 1 / (at.z * pose->ifov);
    const Point middle = {(frame->columns - 1) / 2 + frame->shift_x + at.x * scale,
                          (frame->rows - 1) / 2 + frame->shift_y + at.y * scale};
    const Box box = box_of((Extent){{middle.x + rims.box.low.x, middle.y + rims.box.low.y},
                                    {middle.x + rims.box.high.x, middle.y + rims.box.high.y}});
    const Spread *any = spread_for(spreads, 0.0); /* all reach as far */
    if (any == NULL)
        return NULL;
    const Box window = drawn_part(box, (double)any->reach, frame->columns, frame->rows);
    const Spread *by = spread_for(spreads, greater(window.wide, window.high));
    Pixels pixels;
    if (by == NULL)
        return NULL;
    if (!pixels_of(box, window, &pixels)) {
        PyErr_SetString(PyExc_ValueError, "body_light: a body lies nowhere, or too far away from the picture");
        return NULL;
    }
    const Py_ssize_t high = pixels.rows + 2 * by->reach, wide = pixels.columns + 2 * by->reach;
    PyObject *light = PyByteArray_FromStringAndSize(NULL, 3 * high * wide * (Py_ssize_t)sizeof(double));
    if (light == NULL)
        return NULL;
    const Point corner = {(double)pixels.left - 0.5 - middle.x, (double)pixels.top - 0.5 - middle.y};
    Middle of;
    if (draw_polygons(rims.start, rims.stop, rims.layer, rims.count, glow, form->parts, corner, pixels.rows,
                      pixels.columns, by, (double *)PyByteArray_AsString(light), &of) < 0) {
        Py_DECREF(light);
        return NULL;
    }
    const Point signal = of.light > 0 ? of.signal_center : of.center;
    const double range = sqrt(at.x * at.x + at.y * at.y + at.z * at.z);
    return Py_BuildValue("nn(nnn)N(dd)(dd)(dddd)dd", pixels.left - by->reach, pixels.top - by->reach, (Py_ssize_t)3,
                         high, wide, light, middle.x + of.center.x, middle.y + of.center.y, middle.x + signal.x,
                         middle.y + signal.y, box.middle.x, box.middle.y, box.wide, box.high, range, of.area);
}

/* body_light(form, motions, scale, position, attitude, ifov, columns, rows, shift x, shift y, shine, brightness,
 * spreads): x0, y0, shape and bytes of (cover, alpha, emission), the centroids of its area and of its light, its box,
 * range and area; None where it is behind the camera. */
PyObject *body_light(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    if (count != 13)
        return PyErr_Format(PyExc_TypeError, "body_light takes 13 arguments, not %zd", count);
    const Form *form = form_of(given[0]);
    if (form == NULL)
        return NULL;
    Arrays arrays = {.count = 0};
    Scratch held = {.count = 0};
    PyObject *result = NULL;
    Py_ssize_t three, nine, parts;
    const Place *position = array(&arrays, given[3], "d", 0, &three);
    const double *attitude = position ? array(&arrays, given[4], "d", 0, &nine) : NULL;
    const double *shine = attitude ? array(&arrays, given[10], "d", 0, &parts) : NULL;
    const double *motions = shine ? motions_of(given[1], form->joints, &held) : NULL;
    if (motions == NULL)
        goto done;
    if (three != 3 || nine != 9 || parts != form->parts) {
        PyErr_SetString(PyExc_ValueError, "body_light: its arrays do not agree");
        goto done;
    }
    const Pose pose = {motions, PyFloat_AsDouble(given[2]), *position, attitude, PyFloat_AsDouble(given[5])};
    const Frame frame = {PyFloat_AsDouble(given[6]), PyFloat_AsDouble(given[7]), PyFloat_AsDouble(given[8]),
                         PyFloat_AsDouble(given[9])};
    const double brightness = PyFloat_AsDouble(given[11]);
    if (!PyErr_Occurred())
        result = lit(form, &pose, &frame, shine, brightness, given[12], &held);
done:
    discard(&held);
    release(&arrays);
    return result;
}
