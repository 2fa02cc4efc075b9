/* What fills a box beside the ring around it; see irsim/render/contrast.py. */
#include "clutter.h"

#include <math.h>
#include <stdint.h>

typedef struct {
    int64_t first, stop;
} Range;

/* Of the pixels along one axis: those that the box holds, the ring's, and the guard's. */
typedef struct {
    Range held, ring, guard;
    double low, high; /* the sides of the box */
} Line;

static int64_t clipped(double place, int64_t count)
{
    return place >= (double)count ? count : place >= 0 ? (int64_t)place : 0; /* nan, too, is 0 */
}

static Range reaching(const Line *line, double by, int64_t count)
{
    return (Range){clipped(ceil(line->low - by), count), clipped(floor(line->high + by) + 1, count)};
}

static Line line_of(int64_t count, double middle, double side, double ring, double guard)
{
    double half = (side > 1.0 ? side : 1.0) / 2;
    Line line = {.low = middle - half, .high = middle + half};
    line.held = reaching(&line, 0.5, count);
    line.ring = reaching(&line, ring, count);
    line.guard = reaching(&line, guard, count);
    return line;
}

/* How much of a pixel the box holds. */
static double share(const Line *line, int64_t place)
{
    double low = (double)place - 0.5, high = (double)place + 0.5;
    return (high < line->high ? high : line->high) - (low > line->low ? low : line->low);
}

static double shares(const Line *line)
{
    double sum = 0.0;
    for (int64_t i = line->held.first; i < line->held.stop; i++)
        sum += share(line, i);
    return sum;
}

/* Sums of differences from a reference, and of their squares: several side by side, which is quicker. */
#define SIDE_BY_SIDE 4

typedef struct {
    double of[SIDE_BY_SIDE], squares[SIDE_BY_SIDE];
    int64_t count;
} Sums;

static void add(Sums *sums, const float *values, Range range, double reference)
{
    int64_t i = range.first;
    for (; i + SIDE_BY_SIDE <= range.stop; i += SIDE_BY_SIDE)
        for (int j = 0; j < SIDE_BY_SIDE; j++) {
            double difference = (double)values[i + j] - reference;
            sums->of[j] += difference;
            sums->squares[j] += difference * difference;
        }
    for (; i < range.stop; i++) {
        double difference = (double)values[i] - reference;
        sums->of[0] += difference;
        sums->squares[0] += difference * difference;
    }
    sums->count += range.stop > range.first ? range.stop - range.first : 0;
}

static double total(const double *each)
{
    return (each[0] + each[1]) + (each[2] + each[3]);
}

typedef struct {
    double signal, level, spread;
} Clutter;

static Clutter around(const float *picture, int64_t columns, const Line *down, const Line *across)
{
    const Clutter none = {NAN, NAN, NAN};
    double weight = shares(down) * shares(across);
    if (!(weight > 0) || down->ring.first >= down->ring.stop || across->ring.first >= across->ring.stop)
        return none;
    double reference = (double)picture[down->ring.first * columns + across->ring.first];
    Sums sums = {.count = 0};
    for (int64_t row = down->ring.first; row < down->ring.stop; row++) {
        const float *values = picture + row * columns;
        if (row < down->guard.first || row >= down->guard.stop || across->guard.first >= across->guard.stop) {
            add(&sums, values, across->ring, reference);
            continue;
        }
        add(&sums, values, (Range){across->ring.first, across->guard.first}, reference);
        add(&sums, values, (Range){across->guard.stop, across->ring.stop}, reference);
    }
    if (sums.count == 0)
        return none;
    double level = total(sums.of) / (double)sums.count;
    double variance = total(sums.squares) / (double)sums.count - level * level;
    double held = 0.0;
    for (int64_t row = down->held.first; row < down->held.stop; row++) {
        double sum = 0.0;
        for (int64_t column = across->held.first; column < across->held.stop; column++)
            sum += share(across, column) * (double)picture[row * columns + column];
        held += share(down, row) * sum;
    }
    return (Clutter){held / weight - reference - level, reference + level, sqrt(variance > 0 ? variance : 0.0)};
}

/* clutter(picture, columns, cx, cy, w, h, ring, guard): picture float32, of so many columns. */
PyObject *clutter(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    if (count != 8) {
        PyErr_SetString(PyExc_TypeError, "clutter takes 8 arguments");
        return NULL;
    }
    Arrays arrays = {.count = 0};
    PyObject *result = NULL;
    Py_ssize_t pixels;
    double number[8];
    const float *picture = array(&arrays, given[0], "f", 0, &pixels);
    int64_t columns = picture ? PyLong_AsSsize_t(given[1]) : 0;
    for (int i = 2; i < 8 && picture && !PyErr_Occurred(); i++)
        number[i] = PyFloat_AsDouble(given[i]);
    if (picture == NULL || PyErr_Occurred())
        goto done;
    if (columns < 1 || pixels % columns || !(number[7] <= number[6])) {
        PyErr_SetString(PyExc_ValueError, "clutter: a picture of whole rows is wanted, and a guard within the ring");
        goto done;
    }
    Line across = line_of(columns, number[2], number[4], number[6], number[7]);
    Line down = line_of(pixels / columns, number[3], number[5], number[6], number[7]);
    Clutter found = around(picture, columns, &down, &across);
    result = Py_BuildValue("(ddd)", found.signal, found.level, found.spread);
done:
    release(&arrays);
    return result;
}
