/* Histograms of grey levels and gradients of windows of many sizes; see irtrack/features/gradients.py. */
#include "kernels.h"

/* Of all windows together: sizes in bytes do not overflow. */
#define MOST_PLACES ((Py_ssize_t)1 << 48)

/* Places of a pattern in windows: centre + scale * place, at the nearest pixel. */
typedef struct {
    Picture picture;
    const double *x, *y, *centers, *scales;
    Py_ssize_t columns, rows, windows;
} Places;

/* Arguments image, table, x (columns,), y (rows,), centers (N, 2), scales (N, 2). */
static Places places_in(Call *call)
{
    Places taken;
    Py_ssize_t centers, scales;
    taken.picture = binned_image(call, 0);
    taken.x = input(call, 2, "d", &taken.columns);
    taken.y = input(call, 3, "d", &taken.rows);
    taken.centers = input(call, 4, "d", &centers);
    taken.scales = input(call, 5, "d", &scales);
    if (call->failed)
        return taken;
    taken.windows = centers / 2;
    if (centers != 2 * taken.windows || scales != centers)
        wrong(call, "windows: lengths do not agree");
    else if (taken.picture.rows > MOST_PIXELS || taken.picture.columns > MOST_PIXELS || taken.columns < 1 ||
             taken.columns > MOST_PIXELS || taken.rows < 1 || taken.rows > MOST_PIXELS ||
             taken.windows > MOST_PLACES / (taken.rows * taken.columns))
        wrong(call, "windows: sizes out of range");
    return taken;
}

/* Writes the pixels of places on one axis, OUTSIDE beyond `edge`; the number within. */
static Py_ssize_t pixels_of(const double *places, Py_ssize_t count, double center, double scale, Py_ssize_t edge,
                            int32_t *pixels)
{
    Py_ssize_t within = 0;
    for (Py_ssize_t i = 0; i < count; i++) {
        double at = center + scale * places[i] + 0.5;
        pixels[i] = at >= 0 && at < (double)edge ? (int32_t)at : OUTSIDE;
        within += pixels[i] != OUTSIDE;
    }
    return within;
}

/* Writes the pixels of one window's places; the number of places in the picture. */
static Py_ssize_t places_of(const Places *seen, Py_ssize_t window, int32_t *x, int32_t *y)
{
    const double *center = seen->centers + 2 * window, *scale = seen->scales + 2 * window;
    return pixels_of(seen->x, seen->columns, center[0], scale[0], seen->picture.columns, x) *
           pixels_of(seen->y, seen->rows, center[1], scale[1], seen->picture.rows, y);
}

/* Writes the vertical halves of Sobel's operators, sums by 1, 2, 1 and differences of three rows, from one pixel before
 * column `first` to one after `last`. Beyond the edge its pixels are repeated. */
static void halves(const Picture *picture, Py_ssize_t row, Py_ssize_t first, Py_ssize_t last, int32_t *sums,
                   int32_t *differences)
{
    Py_ssize_t begin = first > 0 ? first - 1 : 0, end = last + 1 < picture->columns ? last + 2 : picture->columns;
    Py_ssize_t above = (row > 0 ? row - 1 : 0) * picture->columns, at = row * picture->columns;
    Py_ssize_t below = (row + 1 < picture->rows ? row + 1 : row) * picture->columns, pad = begin - (first - 1);
    for (Py_ssize_t x = begin; x < end; x++) {
        int32_t up = level_at(picture, above + x), down = level_at(picture, below + x);
        sums[x - begin + pad] = up + 2 * level_at(picture, at + x) + down;
        differences[x - begin + pad] = down - up;
    }
    if (pad == 1) {
        sums[0] = sums[1];
        differences[0] = differences[1];
    }
    Py_ssize_t after = end - begin + pad;
    if (end == last + 1) {
        sums[after] = sums[after - 1];
        differences[after] = differences[after - 1];
    }
}

/* Sobel gradients at the places of one window; none outside the picture. */
static void gradients_of(const Places *seen, const int32_t *x, const int32_t *y, int32_t *sums, int32_t *differences,
                         float *gx, float *gy)
{
    int32_t first = INT32_MAX, last = -1;
    for (Py_ssize_t j = 0; j < seen->columns; j++) {
        if (x[j] == OUTSIDE)
            continue;
        first = x[j] < first ? x[j] : first;
        last = x[j] > last ? x[j] : last;
    }
    for (Py_ssize_t i = 0; i < seen->rows; i++, gx += seen->columns, gy += seen->columns) {
        if (y[i] != OUTSIDE)
            halves(&seen->picture, y[i], first, last, sums, differences);
        for (Py_ssize_t j = 0; j < seen->columns; j++) {
            int inside = y[i] != OUTSIDE && x[j] != OUTSIDE;
            Py_ssize_t k = inside ? x[j] - first : 0; /* the pixel before it */
            gx[j] = inside ? (float)(sums[k + 2] - sums[k]) : 0;
            gy[j] = inside ? (float)(differences[k] + 2 * differences[k + 1] + differences[k + 2]) : 0;
        }
    }
}

