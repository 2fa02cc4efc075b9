/* See irsim/targets/part_outlines.py and irsim/geometry/silhouette.py, which do the same one after the other, with arrays. */
#include "body.h"

#include "arguments.h"
#include "outline.h"
#include "sprite.h"

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
