/* A sprite drawn over an image (see irsim/render/composite.py), and the clutter around a box (contrast.py). */
#include "kernels.h"

/* The part of 0 .. length - 1 that lies overlap 0 .. end - 1 when shifted by `origin`. */
typedef struct {
    Py_ssize_t first, stop;
} Overlap;

static Overlap overlap(Py_ssize_t origin, Py_ssize_t length, Py_ssize_t end)
{
    Overlap found = {origin < 0 ? -origin : 0, origin < end - length ? length : end - origin};
    return found.first < found.stop ? found : (Overlap){0, 0};
}

/* What the light of a patch and that of the picture behind it sum up to, where both are. */
typedef struct {
    double alpha, emission, behind;
} Totals;

static void lay_row(float *light, const double *alpha, const double *emission, Py_ssize_t count, Totals *sums)
{
    for (Py_ssize_t i = 0; i < count; i++) {
        double behind = alpha[i] * (double)light[i];
        sums->alpha += alpha[i];
        sums->emission += emission[i];
        sums->behind += behind;
        light[i] = (float)((double)light[i] + (emission[i] - behind));
    }
}

/* lay(light, columns, alpha, emission, wide, x, y): light (float32, of so many columns) <- light (1 - alpha) + emission,
 * a patch of `wide` columns whose top left is (x, y). Returned are the sums of alpha, emission, and alpha * light as it
 * was, overlap the picture. */
PyObject *lay(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    if (count != 7) {
        PyErr_SetString(PyExc_TypeError, "lay takes 7 arguments");
        return NULL;
    }
    Arrays arrays = {.count = 0};
    PyObject *result = NULL;
    Py_ssize_t pixels, size, lit;
    float *light = array(&arrays, given[0], "f", 1, &pixels);
    const double *alpha = light ? array(&arrays, given[2], "d", 0, &size) : NULL;
    const double *emission = alpha ? array(&arrays, given[3], "d", 0, &lit) : NULL;
    Py_ssize_t columns = emission ? PyLong_AsSsize_t(given[1]) : 0, wide = emission ? PyLong_AsSsize_t(given[4]) : 0;
    Py_ssize_t x = emission ? PyLong_AsSsize_t(given[5]) : 0, y = emission ? PyLong_AsSsize_t(given[6]) : 0;
    if (emission == NULL || PyErr_Occurred())
        goto done;
    const Py_ssize_t far = PY_SSIZE_T_MAX / 4;
    if (columns < 1 || wide < 1 || pixels % columns || size % wide || lit != size || x < -far || x > far || y < -far ||
        y > far) {
        PyErr_SetString(PyExc_ValueError, "lay: its arrays do not agree");
        goto done;
    }
    Overlap across = overlap(x, wide, columns), down = overlap(y, size / wide, pixels / columns);
    if (across.first == across.stop)
        down = (Overlap){0, 0};
    Totals sums = {0.0, 0.0, 0.0};
    for (Py_ssize_t row = down.first; row < down.stop; row++) {
        Py_ssize_t place = row * wide + across.first, length = across.stop - across.first;
        lay_row(light + (y + row) * columns + x + across.first, alpha + place, emission + place, length, &sums);
    }
    result = Py_BuildValue("(ddd)", sums.alpha, sums.emission, sums.behind);
done:
    release(&arrays);
    return result;
}

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