KERNEL(window_gradients, 8)
{
    Py_ssize_t space, other, met = 0;
    Places seen = places_in(call);
    float *gx = output(call, 6, "f", &space), *gy = output(call, 7, "f", &other);
    if (call->failed)
        return NULL;
    Py_ssize_t places = seen.rows * seen.columns, span = seen.picture.columns + 2;
    if (space != seen.windows * places || other != space)
        return wrong(call, "window_gradients: lengths do not agree");
    int32_t *x = room(call, seen.columns + seen.rows, sizeof *x), *sums = room(call, 2 * span, sizeof *sums);
    if (call->failed)
        return NULL;
    for (Py_ssize_t window = 0; window < seen.windows; window++) {
        if (places_of(&seen, window, x, x + seen.columns) == 0)
            continue;
        gradients_of(&seen, x, x + seen.columns, sums, sums + span, gx + met * places, gy + met * places);
        met++;
    }
    return PyLong_FromSsize_t(met);
}

/* Weights of a window's places, and room for their directions and shares. */
typedef struct {
    const double *kernel;
    const unsigned char *edges;
    Py_ssize_t grey_bins, edge_bins;
    int32_t *directions;
    double *shares;
} Counting;

/* The bin of each angle, the nearest of `bins` directions. */
static void directions_of(const float *angle, Py_ssize_t count, Py_ssize_t bins, int32_t *directions)
{
    float turn = (float)((double)bins / (2 * 3.14159265358979323846)), most = (float)bins;
    for (Py_ssize_t i = 0; i < count; i++) {
        float at = angle[i] * turn + 0.5f;
        directions[i] = at > 0 && at < most ? (int32_t)at : 0; /* the last half bin belongs to the first */
    }
}

/* Adds up a window's places, and writes the kernel's share at each, 0 outside the picture. */
static void count_places(const Places *seen, const Counting *by, const int32_t *x, const int32_t *y,
                         const float *strength, double *grey, double *gradient)
{
    Py_ssize_t place = 0;
    for (Py_ssize_t i = 0; i < seen->rows; i++)
        for (Py_ssize_t j = 0; j < seen->columns; j++, place++) {
            by->shares[place] = 0;
            if (y[i] == OUTSIDE || x[j] == OUTSIDE)
                continue;
            Py_ssize_t bin = bin_at(&seen->picture, y[i], x[j]);
            by->shares[place] = by->kernel[place];
            grey[bin < by->grey_bins ? bin : by->grey_bins - 1] += by->kernel[place];
            gradient[by->directions[place]] += by->edges[place] ? (double)strength[place] : 0;
        }
}

KERNEL(window_cues, 13)
{
    Py_ssize_t weights, counted, strong, turned, greys, gradients, windows, met = 0, within = 0;
    Counting by;
    Places seen = places_in(call);
    by.kernel = input(call, 6, "d", &weights);
    by.edges = input(call, 7, "?", &counted);
    const float *strength = input(call, 8, "f", &strong), *angle = input(call, 9, "f", &turned);
    double *grey = output(call, 10, "d", &greys), *gradient = output(call, 11, "d", &gradients);
    double *visible = output(call, 12, "d", &windows);
    if (call->failed)
        return NULL;
    Py_ssize_t places = seen.rows * seen.columns;
    by.grey_bins = windows > 0 ? greys / windows : 1;
    by.edge_bins = windows > 0 ? gradients / windows : 1;
    if (windows != seen.windows || weights != places || counted != places || turned != strong || by.grey_bins < 1 ||
        by.edge_bins < 1 || greys != windows * by.grey_bins || gradients != windows * by.edge_bins)
        return wrong(call, "window_cues: lengths do not agree");
    int32_t *x = room(call, seen.columns + seen.rows, sizeof *x), *y = x + seen.columns;
    by.directions = room(call, places, sizeof *by.directions);
    by.shares = room(call, places, sizeof *by.shares);
    if (call->failed)
        return NULL;
    memset(grey, 0, (size_t)greys * sizeof *grey);
    memset(gradient, 0, (size_t)gradients * sizeof *gradient);
    for (Py_ssize_t window = 0; window < windows; window++) {
        Py_ssize_t inside = places_of(&seen, window, x, y);
        visible[window] = 0;
        if (inside == 0)
            continue;
        if ((met + 1) * places > strong)
            return wrong(call, "window_cues: strengths do not agree");
        double *own = grey + window * by.grey_bins, *edge = gradient + window * by.edge_bins;
        directions_of(angle + met * places, places, by.edge_bins, by.directions);
        count_places(&seen, &by, x, y, strength + met * places, own, edge);
        normalise(own, by.grey_bins);
        normalise(edge, by.edge_bins);
        visible[window] = pairwise_sum(by.shares, places);
        within += inside;
        met++;
    }
    for (Py_ssize_t window = 0; within == windows * places && window < windows; window++)
        visible[window] = 1;
    return done(call);
}
