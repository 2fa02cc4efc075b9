/* Windows that climb by mean shift; see irtrack/features/mean_shift.py, where the equations are. */
#include "mean_shift.h"

#include <math.h>

#include "sums.h"

#define LARGEST_BANDWIDTH 1e6

/* What a window needs while it climbs: of its pixels, row after row, the bin, the slope g of the kernel and terms of
 * sums; of its bins, the mass, and one bin more for what is outside the frame. */
typedef struct {
    uint16_t *cells;
    double *slope, *terms, *mass, *ratio;
} Room;

typedef struct {
    Picture picture;
    double h[2], ramp;
    Py_ssize_t reach[2], bins;
} Climb;

static Py_ssize_t across(const Climb *climb, int axis)
{
    return 2 * climb->reach[axis] + 1;
}

/* A pixel's distance from the centre on an axis, px; the first one's at index 0. */
static double offset(const Climb *climb, const double center[2], int axis, Py_ssize_t index)
{
    return floor(center[axis] + 0.5) + (double)(index - climb->reach[axis]) - center[axis];
}

/* Fills cells, slopes, and the mass in each bin as a share of the whole kernel's. */
static void look(const Climb *climb, const double center[2], Room room)
{
    memset(room.mass, 0, (size_t)(climb->bins + 1) * sizeof *room.mass);
    for (Py_ssize_t row = 0; row < across(climb, 1); row++) {
        double off_y = offset(climb, center, 1, row), y = off_y / climb->h[1];
        double pixel_y = floor(center[1] + 0.5) + (double)(row - climb->reach[1]);
        int on_row = pixel_y >= 0 && pixel_y < (double)climb->picture.rows;
        for (Py_ssize_t column = 0; column < across(climb, 0); column++) {
            double off_x = offset(climb, center, 0, column), x = off_x / climb->h[0];
            double pixel_x = floor(center[0] + 0.5) + (double)(column - climb->reach[0]);
            uint16_t bin = (uint16_t)climb->bins;
            if (on_row && pixel_x >= 0 && pixel_x < (double)climb->picture.columns) {
                uint16_t seen = bin_at(&climb->picture, (Py_ssize_t)pixel_y, (Py_ssize_t)pixel_x);
                bin = seen < bin ? seen : bin;
            }
            double r2 = x * x + y * y, profile = 1 - r2, slope = (1 - sqrt(r2)) * climb->ramp + 0.5;
            room.mass[bin] += profile < 0 ? 0 : profile;
            *room.slope++ = slope < 0 ? 0 : slope > 1 ? 1 : slope;
            *room.cells++ = bin;
        }
    }
    double whole = pairwise_sum(room.mass, climb->bins + 1);
    for (Py_ssize_t u = 0; u < climb->bins; u++)
        room.mass[u] /= whole;
}

/* The step that eq. 13 makes from a centre. */
static void step_from(const Climb *climb, const double center[2], const double *reference, Room room, double step[2])
{
    look(climb, center, room);
    for (Py_ssize_t u = 0; u < climb->bins; u++)
        room.ratio[u] = room.mass[u] > 0 ? sqrt(reference[u] / room.mass[u]) : 0;
    room.ratio[climb->bins] = 0;
    Py_ssize_t wide = across(climb, 0), pixels = wide * across(climb, 1);
    for (Py_ssize_t i = 0; i < pixels; i++)
        room.terms[i] = room.slope[i] = room.ratio[room.cells[i]] * room.slope[i];
    double total = pairwise_sum(room.terms, pixels);
    if (total == 0)
        total = INFINITY;
    for (int axis = 0; axis < 2; axis++) {
        for (Py_ssize_t i = 0; i < pixels; i++)
            room.terms[i] = room.slope[i] * offset(climb, center, axis, axis == 0 ? i % wide : i / wide);
        step[axis] = pairwise_sum(room.terms, pixels) / total;
    }
}

static int make_room(const Climb *climb, Room *room)
{
    size_t pixels = (size_t)(across(climb, 0) * across(climb, 1)), bins = (size_t)climb->bins + 1;
    room->cells = PyMem_Malloc(pixels * sizeof *room->cells);
    room->slope = PyMem_Malloc(2 * (pixels + bins) * sizeof *room->slope);
    if (room->cells == NULL || room->slope == NULL) {
        PyErr_NoMemory();
        return 0;
    }
    room->terms = room->slope + pixels;
    room->mass = room->terms + pixels;
    room->ratio = room->mass + bins;
    return 1;
}

/* mean_shift(image, table, h_x, h_y, reference, iterations, eps, centers, mass, visible)
 *
 * Moves windows at centers (N, 2) until a step is shorter than eps; writes the mass (N, bins) in each bin where they
 * come to rest, over the whole window's, and its visible share (N,). */
PyObject *mean_shift(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    if (count != 10) {
        PyErr_SetString(PyExc_TypeError, "mean_shift takes 10 arguments");
        return NULL;
    }
    PyObject *result = NULL;
    Climb climb;
    Room room = {NULL, NULL, NULL, NULL, NULL};
    Py_ssize_t numbers, space, windows;
    if (!picture(&arrays, given[0], given[1], &climb.picture))
        goto done;
    for (int axis = 0; axis < 2; axis++)
        climb.h[axis] = PyFloat_AsDouble(given[2 + axis]);
    Py_ssize_t iterations = PyLong_AsSsize_t(given[5]);
    double eps = PyFloat_AsDouble(given[6]);
    if (PyErr_Occurred())
        goto done;
    const double *reference = array(&arrays, given[4], "d", 0, &climb.bins);
    double *centers = reference ? array(&arrays, given[7], "d", 1, &numbers) : NULL;
    double *mass = centers ? array(&arrays, given[8], "d", 1, &space) : NULL;
    double *visible = mass ? array(&arrays, given[9], "d", 1, &windows) : NULL;
    if (visible == NULL)
        goto done;
    if (numbers != 2 * windows || space != windows * climb.bins || climb.bins < 1 || climb.bins >= UINT16_MAX) {
        wrong("mean_shift: lengths do not agree");
        goto done;
    }
    for (int axis = 0; axis < 2; axis++) {
        if (!(climb.h[axis] > 0 && climb.h[axis] < LARGEST_BANDWIDTH)) {
            wrong("mean_shift: a bandwidth out of range");
            goto done;
        }
        /* The ramp of g ends half a pixel beyond h, and a centre lies up to half a pixel from the middle one. */
        climb.reach[axis] = (Py_ssize_t)(climb.h[axis] + 1);
    }
    climb.ramp = sqrt(climb.h[0] * climb.h[1]);
    if (!make_room(&climb, &room))
        goto done;
    for (Py_ssize_t i = 0; i < windows; i++) {
        double *center = centers + 2 * i, step[2] = {INFINITY, INFINITY};
        for (Py_ssize_t k = 0; k < iterations && hypot(step[0], step[1]) >= eps; k++) {
            step_from(&climb, center, reference, room, step);
            center[0] += step[0];
            center[1] += step[1];
        }
        look(&climb, center, room);
        memcpy(mass + i * climb.bins, room.mass, (size_t)climb.bins * sizeof *mass);
        visible[i] = pairwise_sum(room.mass, climb.bins);
    }
    result = Py_NewRef(Py_None);
done:
    PyMem_Free(room.cells);
    PyMem_Free(room.slope);
    release(&arrays);
    return result;
}
