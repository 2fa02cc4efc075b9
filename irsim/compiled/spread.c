/* See irsim/shapes/silhouette.py, whose `spread` does the same with whole matrices, most of which are zero.
 *
 * The grid is gone through column by column: what changes in its cells is spread down over pixel rows and summed up
 * from the left, and the sum is spread across. The picture in work is held by columns, so that all inner loops run down
 * a column. */
#include "spread.h"

#include <string.h>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define WIDE __attribute__((target_clones("avx2", "default")))
#else
#define WIDE
#endif

/* Of a cell, or of a pixel on the way: what changes from the left in opacity and glow, and their x moments. */
typedef struct {
    double opacity, glow, opacity_x, glow_x;
} Change;

/* What changes in a cell of the column at hand; its y moments only spread down. */
typedef struct {
    Change even;
    double opacity_y, glow_y;
    int touched;
} Cell;

/* Down a column of pixels, those of each kind side by side. */
typedef struct {
    double *opacity, *glow, *opacity_x, *glow_x;
} Column;

static inline void gather(const Touches *touches, int64_t column, Cell *cells)
{
    for (int64_t i = touches->last[column]; i >= 0; i = touches->of[i].next) {
        const Touch *touch = &touches->of[i];
        Cell *cell = &cells[touch->row];
        cell->touched = 1;
        cell->even.opacity += touch->opacity * touch->area;
        cell->even.glow += touch->glow * touch->area;
        cell->even.opacity_x += touch->opacity * touch->x;
        cell->even.glow_x += touch->glow * touch->x;
        cell->opacity_y += touch->opacity * touch->y;
        cell->glow_y += touch->glow * touch->y;
    }
    for (int64_t i = column ? touches->last[column - 1] : -1; i >= 0; i = touches->of[i].next) {
        const Touch *touch = &touches->of[i];
        Cell *cell = &cells[touch->row];
        cell->touched = 1;
        cell->even.opacity += touch->opacity * touch->area_beyond;
        cell->even.glow += touch->glow * touch->area_beyond;
        cell->opacity_y += touch->opacity * touch->y_beyond;
        cell->glow_y += touch->glow * touch->y_beyond;
    }
}

/* Each of `width` pixels gains its shares of a cell's light. */
static inline void spread_down(const Cell *cell, const double *even, const double *slope, Py_ssize_t width,
                               Change *restrict sums)
{
    for (Py_ssize_t i = 0; i < width; i++) {
        sums[i].opacity += cell->even.opacity * even[i] + cell->opacity_y * slope[i];
        sums[i].glow += cell->even.glow * even[i] + cell->glow_y * slope[i];
        sums[i].opacity_x += cell->even.opacity_x * even[i];
        sums[i].glow_x += cell->even.glow_x * even[i];
    }
}

/* Each of `width` pixel columns gains its shares of what changes down a column and its moments. */
static inline void spread_across(const double *changes, const double *moments, Py_ssize_t count, const double *even,
                                 const double *slope, double weight, Py_ssize_t width, Py_ssize_t pixels,
                                 double *restrict picture)
{
    for (Py_ssize_t i = 0; i < width; i++) {
        double share = weight * even[i], rise = weight * slope[i];
        double *column = picture + i * pixels;
        for (Py_ssize_t k = 0; k < count; k++)
            column[k] += share * changes[k] + rise * moments[k];
    }
}

/* alpha, emission: pictures held by columns. */
WIDE static void spread_term(const Touches *touches, const Bands *rows, const Bands *columns, double weight,
                             Py_ssize_t term, Cell *cells, Change *sums, const Column *planes, double *alpha,
                             double *emission)
{
    Py_ssize_t down = rows->width, across = columns->width, low = rows->pixels, high = 0;
    const double *down_even = rows->shares + 2 * term * rows->cells * down;
    const double *down_slope = down_even + rows->cells * down;
    const double *across_even = columns->shares + 2 * term * columns->cells * across;
    const double *across_slope = across_even + columns->cells * across;
    memset(sums, 0, (size_t)rows->pixels * sizeof(Change));
    for (Py_ssize_t column = 0; column < columns->cells; column++) {
        gather(touches, column, cells);
        for (Py_ssize_t row = 0; row < rows->cells; row++) {
            if (!cells[row].touched)
                continue;
            Py_ssize_t first = rows->first[row];
            low = first < low ? first : low;
            high = first + down > high ? first + down : high;
            spread_down(&cells[row], down_even + row * down, down_slope + row * down, down, sums + first);
            cells[row] = (Cell){.touched = 0};
        }
        Py_ssize_t place = columns->first[column] * rows->pixels + low, count = high > low ? high - low : 0;
        for (Py_ssize_t k = 0; k < count; k++) {
            Change *each = &sums[low + k];
            planes->opacity[k] = each->opacity;
            planes->glow[k] = each->glow;
            planes->opacity_x[k] = each->opacity_x;
            planes->glow_x[k] = each->glow_x;
            each->opacity_x = each->glow_x = 0.0;
        }
        const double *even = across_even + column * across, *slope = across_slope + column * across;
        spread_across(planes->opacity, planes->opacity_x, count, even, slope, weight, across, rows->pixels,
                      alpha + place);
        spread_across(planes->glow, planes->glow_x, count, even, slope, weight, across, rows->pixels, emission + place);
    }
}

/* Shares of pixels that are covered, before any blur: (pixel rows, pixel columns), all 0 before. */
static void add_cover(const Touches *touches, int64_t cells, int64_t fine, int64_t rows, double *sums, double *cover,
                      Py_ssize_t stride)
{
    double part = 1.0 / (double)(fine * fine);
    memset(sums, 0, (size_t)rows * sizeof(double));
    for (int64_t column = 0; column < cells; column++) {
        for (int64_t i = touches->last[column]; i >= 0; i = touches->of[i].next)
            sums[touches->of[i].row / fine] += touches->of[i].opacity * touches->of[i].area;
        for (int64_t i = column ? touches->last[column - 1] : -1; i >= 0; i = touches->of[i].next)
            sums[touches->of[i].row / fine] += touches->of[i].opacity * touches->of[i].area_beyond;
        for (int64_t row = 0; row < rows; row++)
            cover[row * stride + column / fine] += sums[row] * part;
    }
}

int spread_touches(const Touches *touches, const Bands *rows, const Bands *columns, const double *weights,
                   Py_ssize_t terms, int64_t fine, int64_t margin, double *light)
{
    Py_ssize_t high = rows->pixels, wide = columns->pixels, size = high * wide;
    Scratch held = {.count = 0};
    Cell *cells = scratch(&held, rows->cells, sizeof(Cell));
    Change *sums = cells ? scratch(&held, high, sizeof(Change)) : NULL;
    double *work = sums ? scratch(&held, 4 * high, sizeof(double)) : NULL;
    double *pictures = work ? scratch(&held, 2 * size, sizeof(double)) : NULL;
    if (pictures) {
        Column planes = {work, work + high, work + 2 * high, work + 3 * high};
        for (Py_ssize_t term = 0; term < terms; term++)
            spread_term(touches, rows, columns, weights[term], term, cells, sums, &planes, pictures, pictures + size);
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
