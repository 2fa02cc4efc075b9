/* Grey levels and gradients at the places of windows of many sizes; see irtrack/features/cues.py. */
#include "cues.h"

#include <float.h>
#include <math.h>

#include "sums.h"

/* Of all windows together: sizes in bytes do not overflow. */
#define MOST_PLACES ((Py_ssize_t)1 << 48)

/* Windows, and where a pattern of places lies in each: centre + scale * place, at the nearest pixel. */
typedef struct {
    Picture picture;
    const double *x, *y, *centers, *scales;
    Py_ssize_t columns, rows, windows;
} Sights;

/* Takes the arguments image, table, x (columns,), y (rows,), centers (N, 2), scales (N, 2); 0 with an exception. */
static int sights(Arrays *arrays, PyObject *const *given, Sights *taken)
{
    Py_ssize_t centers, scales;
    if (!picture(arrays, given[0], given[1], &taken->picture))
        return 0;
    taken->x = array(arrays, given[2], "d", 0, &taken->columns);
    taken->y = taken->x ? array(arrays, given[3], "d", 0, &taken->rows) : NULL;
    taken->centers = taken->y ? array(arrays, given[4], "d", 0, &centers) : NULL;
    taken->scales = taken->centers ? array(arrays, given[5], "d", 0, &scales) : NULL;
    if (taken->scales == NULL)
        return 0;
    taken->windows = centers / 2;
    if (centers != 2 * taken->windows || scales != centers)
        return wrong("windows: lengths do not agree");
    if (taken->picture.rows > MOST_PIXELS || taken->picture.columns > MOST_PIXELS || taken->columns < 1 ||
        taken->columns > MOST_PIXELS || taken->rows < 1 || taken->rows > MOST_PIXELS ||
        taken->windows > MOST_PLACES / (taken->rows * taken->columns))
        return wrong("windows: sizes out of range");
    return 1;
}

/* The pixels of places on one axis, OUTSIDE beyond `edge`; how many are within. */
static Py_ssize_t pixels_of(const double *places, Py_ssize_t count, double center, double scale, Py_ssize_t edge,
                            int32_t *pixels)
{
    Py_ssize_t within = 0;
    for (Py_ssize_t i = 0; i < count; i++) {
        double at = center + scale * places[i] + 0.5; /* not below 0, so that what is cut off is the fraction */
        pixels[i] = at >= 0 && at < (double)edge ? (int32_t)at : OUTSIDE;
        within += pixels[i] != OUTSIDE;
    }
    return within;
}

/* Of one window: the pixels of its places, and how many places are in the picture. */
static Py_ssize_t places_of(const Sights *seen, Py_ssize_t window, int32_t *x, int32_t *y)
{
    const double *center = seen->centers + 2 * window, *scale = seen->scales + 2 * window;
    return pixels_of(seen->x, seen->columns, center[0], scale[0], seen->picture.columns, x) *
           pixels_of(seen->y, seen->rows, center[1], scale[1], seen->picture.rows, y);
}

/* Room for the pixels of a window's places, columns before rows. */
static int32_t *make_places(const Sights *seen)
{
    return PyMem_Malloc((size_t)(seen->columns + seen->rows) * sizeof(int32_t));
}

