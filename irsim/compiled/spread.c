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

/* A column of cells: those that are touched, in any order. */
typedef struct {
    Cell *cells;
    int32_t *rows;
    Py_ssize_t count;
} Touched;

/* Down a column of pixels, the opacity's before the glow's: the running sums of what changes, and the x moments. */
typedef struct {
    double *changes, *moments; /* (2, pixel rows) */
} Column;

/* Cells that give light to the same pixels go across together, so many at most. */
#define TOGETHER 2

static inline void add(Change *sum, double weight, double even, double y, double x)
{
    sum->even += weight * even;
    sum->y += weight * y;
    sum->x += weight * x;
}

static inline Cell *cell_of(Touched *column, int32_t row)
{
    Cell *cell = &column->cells[row];
    if (!cell->touched) {
        *cell = (Cell){.touched = 1};
        column->rows[column->count++] = row;
    }
    return cell;
}

static inline void forget(Touched *column)
{
    for (Py_ssize_t i = 0; i < column->count; i++)
        column->cells[column->rows[i]].touched = 0;
    column->count = 0;
}

/* What the touches of one column change in it and in the next one. */
static inline void gather(const Touches *touches, int64_t column, Touched *here, Touched *beyond)
{
    for (int32_t i = touches->last[column]; i >= 0; i = touches->of[i].next) {
        const Touch *touch = &touches->of[i];
        Cell *cell = cell_of(here, touch->row), *next = cell_of(beyond, touch->row);
        add(&cell->opacity, touch->opacity, touch->area, touch->y, touch->x);
        add(&cell->glow, touch->glow, touch->area, touch->y, touch->x);
        add(&next->opacity, touch->opacity, touch->area_beyond, touch->y_beyond, 0.0);
        add(&next->glow, touch->glow, touch->area_beyond, touch->y_beyond, 0.0);
    }
}

/* Each of `width` pixels from `first` on gains its shares of a cell's light. */
static inline void spread_down(const Cell *cell, const double *restrict even, const double *restrict slope,
                               Py_ssize_t width, Py_ssize_t first, Py_ssize_t pixels, Column column)
{
    Change opacity = cell->opacity, glow = cell->glow;
    double *restrict changes = column.changes + first, *restrict moments = column.moments + first;
    for (Py_ssize_t i = 0; i < width; i++) {
        changes[i] += opacity.even * even[i] + opacity.y * slope[i];
        moments[i] += opacity.x * even[i];
    }
    changes += pixels;
    moments += pixels;
    for (Py_ssize_t i = 0; i < width; i++) {
        changes[i] += glow.even * even[i] + glow.y * slope[i];
        moments[i] += glow.x * even[i];
    }
}

/* Of some columns of cells side by side, each of `width` pixel columns gains its shares, places low to high of all. */
static inline void spread_across(const Column *columns, int count, const double *even, const double *slope,
                                 double weight, Py_ssize_t width, Py_ssize_t low, Py_ssize_t high, Py_ssize_t size,
                                 double *picture)
{
    for (Py_ssize_t i = 0; i < width; i++) {
        double share[TOGETHER], rise[TOGETHER], *restrict lit = picture + i * size;
        for (int j = 0; j < count; j++) {
            share[j] = weight * even[j * width + i];
            rise[j] = weight * slope[j * width + i];
        }
        for (Py_ssize_t k = low; k < high; k++) {
            double sum = 0.0;
            for (int j = 0; j < count; j++)
                sum += share[j] * columns[j].changes[k] + rise[j] * columns[j].moments[k];
            lit[k] += sum;
        }
    }
}

/* Shares of pixels that are covered, before any blur. */
typedef struct {
    double *sums, *pixels; /* (pixel rows) in a column of cells, and in those of a pixel so far */
    double part;           /* of a pixel's side that a cell's is */
    double *shares;        /* (pixel rows, pixel columns), of `stride` columns */
    Py_ssize_t rows, stride;
} Cover;

static inline void cover_cell(Cover *cover, int32_t row, double change)
{
    cover->sums[(Py_ssize_t)((row + 0.5) * cover->part)] += change; /* row / fine, without a division */
}

static inline void cover_column(Cover *cover, Py_ssize_t column, Py_ssize_t fine)
{
    for (Py_ssize_t row = 0; row < cover->rows; row++)
        cover->pixels[row] += cover->sums[row];
    if ((column + 1) % fine)
        return;
    for (Py_ssize_t row = 0; row < cover->rows; row++) {
        cover->shares[row * cover->stride + column / fine] = cover->pixels[row] * (cover->part * cover->part);
        cover->pixels[row] = 0.0;
    }
}

