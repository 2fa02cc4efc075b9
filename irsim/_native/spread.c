/* See irsim/geometry/silhouette.py, whose `spread` does the same with whole matrices, most of which are zero.
 *
 * The grid is gone through column by column: what changes in its cells is spread down over pixel rows and summed up
 * from the left, and the sums of the columns of a pixel are spread across together. The picture in work is held by
 * columns, so that all inner loops run down a column. */
#include "spread.h"

#include <string.h>

#include "arguments.h"
#include "fused.h"

static const char NAME[] = "irsim.spread";

/* No more of a cell's light than this is rounding: a faded cosine's where it should be 0. */
#define DARK 1e-25

/* Pixels down a column gain light by so many at a time. */
#define FOURS 4

/* What changes in a cell from the one on its left, its y moment, and its x moment. */
typedef struct {
    double even, y, x;
} Change;

typedef struct {
    Change opacity, glow;
    int touched;
} Cell;

/* A column of cells: those that are touched, in any order; all others are 0. */
typedef struct {
    Cell *cells;
    int32_t *rows;
    Py_ssize_t count;
} Touched;

/* Down a column of pixels, the opacity's before the glow's: the running sums of what changes, and the x moments. */
typedef struct {
    double *changes, *moments; /* (2, pixel rows) */
} Column;

INLINED double sum_of(double sum, double a, double b, int fused)
{
    return fused ? fma(a, b, sum) : sum + a * b;
}

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
        cell->touched = 1;
        column->rows[column->count++] = row;
    }
    return cell;
}

