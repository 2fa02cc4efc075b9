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

/* All numbers in the tables refer to something. */
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

/* The number of joints that parts name. */
static Py_ssize_t joints_of(const int64_t *joint, Py_ssize_t parts)
{
    int64_t most = -1;
    for (Py_ssize_t i = 0; i < parts; i++)
        most = joint[i] > most ? joint[i] : most;
    return (Py_ssize_t)most + 1;
}

#define TABLES 10
#define THIN 8 /* the argument that is a number */

static void let_go(PyObject *capsule)
{
    PyMem_Free(PyCapsule_GetPointer(capsule, NAME));
}

/* The form in one block of memory with copies of the tables, all of 64 bits. */
KERNEL(form, TABLES)
{
    static const char *const formats[TABLES] = {"l", "l", "l", "l", "d", "d", "d", "d", NULL, "l"};
    const void *data[TABLES], *copies[TABLES];
    Py_ssize_t length[TABLES] = {0}, size = sizeof(Form);
    const double thin = number(call, THIN);
    for (int i = 0; i < TABLES; i++) {
        data[i] = i == THIN ? NULL : input(call, i, formats[i], &length[i]);
        size += 8 * length[i];
    }
    const Py_ssize_t parts = length[9], faces = length[6];
    const Py_ssize_t wanted[TABLES] = {2 * (parts + 1), faces,  length[2] / 5 * 5, parts, length[4] / 3 * 3,
                                       3 * faces,       faces, parts * faces,     0,     parts};
    if (call->failed)
        return NULL;
    if (parts == 0 || memcmp(length, wanted, sizeof wanted) != 0)
        return wrong(call, "form: its arrays do not agree");
    Form *form = PyMem_Malloc((size_t)size);
    if (form == NULL)
        return PyErr_NoMemory();
    char *next = (char *)(form + 1);
    for (int i = 0; i < TABLES; i++) {
        copies[i] = next;
        if (length[i] > 0)
            memcpy(next, data[i], 8 * (size_t)length[i]);
        next += 8 * length[i];
    }
    *form = (Form){
        .parts = parts,
        .faces = faces,
        .vertices_count = length[4] / 3,
        .edges_count = length[2] / 5,
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
    PyObject *capsule = holds_together(form) ? PyCapsule_New(form, NAME, let_go)
                                             : wrong(call, "form: its arrays do not agree");
    if (capsule == NULL)
        PyMem_Free(form);
    return capsule;
}

/* Position of a part relative to the faces of another. */
typedef struct {
    int before;   /* it is wholly before a face, as the eye is */
    int beyond;   /* it is wholly before a face, and the eye is not */
    double least; /* its least reach behind a face */
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

/* A part that hides a hider of another hides that one, too. */
static void close_chains(Hiding *hiding, Py_ssize_t parts)
{
    for (Py_ssize_t through = 0; through < parts; through++)
        for (Py_ssize_t hidden = 0; hidden < parts; hidden++)
            if (is_noted(hiding, through, hidden))
                for (Py_ssize_t word = 0; word < hiding->words; word++)
                    hiding->hiders[hidden * hiding->words + word] |= hiding->hiders[through * hiding->words + word];
}

/* Ranks parts by the number of their hiders, then by their own number. */
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

/* Writes rank (parts) for an eye that is before the faces `to_eye`; parts fill `boxes` in the image. -1 without memory. */
static int hiding_order(const Form *form, const char *to_eye, const Extent *boxes, int64_t *rank)
{
    Scratch held = {.count = 0};
    Hiding hiding = {.words = (form->parts + 63) / 64};
    hiding.hiders = scratch(&held, form->parts * hiding.words, sizeof(uint64_t));
    int64_t *counts = scratch_as_is(&held, form->parts, sizeof(int64_t));
    if (!held.failed) {
        for (Py_ssize_t first = 0; first < form->parts; first++)
            for (Py_ssize_t second = first + 1; second < form->parts; second++)
                if (form->heat[first] != form->heat[second] && meet(&boxes[first], &boxes[second]))
                    compare(form, to_eye, first, second, &hiding);
        close_chains(&hiding, form->parts);
        rank_by_hiders(&hiding, form->parts, counts, rank);
    }
    discard(&held);
    return held.failed ? -1 : 0;
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
    Place *normals = scratch_as_is(held, form->faces, sizeof(Place));
    double *offsets = scratch_as_is(held, form->faces, sizeof(double));
    if (held->failed)
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

/* Projects vertices, px from the body's middle (so that a small body's edges keep their digits), and the boxes of parts;
 * 0 where a vertex is behind the camera. */
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
    Extent *boxes = scratch_as_is(held, form->parts, sizeof(Extent));
    char *to_eye = scratch_as_is(held, form->faces, 1);
    Py_ssize_t *next = scratch(held, form->parts, sizeof(Py_ssize_t));
    rims->rank = scratch_as_is(held, form->parts, sizeof(int64_t));
    rims->start = scratch_as_is(held, form->edges_count, sizeof(Point));
    rims->stop = scratch_as_is(held, form->edges_count, sizeof(Point));
    rims->layer = scratch_as_is(held, form->edges_count, sizeof(int64_t));
    if (held->failed || (form->joints > 0 && move_parts(&posed, pose, held) < 0))
        return -1;
    if (!project(&posed, pose, pixels, boxes, &rims->box))
        return 0;
    look(&posed, pose, to_eye);
    if (hiding_order(&posed, to_eye, boxes, rims->rank) < 0)
        return -1;
    sort_rims(&posed, to_eye, pixels, next, rims);
    return 1;
}

/* A box by its middle and its sides, so that its edges are rounded as those of `Box` in irsim/types. */
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

/* The part of a box whose light reaches a frame of columns x rows; a corner of it where none does. */
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

#define FAR 1e15 /* px: beyond, doubles do not hold whole pixels */
#define MOST 1e9 /* more pixels than any picture has */

static int is_number(double value)
{
    return fabs(value) < INFINITY; /* nan is none */
}

/* 0 where the box has no place, or its window is too far away or too large to be drawn. */
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

/* The spread for a side, px, of pairs (largest side, spread); the last is for all larger sides. */
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

/* Argument i as a tuple of 12 numbers for each joint. */
static double *motions_of(Call *call, int i, Py_ssize_t joints)
{
    PyObject *given = call->given[i];
    if (!PyTuple_Check(given) || PyTuple_Size(given) < joints)
        return wrong(call, "body_light: a motion is required for each joint");
    double *motions = room(call, 12 * joints, sizeof(double));
    for (Py_ssize_t joint = 0; joint < joints && motions; joint++) {
        PyObject *numbers = PyTuple_GetItem(given, joint);
        if (!PyTuple_Check(numbers) || PyTuple_Size(numbers) != 12)
            return wrong(call, "body_light: a motion is of twelve numbers");
        for (int k = 0; k < 12; k++)
            motions[12 * joint + k] = PyFloat_AsDouble(PyTuple_GetItem(numbers, k));
    }
    call->failed |= PyErr_Occurred() != NULL;
    return motions;
}

/* Size of the frame, and shift of its middle axis, px. */
typedef struct {
    double columns, rows, shift_x, shift_y;
} Frame;

static PyObject *lit(Call *call, const Form *form, const Pose *pose, const Frame *frame, const double *shine,
                     double brightness, PyObject *spreads)
{
    Rims rims = {.count = 0, .box = NOTHING};
    const int found = outline(form, pose, &call->held, &rims);
    if (found == 0)
        Py_RETURN_NONE;
    double *glow = scratch(&call->held, form->parts, sizeof(double));
    if (found < 0 || glow == NULL)
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
    if (!pixels_of(box, window, &pixels))
        return wrong(call, "body_light: a body has no place, or is too far away from the picture");
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

KERNEL(body_light, 13)
{
    Py_ssize_t three, nine, parts;
    const Form *form = PyCapsule_GetPointer(call->given[0], NAME);
    if (form == NULL)
        return NULL;
    const Place *position = input(call, 3, "d", &three);
    const double *attitude = input(call, 4, "d", &nine), *shine = input(call, 10, "d", &parts);
    if (call->failed)
        return NULL;
    if (three != 3 || nine != 9 || parts != form->parts)
        return wrong(call, "body_light: its arrays do not agree");
    const Pose pose = {motions_of(call, 1, form->joints), number(call, 2), *position, attitude, number(call, 5)};
    const Frame frame = {number(call, 6), number(call, 7), number(call, 8), number(call, 9)};
    const double brightness = number(call, 11);
    return call->failed ? NULL : lit(call, form, &pose, &frame, shine, brightness, call->given[12]);
}