/* What the terms of a spread are drawn with. */
typedef struct {
    Touched columns[2];
    Column sums[TOGETHER];
    Cover cover;
    double *picture; /* (pixel columns, 2, pixel rows) of alpha and emission */
} Work;

WIDE static void spread_term(const Touches *touches, const Bands *rows, const Bands *columns, double weight,
                             Py_ssize_t term, Py_ssize_t fine, Work *work)
{
    Py_ssize_t pixels = rows->pixels, down = rows->width, across = columns->width, low = pixels, high = 0;
    const double *down_even = rows->shares + 2 * term * rows->cells * down;
    const double *down_slope = down_even + rows->cells * down;
    const double *across_even = columns->shares + 2 * term * columns->cells * across;
    const double *across_slope = across_even + columns->cells * across;
    const size_t bytes = 2 * (size_t)pixels * sizeof(double);
    Touched *here = &work->columns[0], *beyond = &work->columns[1];
    Column *sums = work->sums;
    memset(sums[0].changes, 0, bytes);
    int held = 0; /* columns that wait for others that go across with them */
    for (Py_ssize_t column = 0; column < columns->cells; column++) {
        gather(touches, column, here, beyond);
        memset(sums[held].moments, 0, bytes);
        for (Py_ssize_t i = 0; i < here->count; i++) {
            int32_t row = here->rows[i];
            Py_ssize_t first = rows->first[row];
            low = first < low ? first : low;
            high = first + down > high ? first + down : high;
            spread_down(&here->cells[row], down_even + row * down, down_slope + row * down, down, first, pixels,
                        sums[held]);
            if (term == 0)
                cover_cell(&work->cover, row, here->cells[row].opacity.even);
        }
        if (term == 0)
            cover_column(&work->cover, column, fine);
        forget(here);
        Touched *emptied = here;
        here = beyond;
        beyond = emptied;
        Py_ssize_t begin = column - held++;
        if (held < TOGETHER && column + 1 < columns->cells && columns->first[column + 1] == columns->first[begin]) {
            memcpy(sums[held].changes, sums[held - 1].changes, bytes);
            continue;
        }
        if (low < high) {
            const double *even = across_even + begin * across, *slope = across_slope + begin * across;
            double *picture = work->picture + columns->first[begin] * 2 * pixels;
            if (held == TOGETHER)
                spread_across(sums, TOGETHER, even, slope, weight, across, low, pixels + high, 2 * pixels, picture);
            else
                spread_across(sums, 1, even, slope, weight, across, low, pixels + high, 2 * pixels, picture);
        }
        if (held > 1)
            memcpy(sums[0].changes, sums[held - 1].changes, bytes);
        held = 0;
    }
    forget(here); /* what lies beyond the last column */
}

/* From columns to rows. */
static void turn(const double *picture, Py_ssize_t high, Py_ssize_t wide, double *light)
{
    for (Py_ssize_t row = 0; row < high; row++)
        for (Py_ssize_t column = 0; column < wide; column++) {
            light[row * wide + column] = picture[2 * column * high + row];
            light[(high + row) * wide + column] = picture[(2 * column + 1) * high + row];
        }
}

int spread_touches(const Touches *touches, const Bands *rows, const Bands *columns, const double *weights,
                   Py_ssize_t terms, int64_t fine, int64_t margin, double *light)
{
    Py_ssize_t high = rows->pixels, wide = columns->pixels, size = high * wide, cells = rows->cells;
    Py_ssize_t covered = cells / fine;
    Scratch held = {.count = 0};
    Cell *room = scratch(&held, 2 * cells, sizeof(Cell));
    int32_t *numbers = room ? scratch(&held, 2 * cells, sizeof(int32_t)) : NULL;
    double *sums = numbers ? scratch(&held, 4 * TOGETHER * high + 2 * covered, sizeof(double)) : NULL;
    double *picture = sums ? scratch(&held, 2 * size, sizeof(double)) : NULL;
    if (picture) {
        double *cover = sums + 4 * TOGETHER * high;
        Work work = {
            .columns = {{room, numbers, 0}, {room + cells, numbers + cells, 0}},
            .cover = {cover, cover + covered, 1.0 / (double)fine, light + margin * wide + margin, covered, wide},
            .picture = picture,
        };
        for (int i = 0; i < TOGETHER; i++)
            work.sums[i] = (Column){sums + 4 * i * high, sums + (4 * i + 2) * high};
        memset(light, 0, (size_t)size * sizeof(double));
        for (Py_ssize_t term = 0; term < terms; term++)
            spread_term(touches, rows, columns, weights[term], term, fine, &work);
        turn(picture, high, wide, light + size);
    }
    discard(&held);
    return picture ? 0 : -1;
}
