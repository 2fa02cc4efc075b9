/* See irsim/shapes/silhouette.py, whose `spread` does the same with whole matrices, most of which are zero.
 *
 * The grid is gone through column by column: what changes in its cells is spread down over pixel rows and summed up
 * from the left, and the sum is spread across. The picture in work is held by columns, so that all inner loops run down
 * a column. */
#include "spread.h"

#include <string.h>

#include "wide.h"

/* What changes in a cell from the one on its left, its y moment, and its x moment. */
typedef struct {
    double even, y, x;
} Change;

typedef struct {
    Change opacity, glow;
    int touched;
} Cell;

/* Down a column of pixels: the running sums of what changes, and the x moments. */
typedef struct {
    double *changes, *moments;
} Column;

static inline void add(Change *sum, double weight, double even, double y, double x)
{
    sum->even += weight * even;
    sum->y += weight * y;
    sum->x += weight * x;
}

static inline void gather(const Touches *touches, int64_t column, Cell *cells)
{
    for (int32_t i = touches->last[column]; i >= 0; i = touches->of[i].next) {
        const Touch *touch = &touches->of[i];
        Cell *cell = &cells[touch->row];
        add(&cell->opacity, touch->opacity, touch->area, touch->y, touch->x);
        add(&cell->glow, touch->glow, touch->area, touch->y, touch->x);
        cell->touched = 1;
    }
    for (int32_t i = column ? touches->last[column - 1] : -1; i >= 0; i = touches->of[i].next) {
        const Touch *touch = &touches->of[i];
        Cell *cell = &cells[touch->row];
        add(&cell->opacity, touch->opacity, touch->area_beyond, touch->y_beyond, 0.0);
        add(&cell->glow, touch->glow, touch->area_beyond, touch->y_beyond, 0.0);
        cell->touched = 1;
    }
}

/* Each of `width` pixels gains its shares of a cell's light. */
static inline void spread_down(Change cell, const double *even, const double *slope, Py_ssize_t width,
                               double *restrict changes, double *restrict moments)
{
    for (Py_ssize_t i = 0; i < width; i++) {
        changes[i] += cell.even * even[i] + cell.y * slope[i];
        moments[i] += cell.x * even[i];
    }
}

/* Each of `width` pixel columns gains its shares of `count` pixels of a column. */
static inline void spread_across(Column column, Py_ssize_t count, const double *even, const double *slope,
                                 double weight, Py_ssize_t width, Py_ssize_t pixels, double *restrict picture)
{
    for (Py_ssize_t i = 0; i < width; i++) {
        double share = weight * even[i], rise = weight * slope[i];
        double *restrict lit = picture + i * pixels;
        for (Py_ssize_t k = 0; k < count; k++)
            lit[k] += share * column.changes[k] + rise * column.moments[k];
    }
}

/* alpha, emission: pictures held by columns; work: (4, pixel rows). */
WIDE static void spread_term(const Touches *touches, const Bands *rows, const Bands *columns, double weight,
                             Py_ssize_t term, Cell *cells, double *work, double *alpha, double *emission)
{
    Py_ssize_t pixels = rows->pixels, down = rows->width, across = columns->width, low = pixels, high = 0;
    const double *down_even = rows->shares + 2 * term * rows->cells * down;
    const double *down_slope = down_even + rows->cells * down;
    const double *across_even = columns->shares + 2 * term * columns->cells * across;
    const double *across_slope = across_even + columns->cells * across;
    Column opacity = {work, work + 2 * pixels}, glow = {work + pixels, work + 3 * pixels};
    memset(work, 0, 2 * (size_t)pixels * sizeof(double));
    for (Py_ssize_t column = 0; column < columns->cells; column++) {
        gather(touches, column, cells);
        memset(opacity.moments, 0, 2 * (size_t)pixels * sizeof(double));
        for (Py_ssize_t row = 0; row < rows->cells; row++) {
            if (!cells[row].touched)
                continue;
            Py_ssize_t first = rows->first[row];
            const double *even = down_even + row * down, *slope = down_slope + row * down;
            low = first < low ? first : low;
            high = first + down > high ? first + down : high;
            spread_down(cells[row].opacity, even, slope, down, opacity.changes + first, opacity.moments + first);
            spread_down(cells[row].glow, even, slope, down, glow.changes + first, glow.moments + first);
            cells[row] = (Cell){.touched = 0};
        }
        if (low >= high)
            continue;
        Column lit_opacity = {opacity.changes + low, opacity.moments + low};
        Column lit_glow = {glow.changes + low, glow.moments + low};
        const double *even = across_even + column * across, *slope = across_slope + column * across;
        Py_ssize_t place = columns->first[column] * pixels + low;
        spread_across(lit_opacity, high - low, even, slope, weight, across, pixels, alpha + place);
        spread_across(lit_glow, high - low, even, slope, weight, across, pixels, emission + place);
    }
}

/* Shares of pixels that are covered, before any blur: (pixel rows, pixel columns), all 0 before; work: (2, rows). */
static void add_cover(const Touches *touches, int64_t cells, int64_t fine, int64_t rows, double *work, double *cover,
                      Py_ssize_t stride)
{
    double *sums = work, *pixels = work + rows, part = 1.0 / (double)(fine * fine);
    memset(work, 0, 2 * (size_t)rows * sizeof(double));
    for (int64_t column = 0; column < cells; column++) {
        for (int32_t i = touches->last[column]; i >= 0; i = touches->of[i].next)
            sums[touches->of[i].row / fine] += touches->of[i].opacity * touches->of[i].area;
        for (int32_t i = column ? touches->last[column - 1] : -1; i >= 0; i = touches->of[i].next)
            sums[touches->of[i].row / fine] += touches->of[i].opacity * touches->of[i].area_beyond;
        for (int64_t row = 0; row < rows; row++)
            pixels[row] += sums[row];
        if ((column + 1) % fine)
            continue;
        for (int64_t row = 0; row < rows; row++) {
            cover[row * stride + column / fine] = pixels[row] * part;
            pixels[row] = 0.0;
        }
    }
}

int spread_touches(const Touches *touches, const Bands *rows, const Bands *columns, const double *weights,
                   Py_ssize_t terms, int64_t fine, int64_t margin, double *light)
{
    Py_ssize_t high = rows->pixels, wide = columns->pixels, size = high * wide;
    Scratch held = {.count = 0};
    Cell *cells = scratch(&held, rows->cells, sizeof(Cell));
    double *work = cells ? scratch(&held, 4 * high, sizeof(double)) : NULL;
    double *pictures = work ? scratch(&held, 2 * size, sizeof(double)) : NULL;
    if (pictures) {
        for (Py_ssize_t term = 0; term < terms; term++)
            spread_term(touches, rows, columns, weights[term], term, cells, work, pictures, pictures + size);
        memset(light, 0, (size_t)size * sizeof(double));
        add_cover(touches, columns->cells, fine, rows->cells / fine, work, light + margin * wide + margin, wide);
        for (Py_ssize_t which = 0; which < 2; which++)
            for (Py_ssize_t row = 0; row < high; row++)
                for (Py_ssize_t column = 0; column < wide; column++)
                    light[(1 + which) * size + row * wide + column] = pictures[which * size + column * high + row];
    }
    discard(&held);
    return pictures ? 0 : -1;
}
