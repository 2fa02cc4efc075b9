/* Kernel-weighted histograms of windows of one size, and their similarity; see irtrack/features/histogram.py. */
#include "kernels.h"

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

/* Corner of a window at a centre; a window wholly outside the frame is brought to its edge, where it is as empty. */
static Py_ssize_t corner_of(double center, double offset, Py_ssize_t size, Py_ssize_t edge)
{
    double corner = floor(center - offset);
    if (!(corner > -(double)size)) /* nan, too */
        return -size;
    return corner < (double)edge ? (Py_ssize_t)corner : edge;
}

KERNEL(distinct_windows, 9)
{
    Py_ssize_t length, space, windows, size[2], edge[2];
    double offset[2];
    const double *centers = input(call, 0, "d", &length);
    for (int i = 0; i < 2; i++) {
        offset[i] = number(call, 1 + i);
        size[i] = whole(call, 3 + i);
        edge[i] = whole(call, 5 + i);
    }
    Py_ssize_t *corners = output(call, 7, INTP, &space), *places = output(call, 8, INTP, &windows);
    if (call->failed)
        return NULL;
    if (windows < 1 || windows > INT32_MAX || length != 2 * windows || space != length)
        return wrong(call, "distinct_windows: lengths do not agree");
    for (int i = 0; i < 2; i++)
        if (size[i] < 1 || size[i] > MOST_PIXELS || edge[i] < 0 || edge[i] > MOST_PIXELS)
            return wrong(call, "distinct_windows: sizes out of range");
    for (Py_ssize_t i = 0; i < length; i++)
        corners[i] = corner_of(centers[i], offset[i % 2], size[i % 2], edge[i % 2]);

    /* A window's key is the place of its corner among all corners, row after row. */
    Bounds all = bounds_of(corners, windows);
    Py_ssize_t across = all.right - all.left + 1, cells = across * (all.bottom - all.top + 1);
    unsigned char *used = room(call, cells + 8, 1); /* read by eights */
    int32_t *order = room(call, cells, sizeof *order), distinct = 0;
    if (call->failed)
        return NULL;
    for (Py_ssize_t i = 0; i < windows; i++) {
        places[i] = (corners[2 * i + 1] - all.top) * across + corners[2 * i] - all.left;
        used[places[i]] = 1;
    }
    for (Py_ssize_t begin = 0; begin < cells; begin += 8) {
        uint64_t eight;
        memcpy(&eight, used + begin, 8);
        for (Py_ssize_t at = begin; eight != 0 && at < begin + 8; at++)
            if (used[at]) {
                corners[2 * distinct] = all.left + at % across;
                corners[2 * distinct + 1] = all.top + at / across;
                order[at] = distinct++;
            }
    }
    for (Py_ssize_t i = 0; i < windows; i++)
        places[i] = order[places[i]];
    return Py_BuildValue("(nnnnn)", (Py_ssize_t)distinct, all.left, all.top, all.right, all.bottom);
}

/* Writes the bins of a part of a picture that may reach beyond its edge: the last of `held` there. */
static void cells_of(const Picture *picture, Bounds part, Py_ssize_t held, uint16_t *cells)
{
    uint16_t outside = (uint16_t)(held - 1);
    for (Py_ssize_t row = part.top; row < part.bottom; row++)
        for (Py_ssize_t column = part.left; column < part.right; column++) {
            int inside = row >= 0 && row < picture->rows && column >= 0 && column < picture->columns;
            uint16_t bin = inside ? bin_at(picture, row, column) : outside;
            *cells++ = bin < outside ? bin : outside;
        }
}

/* Adds the kernel to the bins of four windows, in turn, too. */
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

/* Adds two kernels to the bins of one window, in turn: sums in one bin wait for each other. */
static void count_both(const uint16_t *at, const double *kernel, Py_ssize_t pixels, double *mass, Py_ssize_t held)
{
    for (Py_ssize_t i = 0; i < pixels; i++) {
        mass[at[i]] += kernel[i];
        mass[held + at[i]] += kernel[pixels + i];
    }
}

static void count_one(const uint16_t *at, Py_ssize_t stride, const double *kernel, Py_ssize_t rows,
                      Py_ssize_t columns, double *mass)
{
    for (Py_ssize_t row = 0; row < rows; row++)
        for (Py_ssize_t column = 0; column < columns; column++)
            mass[at[row * stride + column]] += *kernel++;
}

