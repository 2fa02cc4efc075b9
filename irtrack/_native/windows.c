/* Kernel-weighted histograms of many windows of one size; see irtrack/features/histogram.py. */
#include "windows.h"

#include <float.h>
#include <math.h>

#include "sums.h"

typedef struct {
    Py_ssize_t left, top, right, bottom;
} Bounds;

static Bounds bounds_of(const Py_ssize_t *corners, Py_ssize_t count)
{
    Bounds all = {corners[0], corners[1], corners[0], corners[1]};
    for (Py_ssize_t i = 1; i < count; i++) {
        Py_ssize_t x = corners[2 * i], y = corners[2 * i + 1];
        all.left = x < all.left ? x : all.left;
        all.right = x > all.right ? x : all.right;
        all.top = y < all.top ? y : all.top;
        all.bottom = y > all.bottom ? y : all.bottom;
    }
    return all;
}

/* The corner of a window at a centre; one wholly outside the frame sees nothing wherever it is, and is brought to the
 * frame's edge. */
static Py_ssize_t corner_of(double center, double reach, Py_ssize_t size, Py_ssize_t edge)
{
    double corner = floor(center - reach);
    if (!(corner > -(double)size)) /* nan, too */
        return -size;
    return corner < (double)edge ? (Py_ssize_t)corner : edge;
}

/* distinct_windows(centers, reach_x, reach_y, columns, rows, image_columns, image_rows, corners, places)
 * -> (distinct, left, top, right, bottom)
 *
 * Writes the corners of the distinct windows, row after row, and which of them each centre's is; gives the least and
 * the largest of the corners. */
PyObject *distinct_windows(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    if (count != 9) {
        PyErr_SetString(PyExc_TypeError, "distinct_windows takes 9 arguments");
        return NULL;
    }
    PyObject *result = NULL;
    unsigned char *taken = NULL;
    int32_t *order = NULL;
    Py_ssize_t length, room, kept, size[2], edge[2];
    const double *centers = array(&arrays, given[0], "d", 0, &length);
    Py_ssize_t *corners = centers ? array(&arrays, given[7], INTP, 1, &room) : NULL;
    Py_ssize_t *places = corners ? array(&arrays, given[8], INTP, 1, &kept) : NULL;
    if (places == NULL)
        goto done;
    double reach[2] = {PyFloat_AsDouble(given[1]), PyFloat_AsDouble(given[2])};
    for (int i = 0; i < 2; i++) {
        size[i] = PyLong_AsSsize_t(given[3 + i]);
        edge[i] = PyLong_AsSsize_t(given[5 + i]);
    }
    if (PyErr_Occurred())
        goto done;
    Py_ssize_t windows = kept;
    if (windows < 1 || windows > INT32_MAX || length != 2 * windows || room != length) {
        wrong("distinct_windows: lengths do not agree");
        goto done;
    }
    for (int i = 0; i < 2; i++)
        if (size[i] < 1 || size[i] > MOST_PIXELS || edge[i] < 0 || edge[i] > MOST_PIXELS) {
            wrong("distinct_windows: sizes out of range");
            goto done;
        }
    for (Py_ssize_t i = 0; i < length; i++)
        corners[i] = corner_of(centers[i], reach[i % 2], size[i % 2], edge[i % 2]);

    /* A window is known by where its corner lies among all corners, row after row. */
    Bounds all = bounds_of(corners, windows);
    Py_ssize_t across = all.right - all.left + 1, cells = across * (all.bottom - all.top + 1);
    taken = PyMem_Calloc((size_t)cells + 8, 1); /* read by eights */
    order = PyMem_Malloc((size_t)cells * sizeof *order);
    if (taken == NULL || order == NULL) {
        PyErr_NoMemory();
        goto done;
    }
    for (Py_ssize_t i = 0; i < windows; i++) {
        places[i] = (corners[2 * i + 1] - all.top) * across + corners[2 * i] - all.left;
        taken[places[i]] = 1;
    }
    int32_t distinct = 0;
    for (Py_ssize_t begin = 0; begin < cells; begin += 8) {
        uint64_t eight;
        memcpy(&eight, taken + begin, 8);
        if (eight == 0)
            continue;
        for (Py_ssize_t at = begin; at < begin + 8; at++) {
            if (taken[at]) {
                corners[2 * distinct] = all.left + at % across;
                corners[2 * distinct + 1] = all.top + at / across;
                order[at] = distinct++;
            }
        }
    }
    for (Py_ssize_t i = 0; i < windows; i++)
        places[i] = order[places[i]];
    result = Py_BuildValue("(nnnnn)", (Py_ssize_t)distinct, all.left, all.top, all.right, all.bottom);
done:
    PyMem_Free(taken);
    PyMem_Free(order);
    release(&arrays);
    return result;
}