/* Across the rows above, at and below `row`, from one pixel before column `first` to one after `last`: sums by
 * 1, 2, 1 and differences, the vertical halves of Sobel's operators. Beyond the edge its last pixels go on. */
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
static void gradients_of(const Sights *seen, const int32_t *x, const int32_t *y, int32_t *sums, int32_t *differences,
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

/* window_gradients(image, table, x, y, centers, scales, gx, gy) -> windows that have a place in the picture
 *
 * Writes Gx and Gy (N, rows, columns) of those, one after the other. */
PyObject *window_gradients(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    if (count != 8) {
        PyErr_SetString(PyExc_TypeError, "window_gradients takes 8 arguments");
        return NULL;
    }
    PyObject *result = NULL;
    int32_t *x = NULL, *sums = NULL;
    Sights seen;
    Py_ssize_t room, other, met = 0;
    if (!sights(&arrays, given, &seen))
        goto done;
    float *gx = array(&arrays, given[6], "f", 1, &room);
    float *gy = gx ? array(&arrays, given[7], "f", 1, &other) : NULL;
    if (gy == NULL)
        goto done;
    Py_ssize_t places = seen.rows * seen.columns, span = seen.picture.columns + 2;
    if (room != seen.windows * places || other != room) {
        wrong("window_gradients: lengths do not agree");
        goto done;
    }
    x = make_places(&seen);
    sums = x ? PyMem_Malloc(2 * (size_t)span * sizeof *sums) : NULL;
    if (sums == NULL) {
        PyErr_NoMemory();
        goto done;
    }
    int32_t *y = x + seen.columns;
    for (Py_ssize_t window = 0; window < seen.windows; window++) {
        if (places_of(&seen, window, x, y) == 0)
            continue;
        gradients_of(&seen, x, y, sums, sums + span, gx + met * places, gy + met * places);
        met++;
    }
    result = PyLong_FromSsize_t(met);
done:
    PyMem_Free(x);
    PyMem_Free(sums);
    release(&arrays);
    return result;
}

/* What a window's places count by, and what they are counted into. */
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
static void count_places(const Sights *seen, const Counting *by, const int32_t *x, const int32_t *y,
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

static void to_one(double *mass, Py_ssize_t bins)
{
    double whole = pairwise_sum(mass, bins);
    whole = whole > DBL_MIN ? whole : DBL_MIN; /* an empty one stays zero */
    for (Py_ssize_t u = 0; u < bins; u++)
        mass[u] /= whole;
}

/* window_cues(image, table, x, y, centers, scales, kernel, edges, strength, angle, grey, gradient, visible)
 *
 * Histograms (N, bins) of grey levels by the kernel (rows, columns), and (N, bins) of directions by their strength
 * where `edges` (rows, columns) are, each summing to one, and the kernel's visible share (N,). strength and angle
 * (n, rows, columns) are those of the n windows that have a place in the picture. Sums as numpy takes them. */
PyObject *window_cues(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    if (count != 13) {
        PyErr_SetString(PyExc_TypeError, "window_cues takes 13 arguments");
        return NULL;
    }
    PyObject *result = NULL;
    int32_t *x = NULL;
    Sights seen;
    Counting by = {.directions = NULL, .shares = NULL};
    Py_ssize_t weighed, counted, strong, turned, greys, gradients, windows, met = 0, within = 0;
    if (!sights(&arrays, given, &seen))
        goto done;
    by.kernel = array(&arrays, given[6], "d", 0, &weighed);
    by.edges = by.kernel ? array(&arrays, given[7], "?", 0, &counted) : NULL;
    const float *strength = by.edges ? array(&arrays, given[8], "f", 0, &strong) : NULL;
    const float *angle = strength ? array(&arrays, given[9], "f", 0, &turned) : NULL;
    double *grey = angle ? array(&arrays, given[10], "d", 1, &greys) : NULL;
    double *gradient = grey ? array(&arrays, given[11], "d", 1, &gradients) : NULL;
    double *visible = gradient ? array(&arrays, given[12], "d", 1, &windows) : NULL;
    if (visible == NULL)
        goto done;
    Py_ssize_t places = seen.rows * seen.columns;
    by.grey_bins = windows > 0 ? greys / windows : 1;
    by.edge_bins = windows > 0 ? gradients / windows : 1;
    if (windows != seen.windows || weighed != places || counted != places || turned != strong || by.grey_bins < 1 ||
        by.edge_bins < 1 || greys != windows * by.grey_bins || gradients != windows * by.edge_bins) {
        wrong("window_cues: lengths do not agree");
        goto done;
    }
    x = make_places(&seen);
    by.directions = x ? PyMem_Malloc((size_t)places * sizeof *by.directions) : NULL;
    by.shares = by.directions ? PyMem_Malloc((size_t)places * sizeof *by.shares) : NULL;
    if (by.shares == NULL) {
        PyErr_NoMemory();
        goto done;
    }
    int32_t *y = x + seen.columns;
    memset(grey, 0, (size_t)greys * sizeof *grey);
    memset(gradient, 0, (size_t)gradients * sizeof *gradient);
    for (Py_ssize_t window = 0; window < windows; window++) {
        Py_ssize_t inside = places_of(&seen, window, x, y);
        visible[window] = 0;
        if (inside == 0)
            continue;
        if ((met + 1) * places > strong) {
            wrong("window_cues: strengths do not agree");
            goto done;
        }
        double *own = grey + window * by.grey_bins, *edge = gradient + window * by.edge_bins;
        directions_of(angle + met * places, places, by.edge_bins, by.directions);
        count_places(&seen, &by, x, y, strength + met * places, own, edge);
        to_one(own, by.grey_bins);
        to_one(edge, by.edge_bins);
        visible[window] = pairwise_sum(by.shares, places);
        within += inside;
        met++;
    }
    if (within == windows * places)
        for (Py_ssize_t window = 0; window < windows; window++)
            visible[window] = 1;
    result = Py_NewRef(Py_None);
done:
    PyMem_Free(x);
    PyMem_Free(by.directions);
    PyMem_Free(by.shares);
    release(&arrays);
    return result;
}