/* Sums are taken pixel after pixel, as in numpy's bincount. */
KERNEL(window_histograms, 6)
{
    Py_ssize_t numbers, size, space, shares;
    Picture seen = binned_image(call, 0);
    const Py_ssize_t *corners = input(call, 2, INTP, &numbers);
    const double *kernel = input(call, 3, "d", &size);
    if (call->failed)
        return NULL;
    int axes = last(call)->ndim;
    Py_ssize_t kernels = axes == 3 ? last(call)->shape[0] : 1;
    Py_ssize_t rows = axes >= 2 ? last(call)->shape[axes - 2] : 0, columns = axes >= 2 ? last(call)->shape[axes - 1] : 0;
    double *mass = output(call, 4, "d", &space), *visible = output(call, 5, "d", &shares);
    if (call->failed)
        return NULL;
    Py_ssize_t windows = numbers / 2, all = windows * kernels, held = all > 0 ? space / all : 0;
    if (all < 1 || rows < 1 || columns < 1 || size != kernels * rows * columns || held < 2 || held > UINT16_MAX ||
        numbers != 2 * windows || space != all * held || (shares != 0 && shares != all))
        return wrong(call, "window_histograms: sizes do not agree");
    Bounds part = bounds_of(corners, windows);
    if (part.left < -columns || part.top < -rows || part.right > seen.columns || part.bottom > seen.rows)
        return wrong(call, "window_histograms: a window away from the picture");
    part.right += columns;
    part.bottom += rows;
    Py_ssize_t stride = part.right - part.left;
    uint16_t *cells = room(call, stride * (part.bottom - part.top), sizeof *cells);
    if (call->failed)
        return NULL;
    cells_of(&seen, part, held, cells);
    memset(mass, 0, (size_t)space * sizeof *mass);
    if (windows == 1 && kernels == 2)
        count_both(cells, kernel, rows * columns, mass, held);
    else for (Py_ssize_t k = 0; k < kernels; k++, kernel += rows * columns) {
        const uint16_t *at[4];
        double *of[4];
        for (Py_ssize_t i = 0; i < windows; i++) {
            at[i % 4] = cells + (corners[2 * i + 1] - part.top) * stride + corners[2 * i] - part.left;
            of[i % 4] = mass + (i * kernels + k) * held;
            if (i % 4 == 3)
                count_four(at, stride, kernel, rows, columns, of);
        }
        for (Py_ssize_t i = 0; i < windows % 4; i++)
            count_one(at[i], stride, kernel, rows, columns, of[i]);
    }
    for (Py_ssize_t i = 0; i < shares; i++)
        visible[i] = normalise(mass + i * held, held - 1);
    return done(call);
}

/* rho[i] = sum_u sqrt(p[i, u]) root[u], at most 1; four partial sums. */
WIDE static void coefficients(const double *p, Py_ssize_t held, const double *root, Py_ssize_t bins, double *rho,
                              Py_ssize_t count)
{
    for (Py_ssize_t i = 0; i < count; i++, p += held) {
        double of[4] = {0, 0, 0, 0};
        Py_ssize_t u = 0;
        for (; u + 4 <= bins; u += 4)
            for (int j = 0; j < 4; j++)
                of[j] += sqrt(p[u + j]) * root[u + j];
        double sum = (of[0] + of[1]) + (of[2] + of[3]);
        for (; u < bins; u++)
            sum += sqrt(p[u]) * root[u];
        rho[i] = sum > 1 ? 1 : sum;
    }
}

KERNEL(bhattacharyya, 3)
{
    Py_ssize_t size, bins, rows;
    const double *p = input(call, 0, "d", &size), *q = input(call, 1, "d", &bins);
    double *rho = output(call, 2, "d", &rows);
    if (call->failed)
        return NULL;
    Py_ssize_t held = rows > 0 ? size / rows : bins;
    if (held * rows != size || held < bins)
        return wrong(call, "bhattacharyya: a mismatch, fewer bins than the reference");
    double *root = room(call, bins, sizeof *root);
    if (call->failed)
        return NULL;
    for (Py_ssize_t u = 0; u < bins; u++)
        root[u] = sqrt(q[u]);
    coefficients(p, held, root, bins, rho, rows);
    return done(call);
}