/* The bins of a part of a picture, which may reach over its edge: the last of `held` there. */
static void cells_of(const Picture *picture, Bounds part, Py_ssize_t held, uint16_t *cells)
{
    uint16_t outside = (uint16_t)(held - 1);
    for (Py_ssize_t row = part.top; row < part.bottom; row++)
        for (Py_ssize_t column = part.left; column < part.right; column++) {
            int seen = row >= 0 && row < picture->rows && column >= 0 && column < picture->columns;
            uint16_t bin = seen ? bin_at(picture, row, column) : outside;
            *cells++ = bin < outside ? bin : outside;
        }
}

/* Adds the kernel to the bins of four windows by turns: into one bin, each sum waits for the last. */
static void count_four(const uint16_t *const at[4], Py_ssize_t stride, const double *kernel, Py_ssize_t rows,
                       Py_ssize_t columns, double *const mass[4])
{
    for (Py_ssize_t row = 0; row < rows; row++)
        for (Py_ssize_t column = 0; column < columns; column++) {
            Py_ssize_t cell = row * stride + column;
            double share = *kernel++;
            mass[0][at[0][cell]] += share;
            mass[1][at[1][cell]] += share;
            mass[2][at[2][cell]] += share;
            mass[3][at[3][cell]] += share;
        }
}

static void count_one(const uint16_t *at, Py_ssize_t stride, const double *kernel, Py_ssize_t rows,
                      Py_ssize_t columns, double *mass)
{
    for (Py_ssize_t row = 0; row < rows; row++)
        for (Py_ssize_t column = 0; column < columns; column++)
            mass[at[row * stride + column]] += *kernel++;
}

/* window_masses(image, table, corners, kernel, mass)
 *
 * Writes the kernel's mass in each bin of windows with their corners (N, 2); the last bin of `mass` (N, bins + 1)
 * holds what lies outside the picture. Sums are taken pixel after pixel, as numpy's bincount does. */
PyObject *window_masses(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    if (count != 5) {
        PyErr_SetString(PyExc_TypeError, "window_masses takes 5 arguments");
        return NULL;
    }
    PyObject *result = NULL;
    uint16_t *cells = NULL;
    Picture seen;
    Py_ssize_t numbers, size, room;
    if (!picture(&arrays, given[0], given[1], &seen))
        goto done;
    const Py_ssize_t *corners = array(&arrays, given[2], INTP, 0, &numbers);
    const double *kernel = corners ? array(&arrays, given[3], "d", 0, &size) : NULL;
    double *mass = kernel ? array(&arrays, given[4], "d", 1, &room) : NULL;
    if (mass == NULL)
        goto done;
    Py_ssize_t windows = numbers / 2, held = windows > 0 ? room / windows : 0;
    if (windows < 1 || size < 1 || held < 2 || held > UINT16_MAX || numbers != 2 * windows ||
        room != windows * held || arrays.of[3].ndim != 2) {
        wrong("window_masses: sizes do not agree");
        goto done;
    }
    Py_ssize_t rows = arrays.of[3].shape[0], columns = arrays.of[3].shape[1];
    Bounds part = bounds_of(corners, windows);
    if (part.left < -columns || part.top < -rows || part.right > seen.columns || part.bottom > seen.rows) {
        wrong("window_masses: a window away from the picture");
        goto done;
    }
    part.right += columns;
    part.bottom += rows;
    Py_ssize_t stride = part.right - part.left;
    cells = PyMem_Malloc((size_t)(stride * (part.bottom - part.top)) * sizeof *cells);
    if (cells == NULL) {
        PyErr_NoMemory();
        goto done;
    }
    cells_of(&seen, part, held, cells);
    memset(mass, 0, (size_t)room * sizeof *mass);
    const uint16_t *at[4];
    double *of[4];
    for (Py_ssize_t i = 0; i < windows; i++) {
        at[i % 4] = cells + (corners[2 * i + 1] - part.top) * stride + corners[2 * i] - part.left;
        of[i % 4] = mass + i * held;
        if (i % 4 == 3)
            count_four(at, stride, kernel, rows, columns, of);
    }
    for (Py_ssize_t i = 0; i < windows % 4; i++)
        count_one(at[i], stride, kernel, rows, columns, of[i]);
    result = Py_NewRef(Py_None);
done:
    PyMem_Free(cells);
    release(&arrays);
    return result;
}

