/* Histograms of oriented gradients of windows; see irtrack/features/hog.py. */
#include "kernels.h"

#define ORIENTATIONS 9
#define BLOCK_LENGTH (4 * ORIENTATIONS)

/* Places of the samples on one axis: the pixel before each, and the share of the next one. */
static void nodes(double center, double spacing, Py_ssize_t samples, Py_ssize_t count, int32_t *first, double *share)
{
    for (Py_ssize_t i = 0; i < samples; i++) {
        double at = center + spacing * ((double)i - (double)(samples - 1) / 2);
        at = at > 0 ? at : 0;
        at = at < (double)(count - 1) ? at : (double)(count - 1);
        first[i] = (int32_t)at < (int32_t)(count - 2) ? (int32_t)at : (int32_t)(count - 2);
        share[i] = at - first[i];
    }
}

/* Samples between two rows of the picture. */
WIDE static void sample_row(const float *upper, const float *lower, const int32_t *first, const double *share,
                            double down, Py_ssize_t columns, double *restrict row)
{
    for (Py_ssize_t x = 0; x < columns; x++) {
        Py_ssize_t k = first[x];
        double above = (double)upper[k] * (1 - share[x]) + (double)upper[k + 1] * share[x];
        double below = (double)lower[k] * (1 - share[x]) + (double)lower[k + 1] * share[x];
        row[x] = above * (1 - down) + below * down;
    }
}

/* Divides a block by its norm. */
WIDE static void unit(double *restrict block, double *restrict squares)
{
    for (int i = 0; i < BLOCK_LENGTH; i++)
        squares[i] = block[i] * block[i];
    double norm = sqrt(pairwise_sum(squares, BLOCK_LENGTH) + 1e-5 * 1e-5);
    for (int i = 0; i < BLOCK_LENGTH; i++)
        block[i] /= norm;
}

/* Layout of a window, and room: its samples, with a row before and after them, its cells, one row's gradients. */
typedef struct {
    Py_ssize_t columns, rows, cell, across, down;
    const double *bounds;
    double *samples, *cells, *gx, *gy, *strengths;
    int64_t *bins;
} Layout;

/* Strengths and orientations of gradients (gx, gy), which are turned to gy >= 0. */
WIDE static void polar(double *restrict gx, double *restrict gy, Py_ssize_t count, const double *restrict bounds,
                       double *restrict strengths, int64_t *restrict bins)
{
    for (Py_ssize_t x = 0; x < count; x++) {
        strengths[x] = sqrt(gx[x] * gx[x] + gy[x] * gy[x]);
        double sign = (gy[x] < 0) | ((gy[x] == 0) & (gx[x] < 0)) ? -1.0 : 1.0;
        gx[x] *= sign;
        gy[x] *= sign;
        bins[x] = 0;
    }
    for (int k = 0; k < ORIENTATIONS - 1; k++) {
        double c = bounds[2 * k], s = bounds[2 * k + 1];
        for (Py_ssize_t x = 0; x < count; x++)
            bins[x] += gy[x] * c - gx[x] * s >= 0 ? 1 : 0;
    }
}

/* Central differences of a row of samples, given the rows above and below it; 0 at its ends. */
WIDE static void differences(const double *row, const double *above, const double *below, Py_ssize_t columns,
                             double *restrict gx, double *restrict gy)
{
    for (Py_ssize_t x = 0; x < columns; x++)
        gy[x] = below[x] - above[x];
    for (Py_ssize_t x = 1; x < columns - 1; x++)
        gx[x] = row[x + 1] - row[x - 1];
    gx[0] = gx[columns - 1] = 0;
}

/* Adds up the strengths of the gradients of a window's samples by cell and orientation. */
static void count_cells(const Layout *of)
{
    memset(of->cells, 0, (size_t)(of->across * of->down * ORIENTATIONS) * sizeof *of->cells);
    for (Py_ssize_t y = 0; y < of->rows; y++) {
        const double *row = of->samples + (y + 1) * of->columns;
        Py_ssize_t inner = y > 0 && y < of->rows - 1 ? of->columns : 0;
        differences(row, row - inner, row + inner, of->columns, of->gx, of->gy);
        polar(of->gx, of->gy, of->columns, of->bounds, of->strengths, of->bins);
        double *cells = of->cells + (y / of->cell) * of->across * ORIENTATIONS;
        for (Py_ssize_t at = 0, x = 0; at < of->across; at++, cells += ORIENTATIONS)
            for (Py_ssize_t i = 0; i < of->cell; i++, x++)
                cells[of->bins[x]] += of->strengths[x];
    }
}