/* Long before they are touched anew: what is written to in another width just before it is read makes that wait. */
static inline void forget(Touched *column)
{
    for (Py_ssize_t i = 0; i < column->count; i++)
        column->cells[column->rows[i]] = (Cell){.touched = 0};
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

/* Pixels gain their shares of what changes, four by four: those beyond `count` gain nothing. */
INLINED void spread_down(Change change, const double *restrict even, const double *restrict slope, Py_ssize_t count,
                         double *restrict changes, double *restrict moments, int fused)
{
    for (Py_ssize_t at = 0; at < count; at += FOURS) {
        double sums[FOURS], rises[FOURS];
        for (int i = 0; i < FOURS; i++) {
            sums[i] = sum_of(sum_of(changes[at + i], change.even, even[at + i], fused), change.y, slope[at + i], fused);
            rises[i] = sum_of(moments[at + i], change.x, even[at + i], fused);
        }
        for (int i = 0; i < FOURS; i++) {
            changes[at + i] = sums[i];
            moments[at + i] = rises[i];
        }
    }
}

/* Of the `fine` columns of cells of a pixel, a pixel column gains its shares, places low to high of all. */
INLINED void spread_across(const Column *columns, const double *share, const double *rise, int fine, Py_ssize_t low,
                           Py_ssize_t high, double *restrict lit, int fused)
{
    for (Py_ssize_t k = low; k < high; k++) {
        double sum = lit[k];
        for (int j = 0; j < fine; j++) {
            sum = sum_of(sum, share[j], columns[j].changes[k], fused);
            sum = sum_of(sum, rise[j], columns[j].moments[k], fused);
        }
        lit[k] = sum;
    }
}

/* The same, the number of columns being known to the compiler. */
INLINED void across(const Column *columns, const double *share, const double *rise, Py_ssize_t fine, Py_ssize_t low,
                    Py_ssize_t high, double *lit, int fused)
{
    switch (fine) {
    case 1:
        spread_across(columns, share, rise, 1, low, high, lit, fused);
        break;
    case 2:
        spread_across(columns, share, rise, 2, low, high, lit, fused);
        break;
    case 3:
        spread_across(columns, share, rise, 3, low, high, lit, fused);
        break;
    default:
        spread_across(columns, share, rise, MOST_FINE, low, high, lit, fused);
    }
}

/* What is drawn on. */
typedef struct {
    const Touches *touches;
    const Spread *by;
    Py_ssize_t rows, columns;
    Touched cells[2];        /* of the column at hand and the one after it */
    Column sums[MOST_FINE];  /* of the columns of a pixel */
    double *picture;         /* (pixel columns, 2, pixel rows) of alpha and emission */
    double *covered, *cover; /* (rows) in the columns so far, and in those of the pixel; (rows, columns) of all */
} Work;

/* Shares of a column of pixels that are covered, before any blur: `cover` is of a picture with a margin. */
static void cover_pixels(Work *work, Py_ssize_t column, Py_ssize_t stride)
{
    const double part = 1.0 / (double)work->by->fine;
    double *of_pixel = work->covered + work->rows;
    for (Py_ssize_t row = 0; row < work->rows; row++) {
        work->cover[row * stride + column] = of_pixel[row] * (part * part);
        of_pixel[row] = 0.0;
    }
}

INLINED void spread_term(Work *work, Py_ssize_t term, int fused)
{
    const Spread *by = work->by;
    const Py_ssize_t fine = by->fine, wide = by->stride;
    const Py_ssize_t high = work->rows + 2 * by->reach, stride = work->columns + 2 * by->reach;
    const double *even = by->shares + 2 * term * fine * wide, *slope = even + fine * wide;
    const size_t bytes = 2 * (size_t)high * sizeof(double);
    const double part = 1.0 / (double)fine, weight = by->weights[term];
    Py_ssize_t top = high, bottom = 0; /* what is lit of a column */
    Py_ssize_t first = wide, beyond = 0; /* what a pixel's cells light */
    for (Py_ssize_t j = 0; j < fine; j++) {
        first = by->first[j] < first ? by->first[j] : first;
        beyond = by->beyond[j] > beyond ? by->beyond[j] : beyond;
    }
    Touched *here = &work->cells[0], *next = &work->cells[1];
    memset(work->sums[fine - 1].changes, 0, bytes);
    for (Py_ssize_t pixel = 0; pixel < work->columns; pixel++) {
        for (Py_ssize_t j = 0; j < fine; j++) {
            Column sums = work->sums[j], before = work->sums[j ? j - 1 : fine - 1];
            if (fine > 1) /* what changes further left counts here, too */
                memcpy(sums.changes, before.changes, bytes);
            memset(sums.moments, 0, bytes);
            gather(work->touches, pixel * fine + j, here, next);
            for (Py_ssize_t i = 0; i < here->count; i++) {
                const Py_ssize_t row = here->rows[i], within = (Py_ssize_t)(((double)row + 0.5) * part); /* row / fine */
                const Py_ssize_t place = row - within * fine, lit = by->first[place], count = by->beyond[place] - lit;
                const Py_ssize_t from = within + lit;
                const Cell *cell = &here->cells[row];
                top = from < top ? from : top;
                bottom = from + count > bottom ? from + count : bottom;
                spread_down(cell->opacity, even + place * wide + lit, slope + place * wide + lit, count,
                            sums.changes + from, sums.moments + from, fused);
                spread_down(cell->glow, even + place * wide + lit, slope + place * wide + lit, count,
                            sums.changes + high + from, sums.moments + high + from, fused);
                if (term == 0)
                    work->covered[within] += cell->opacity.even;
            }
            if (term == 0)
                for (Py_ssize_t row = 0; row < work->rows; row++)
                    work->covered[work->rows + row] += work->covered[row];
            forget(here);
            Touched *emptied = here;
            here = next;
            next = emptied;
        }
        if (term == 0)
            cover_pixels(work, pixel, stride);
        for (Py_ssize_t i = first; i < beyond && top < bottom; i++) {
            double share[MOST_FINE], rise[MOST_FINE], *lit = work->picture + (pixel + i) * 2 * high;
            for (Py_ssize_t j = 0; j < fine; j++) {
                share[j] = weight * even[j * wide + i];
                rise[j] = weight * slope[j * wide + i];
            }
            across(work->sums, share, rise, fine, top, high + bottom, lit, fused);
        }
    }
    forget(here); /* what lies beyond the last column */
}

FUSING_WIDELY static void spread_widely(Work *work)
{
    for (Py_ssize_t term = 0; term < work->by->terms; term++)
        spread_term(work, term, 1);
}

FUSING static void spread_fused(Work *work)
{
    for (Py_ssize_t term = 0; term < work->by->terms; term++)
        spread_term(work, term, 1);
}

static void spread_twice(Work *work)
{
    for (Py_ssize_t term = 0; term < work->by->terms; term++)
        spread_term(work, term, 0);
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

int spread_touches(const Touches *touches, const Spread *by, Py_ssize_t rows, Py_ssize_t columns, double *light)
{
    Py_ssize_t high = rows + 2 * by->reach, wide = columns + 2 * by->reach, size = high * wide, cells = rows * by->fine;
    Scratch held = {.count = 0};
    Cell *room = scratch(&held, 2 * cells, sizeof(Cell));
    int32_t *numbers = room ? scratch_as_is(&held, 2 * cells, sizeof(int32_t)) : NULL;
    const Py_ssize_t both = 2 * high + FOURS; /* of opacity and glow, and what of the last four is beyond */
    double *sums = numbers ? scratch(&held, 2 * by->fine * both + 2 * rows, sizeof(double)) : NULL;
    double *picture = sums ? scratch(&held, 2 * size, sizeof(double)) : NULL;
    if (picture) {
        Work work = {
            .touches = touches,
            .by = by,
            .rows = rows,
            .columns = columns,
            .cells = {{room, numbers, 0}, {room + cells, numbers + cells, 0}},
            .picture = picture,
            .covered = sums + 2 * by->fine * both,
            .cover = light + by->reach * wide + by->reach,
        };
        for (Py_ssize_t j = 0; j < by->fine; j++)
            work.sums[j] = (Column){sums + 2 * j * both, sums + (2 * j + 1) * both};
        memset(light, 0, (size_t)size * sizeof(double));
        (fuses_widely() ? spread_widely : fuses() ? spread_fused : spread_twice)(&work);
        turn(picture, high, wide, light + size);
    }
    discard(&held);
    return picture ? 0 : -1;
}

/* Which pixels a cell lights, in any of the terms. */
static void find_lit(Spread *by, Py_ssize_t place)
{
    by->first[place] = 2 * by->reach + 1;
    by->beyond[place] = 0;
    for (Py_ssize_t each = 0; each < 2 * by->terms; each++)
        for (Py_ssize_t i = 0; i <= 2 * by->reach; i++)
            if (fabs(by->shares[(each * by->fine + place) * by->stride + i]) > DARK) {
                by->first[place] = i < by->first[place] ? i : by->first[place];
                by->beyond[place] = i + 1 > by->beyond[place] ? i + 1 : by->beyond[place];
            }
    if (by->first[place] > by->beyond[place])
        by->first[place] = by->beyond[place];
}

static void let_go(PyObject *capsule)
{
    PyMem_Free(PyCapsule_GetPointer(capsule, NAME));
}

PyObject *spread(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    if (count != 3)
        return PyErr_Format(PyExc_TypeError, "spread takes 3 arguments, not %zd", count);
    Arrays arrays = {.count = 0};
    PyObject *capsule = NULL;
    Py_ssize_t terms, room;
    const double *weights = array(&arrays, given[0], "d", 0, &terms);
    const double *shares = weights ? array(&arrays, given[1], "d", 0, &room) : NULL;
    const Py_ssize_t fine = shares ? PyLong_AsSsize_t(given[2]) : 0;
    if (shares == NULL || PyErr_Occurred())
        goto done;
    const Py_ssize_t wide = terms > 0 && 0 < fine && fine <= MOST_FINE ? room / (2 * terms * fine) : 0;
    if (wide < 1 || wide % 2 == 0 || room != 2 * terms * fine * wide) {
        PyErr_Format(PyExc_ValueError, "spread: shares (terms, 2, fine, 2 reach + 1), fine up to %d, are wanted", MOST_FINE);
        goto done;
    }
    const Py_ssize_t stride = wide + FOURS - 1, lines = 2 * terms * fine;
    Spread *by = PyMem_Calloc(1, sizeof(Spread) + (size_t)(terms + lines * stride) * sizeof(double));
    if (by == NULL) {
        PyErr_NoMemory();
        goto done;
    }
    double *kept = (double *)(by + 1);
    memcpy(kept, weights, (size_t)terms * sizeof(double));
    for (Py_ssize_t line = 0; line < lines; line++)
        memcpy(kept + terms + line * stride, shares + line * wide, (size_t)wide * sizeof(double));
    *by = (Spread){terms, fine, wide / 2, stride, kept, kept + terms, {0}, {0}};
    for (Py_ssize_t place = 0; place < fine; place++)
        find_lit(by, place);
    capsule = PyCapsule_New(by, NAME, let_go);
    if (capsule == NULL)
        PyMem_Free(by);
done:
    release(&arrays);
    return capsule;
}

const Spread *spread_of(PyObject *given)
{
    return PyCapsule_GetPointer(given, NAME);
}