/* surround_histograms(image, table, left, top, first, kernel, histograms, visible)
 *
 * Counts a window and the ring around it, their corner at (left, top): the bins of each pixel begin at `first`
 * (rows, columns), 0 or bins + 1. Writes the histograms (2, bins), each summing to one, and their visible shares (2,);
 * zeros of what is wholly outside the image. */
PyObject *surround_histograms(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    if (count != 8) {
        PyErr_SetString(PyExc_TypeError, "surround_histograms takes 8 arguments");
        return NULL;
    }
    PyObject *result = NULL;
    double *mass = NULL;
    Picture seen;
    Py_ssize_t size, weighed, room, two;
    if (!picture(&arrays, given[0], given[1], &seen))
        goto done;
    Py_ssize_t left = PyLong_AsSsize_t(given[2]), top = PyLong_AsSsize_t(given[3]);
    if (PyErr_Occurred())
        goto done;
    const Py_ssize_t *first = array(&arrays, given[4], INTP, 0, &size);
    const double *kernel = first ? array(&arrays, given[5], "d", 0, &weighed) : NULL;
    double *histograms = kernel ? array(&arrays, given[6], "d", 1, &room) : NULL;
    double *visible = histograms ? array(&arrays, given[7], "d", 1, &two) : NULL;
    if (visible == NULL)
        goto done;
    if (size < 1 || weighed != size || room < 2 || room % 2 != 0 || two != 2 || arrays.of[2].ndim != 2) {
        wrong("surround_histograms: sizes do not agree");
        goto done;
    }
    Py_ssize_t bins = room / 2, columns = arrays.of[2].shape[1];
    mass = PyMem_Calloc((size_t)room + 2, sizeof *mass);
    if (mass == NULL) {
        PyErr_NoMemory();
        goto done;
    }
    for (Py_ssize_t i = 0; i < size; i++) {
        /* Not added up, which could overflow: `left` is any number. */
        Py_ssize_t row = i / columns, column = i % columns;
        int inside = top >= -row && top < seen.rows - row && left >= -column && left < seen.columns - column;
        Py_ssize_t bin = inside ? bin_at(&seen, top + row, left + column) : bins;
        if (bin > bins || (first[i] != 0 && first[i] != bins + 1)) {
            wrong("surround_histograms: a bin beyond all");
            goto done;
        }
        mass[first[i] + bin] += kernel[i];
    }
    for (int part = 0; part < 2; part++) {
        const double *own = mass + part * (bins + 1);
        visible[part] = pairwise_sum(own, bins);
        double whole = visible[part] > DBL_MIN ? visible[part] : DBL_MIN; /* an empty one stays zero */
        for (Py_ssize_t u = 0; u < bins; u++)
            histograms[part * bins + u] = own[u] / whole;
    }
    result = Py_NewRef(Py_None);
done:
    PyMem_Free(mass);
    release(&arrays);
    return result;
}
