/* See irsim/shapes/silhouette.py, whose `spread` does the same with whole matrices, most of which are zero.
 *
 * The grid is gone through column by column: its touches are spread down over pixel rows, what they change is summed
 * up from the left, and the sum is spread across. Pictures in work are held by columns, so that all inner loops run
 * down a column. */
#include "spread.h"

#include <string.h>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define WIDE __attribute__((target_clones("avx2", "default")))
#else
#define WIDE
#endif

/* Down one column: the running sums of what changes, and the x moments, each of opacity and glow. */
typedef struct {
    double *opacity, *glow, *opacity_x, *glow_x;
} Column;

static void add_changes(double weight, double area, double moment, const double *even, const double *slope,
                        Py_ssize_t width, double *sums)
{
    area *= weight;
    moment *= weight;
    for (Py_ssize_t i = 0; i < width; i++)
        sums[i] += area * even[i] + moment * slope[i];
}

static void add_moments(double moment, const double *even, Py_ssize_t width, double *sums)
{
    for (Py_ssize_t i = 0; i < width; i++)
        sums[i] += moment * even[i];
}

static void add_touches(const Touches *touches, int64_t number, int beyond, const Bands *rows, Py_ssize_t term,
                        const Column *sums)
{
    Py_ssize_t width = rows->width, plane = rows->cells * width;
    for (; number >= 0; number = touches->of[number].next) {
        const Touch *touch = &touches->of[number];
        const double *even = rows->shares + 2 * term * plane + touch->row * width, *slope = even + plane;
        int64_t first = rows->first[touch->row];
        double area = beyond ? touch->area_beyond : touch->area, moment = beyond ? touch->y_beyond : touch->y;
        add_changes(touch->glow, area, moment, even, slope, width, sums->glow + first);
        if (!beyond)
            add_moments(touch->glow * touch->x, even, width, sums->glow_x + first);
        if (touch->opacity == 0)
            continue;
        add_changes(touch->opacity, area, moment, even, slope, width, sums->opacity + first);
        if (!beyond)
            add_moments(touch->opacity * touch->x, even, width, sums->opacity_x + first);
    }
}

/* Each of `width` pixel columns of a picture held by columns gains its shares of a column's light. */
WIDE static void spread_across(const double *sums, const double *moments, const double *even, const double *slope,
                               double weight, Py_ssize_t width, Py_ssize_t pixels, double *picture)
{
    for (Py_ssize_t i = 0; i < width; i++) {
        double share = weight * even[i], rise = weight * slope[i];
        double *column = picture + i * pixels;
        for (Py_ssize_t k = 0; k < pixels; k++)
            column[k] += share * sums[k] + rise * moments[k];
    }
}

static void spread_term(const Touches *touches, const Bands *rows, const Bands *columns, double weight, Py_ssize_t term,
                        double *work, double *alpha, double *emission)
{
    Py_ssize_t pixels = rows->pixels, width = columns->width, plane = columns->cells * width;
    Column sums = {work, work + pixels, work + 2 * pixels, work + 3 * pixels};
    memset(work, 0, 4 * (size_t)pixels * sizeof(double));
    for (int64_t column = 0, begun = 0; column < columns->cells; column++) {
        begun |= touches->last[column] >= 0;
        if (!begun)
            continue;
        memset(sums.opacity_x, 0, 2 * (size_t)pixels * sizeof(double));
        add_touches(touches, touches->last[column], 0, rows, term, &sums);
        if (column)
            add_touches(touches, touches->last[column - 1], 1, rows, term, &sums);
        const double *even = columns->shares + 2 * term * plane + column * width, *slope = even + plane;
        Py_ssize_t place = columns->first[column] * pixels;
        spread_across(sums.opacity, sums.opacity_x, even, slope, weight, width, pixels, alpha + place);
        spread_across(sums.glow, sums.glow_x, even, slope, weight, width, pixels, emission + place);
    }
}

/* Shares of pixels that are covered, before any blur: (pixel rows, pixel columns), all 0 before. */
static void add_cover(const Touches *touches, int64_t cells, int64_t fine, int64_t rows, double *sums, double *cover,
                      Py_ssize_t stride)
{
    memset(sums, 0, (size_t)rows * sizeof(double));
    for (int64_t column = 0; column < cells; column++) {
        for (int64_t i = touches->last[column]; i >= 0; i = touches->of[i].next)
            sums[touches->of[i].row / fine] += touches->of[i].opacity * touches->of[i].area;
        for (int64_t i = column ? touches->last[column - 1] : -1; i >= 0; i = touches->of[i].next)
            sums[touches->of[i].row / fine] += touches->of[i].opacity * touches->of[i].area_beyond;
        for (int64_t row = 0; row < rows; row++)
            cover[row * stride + column / fine] += sums[row] / (double)(fine * fine);
    }
}

int spread_touches(const Touches *touches, const Bands *rows, const Bands *columns, const double *weights,
                   Py_ssize_t terms, int64_t fine, int64_t margin, double *light)
{
    Py_ssize_t high = rows->pixels, wide = columns->pixels, size = high * wide;
    Scratch held = {.count = 0};
    double *work = scratch(&held, 4 * high, sizeof(double));
    double *pictures = work ? scratch(&held, 2 * size, sizeof(double)) : NULL;
    if (pictures) {
        for (Py_ssize_t term = 0; term < terms; term++)
            spread_term(touches, rows, columns, weights[term], term, work, pictures, pictures + size);
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
