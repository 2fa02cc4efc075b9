/* A sprite drawn over an image (see irsim/render/composite.py), and the clutter around a box (contrast.py). */
#include "kernels.h"

/* The part of 0 .. length - 1 that lies within 0 .. end - 1 when shifted by `origin`. */
typedef struct {
    Py_ssize_t first, stop;
} Overlap;

static Overlap overlap(Py_ssize_t origin, Py_ssize_t length, Py_ssize_t end)
{
    Overlap found = {origin < 0 ? -origin : 0, origin < end - length ? length : end - origin};
    return found.first < found.stop ? found : (Overlap){0, 0};
}

/* Sums over the pixels of a patch that are in the picture. */
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

KERNEL(lay, 7)
{
    Py_ssize_t pixels, size, lit;
    float *light = output(call, 0, "f", &pixels);
    const double *alpha = input(call, 2, "d", &size), *emission = input(call, 3, "d", &lit);
    const Py_ssize_t columns = whole(call, 1), wide = whole(call, 4), x = whole(call, 5), y = whole(call, 6);
    const Py_ssize_t far = PY_SSIZE_T_MAX / 4;
    if (call->failed)
        return NULL;
    if (columns < 1 || wide < 1 || pixels % columns || size % wide || lit != size || x < -far || x > far || y < -far ||
        y > far)
        return wrong(call, "lay: its arrays do not agree");
    Overlap across = overlap(x, wide, columns), down = overlap(y, size / wide, pixels / columns);
    if (across.first == across.stop)
        down = (Overlap){0, 0};
    Totals sums = {0.0, 0.0, 0.0};
    for (Py_ssize_t row = down.first; row < down.stop; row++) {
        Py_ssize_t place = row * wide + across.first, length = across.stop - across.first;
        lay_row(light + (y + row) * columns + x + across.first, alpha + place, emission + place, length, &sums);
    }
    return Py_BuildValue("(ddd)", sums.alpha, sums.emission, sums.behind);
}

typedef struct {
    int64_t first, stop;
} Range;

/* Pixels along one axis in the box, in the ring and in the guard. */
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

/* Share of a pixel that is in the box. */
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

KERNEL(clutter, 8)
{
    Py_ssize_t pixels;
    const float *picture = input(call, 0, "f", &pixels);
    const int64_t columns = whole(call, 1);
    const double ring = number(call, 6), guard = number(call, 7);
    const double cx = number(call, 2), cy = number(call, 3), w = number(call, 4), h = number(call, 5);
    if (call->failed)
        return NULL;
    if (columns < 1 || pixels % columns || !(guard <= ring))
        return wrong(call, "clutter: a picture of whole rows is required, and a guard within the ring");
    const Line across = line_of(columns, cx, w, ring, guard), down = line_of(pixels / columns, cy, h, ring, guard);
    const Clutter found = around(picture, columns, &down, &across);
    return Py_BuildValue("(ddd)", found.signal, found.level, found.spread);
}