/* Writes the normalised blocks of a window. */
static void write_blocks(const Layout *of, double *vector)
{
    double squares[BLOCK_LENGTH], area = (double)(of->cell * of->cell);
    for (Py_ssize_t i = 0; i < of->across * of->down * ORIENTATIONS; i++)
        of->cells[i] /= area;
    for (Py_ssize_t y = 0; y + 1 < of->down; y++)
        for (Py_ssize_t x = 0; x + 1 < of->across; x++, vector += BLOCK_LENGTH) {
            for (int part = 0; part < 4; part++)
                memcpy(vector + part * ORIENTATIONS,
                       of->cells + ((y + part / 2) * of->across + x + part % 2) * ORIENTATIONS,
                       ORIENTATIONS * sizeof *vector);
            unit(vector, squares);
            for (int i = 0; i < BLOCK_LENGTH; i++)
                vector[i] = vector[i] < 0.2 ? vector[i] : 0.2;
            unit(vector, squares);
        }
}

/* Arguments: picture (R, C), windows (N, 4): x, y, spacing x, y; bounds (8, 2), columns, rows, cell, vectors (N, L). */
KERNEL(hog_windows, 7)
{
    Py_ssize_t pixels, given, directions, space;
    Layout of;
    const float *picture = input(call, 0, "f", &pixels);
    Py_ssize_t height = 0, width = 0;
    if (!call->failed && last(call)->ndim == 2) {
        height = last(call)->shape[0];
        width = last(call)->shape[1];
    }
    const double *windows = input(call, 1, "d", &given);
    of.bounds = input(call, 2, "d", &directions);
    of.columns = whole(call, 3);
    of.rows = whole(call, 4);
    of.cell = whole(call, 5);
    double *vectors = output(call, 6, "d", &space);
    if (call->failed)
        return NULL;
    if (height < 2 || width < 2 || height > MOST_PIXELS || width > MOST_PIXELS || of.cell < 1 || of.columns > 4096 ||
        of.rows > 4096 || of.columns < 2 * of.cell || of.rows < 2 * of.cell || of.columns % of.cell ||
        of.rows % of.cell || directions != 2 * (ORIENTATIONS - 1))
        return wrong(call, "hog_windows: sizes out of range");
    of.across = of.columns / of.cell;
    of.down = of.rows / of.cell;
    Py_ssize_t count = given / 4, length = (of.across - 1) * (of.down - 1) * BLOCK_LENGTH;
    if (given != 4 * count || space != count * length)
        return wrong(call, "hog_windows: lengths do not agree");
    of.samples = room(call, (of.rows + 2) * of.columns, sizeof *of.samples);
    of.cells = room(call, of.across * of.down * ORIENTATIONS, sizeof *of.cells);
    of.gx = room(call, 3 * of.columns, sizeof *of.gx);
    of.gy = of.gx + of.columns;
    of.strengths = of.gy + of.columns;
    of.bins = room(call, of.columns, sizeof *of.bins);
    int32_t *x0 = room(call, of.columns + of.rows, sizeof *x0), *y0 = x0 + of.columns;
    double *fx = room(call, of.columns + of.rows, sizeof *fx), *fy = fx + of.columns;
    if (call->failed)
        return NULL;
    for (Py_ssize_t window = 0; window < count; window++, windows += 4, vectors += length) {
        nodes(windows[0], windows[2], of.columns, width, x0, fx);
        nodes(windows[1], windows[3], of.rows, height, y0, fy);
        for (Py_ssize_t y = 0; y < of.rows; y++)
            sample_row(picture + y0[y] * width, picture + (y0[y] + 1) * width, x0, fx, fy[y], of.columns,
                       of.samples + (y + 1) * of.columns);
        count_cells(&of);
        write_blocks(&of, vectors);
    }
    return done(call);
}
