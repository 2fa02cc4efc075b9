/* Windows that climb by mean shift; see irtrack/features/mean_shift.py, where the equations are. */
#include "mean_shift.h"

#include <math.h>

#include "sums.h"

#define LARGEST_BANDWIDTH 1e6


/* What a window needs while it climbs: of its pixels, row after row, the bin, the slope g of the kernel and terms of
 * sums; of its bins, the mass, and one bin more for what is outside the frame; of its columns and its rows, how far
 * from the centre they are, px, that in bandwidths squared, and which they are in the frame, or OUTSIDE. */
typedef struct {
    uint16_t *cells;
    double *slope, *terms, *mass, *ratio, *offset[2], *square[2];
    Py_ssize_t *place[2];
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

static void lay(const Climb *climb, const double center[2], Room room)
{
    const Py_ssize_t edge[2] = {climb->picture.columns, climb->picture.rows};
    for (int axis = 0; axis < 2; axis++) {
        double middle = floor(center[axis] + 0.5);
        for (Py_ssize_t i = 0; i < across(climb, axis); i++) {
            double pixel = middle + (double)(i - climb->reach[axis]), off = pixel - center[axis];
            double bandwidths = off / climb->h[axis];
            room.offset[axis][i] = off;
            room.square[axis][i] = bandwidths * bandwidths;
            room.place[axis][i] = pixel >= 0 && pixel < (double)edge[axis] ? (Py_ssize_t)pixel : OUTSIDE;
        }
    }
}

/* Fills cells, slopes, and the mass in each bin as a share of the whole kernel's. */
static void look(const Climb *climb, const double center[2], Room room)
{
    lay(climb, center, room);
    memset(room.mass, 0, (size_t)(climb->bins + 1) * sizeof *room.mass);
    for (Py_ssize_t row = 0; row < across(climb, 1); row++) {
        for (Py_ssize_t column = 0; column < across(climb, 0); column++) {
            uint16_t bin = (uint16_t)climb->bins;
            if (room.place[1][row] != OUTSIDE && room.place[0][column] != OUTSIDE) {
                uint16_t seen = bin_at(&climb->picture, room.place[1][row], room.place[0][column]);
                bin = seen < bin ? seen : bin;
            }
            double r2 = room.square[0][column] + room.square[1][row];
            double profile = 1 - r2, slope = (1 - sqrt(r2)) * climb->ramp + 0.5;
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
        for (Py_ssize_t row = 0; row < across(climb, 1); row++)
            for (Py_ssize_t column = 0; column < wide; column++) {
                Py_ssize_t i = row * wide + column;
                room.terms[i] = room.slope[i] * room.offset[axis][axis == 0 ? column : row];
            }
        step[axis] = pairwise_sum(room.terms, pixels) / total;
    }
}

static int make_room(const Climb *climb, Room *room)
{
    size_t columns = (size_t)across(climb, 0), rows = (size_t)across(climb, 1), bins = (size_t)climb->bins + 1;
    size_t pixels = columns * rows, sides = columns + rows;
    room->cells = PyMem_Malloc(pixels * sizeof *room->cells);
    room->slope = PyMem_Malloc(2 * (pixels + bins + sides) * sizeof *room->slope);
    room->place[0] = PyMem_Malloc(sides * sizeof *room->place[0]);
    if (room->cells == NULL || room->slope == NULL || room->place[0] == NULL) {
        PyErr_NoMemory();
        return 0;
    }
    room->terms = room->slope + pixels;
    room->mass = room->terms + pixels;
    room->ratio = room->mass + bins;
    room->offset[0] = room->ratio + bins;
    room->offset[1] = room->offset[0] + columns;
    room->square[0] = room->offset[1] + rows;
    room->square[1] = room->square[0] + columns;
    room->place[1] = room->place[0] + columns;
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
    Room room = {.cells = NULL};
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
    PyMem_Free(room.place[0]);
    release(&arrays);
    return result;
}
