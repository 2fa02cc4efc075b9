/* The light of polygons in pixels: area and first moments of each cell, blurred and binned; plain twins: `row_differences`
 * in irsim/geometry/polygon.py and `blur_to_pixels` in irsim/geometry/silhouette.py.
 *
 * The grid is scanned column by column: changes in its cells are spread down over pixel rows and summed from the left, and
 * the sums of the columns of a pixel are spread across together. The image in work is held by columns, so that all inner
 * loops run down a column. */
#include "body.h"

/* Cells of 1 / fine px, rows x columns of them, from their outer corner on. */
typedef struct {
    Point corner;
    double fine;
    int64_t rows, columns;
} Grid;

/* A cell that a piece runs through: the changes of its area and y moment, and of its right neighbour's, from the cell
 * before, and its own x moment; for a weight of one. */
typedef struct {
    int32_t row, next; /* next: the number of another touch in its column, -1 where there is none */
    double area, area_beyond, y, y_beyond, x;
    double opacity, glow;
} Touch;

typedef struct {
    Touch *of;
    Py_ssize_t count, room;
    int32_t *last; /* (columns) the last touch in each column, -1 where there is none */
} Touches;

/* The grid lines of one axis that an edge has yet to cross, in their order. */
typedef struct {
    double start, extent; /* of the edge */
    double line, step;
    double place; /* where the edge crosses the line, 0..1 */
    int64_t left;
} Crossings;

static Crossings crossings(double start, double stop, int64_t lines)
{
    double first = greater(floor(lesser(start, stop)) + 1, 0.0);
    double last = lesser(ceil(greater(start, stop)) - 1, (double)lines);
    Crossings found = {.start = start, .extent = stop - start};
    if (!(first <= last)) /* nan, too */
        return found;
    found.left = (int64_t)(last - first) + 1;
    found.line = start < stop ? first : last;
    found.step = start < stop ? 1.0 : -1.0;
    found.place = (found.line - start) / found.extent;
    return found;
}

static double pass(Crossings *crossings)
{
    double place = crossings->place;
    crossings->line += crossings->step;
    crossings->left--;
    crossings->place = (crossings->line - crossings->start) / crossings->extent;
    return place;
}

static double next_cut(Crossings *across, Crossings *down)
{
    if (across->left > 0 && !(down->left > 0 && down->place < across->place))
        return pass(across);
    return pass(down);
}

/* A part of an edge that lies within one cell, by its middle and its extent. */
static int touch(Point middle, double wide, double high, const Piece *piece, const Grid *grid, Touches *touches)
{
    if (!(middle.y >= 0 && middle.y < (double)grid->rows && middle.x < (double)grid->columns))
        return 0;
    /* Left of the grid an edge still bounds all the cells to its right, like an edge on the border. */
    if (middle.x < 0)
        wide = middle.x = 0.0;
    int64_t column = (int64_t)middle.x, row = (int64_t)middle.y;
    if (touches->count == touches->room) {
        Touch *larger = touches->room > INT32_MAX / 4 ? NULL : grown(touches->of, &touches->room, sizeof(Touch));
        if (larger == NULL) {
            PyErr_NoMemory();
            return -1;
        }
        touches->of = larger;
    }
    double x = middle.x - (double)column, y = middle.y - ((double)row + 0.5);
    /* The cell's area right of the piece; the neighbour gains the rest. */
    double area = -high * (1 - x);
    double y_moment = area * y + high * wide * high / 12;
    touches->of[touches->count] = (Touch){
        .row = (int32_t)row,
        .next = touches->last[column],
        .area = area,
        .area_beyond = -high - area,
        .y = y_moment,
        .y_beyond = -high * y - y_moment,
        .x = -high * (0.125 - ((x - 0.5) * (x - 0.5) + wide * wide / 12) / 2),
        .opacity = piece->opacity,
        .glow = piece->glow,
    };
    touches->last[column] = (int32_t)touches->count++;
    return 0;
}

/* -1 without memory. The caller frees touches->of in either case. */
WIDE static int touch_cells(const Piece *piece, const Grid *grid, Touches *touches)
{
    Point start = {(piece->start.x - grid->corner.x) * grid->fine, (piece->start.y - grid->corner.y) * grid->fine};
    Point stop = {(piece->stop.x - grid->corner.x) * grid->fine, (piece->stop.y - grid->corner.y) * grid->fine};
    double wide = stop.x - start.x, high = stop.y - start.y;
    Crossings across = crossings(start.x, stop.x, grid->columns), down = crossings(start.y, stop.y, grid->rows);
    int64_t cuts = across.left + down.left;
    double begin = 0.0;
    for (int64_t i = 0; i <= cuts; i++) {
        double end = i < cuts ? next_cut(&across, &down) : 1.0;
        double at = (begin + end) / 2, length = end - begin;
        Point middle = {start.x + wide * at, start.y + high * at};
        if (touch(middle, wide * length, high * length, piece, grid, touches) < 0)
            return -1;
        begin = end;
    }
    return 0;
}

static const char NAME[] = "irsim.spread";

/* Largest share of a cell's light that is rounding. */
#define DARK 1e-25

/* Pixels down a column gain light by so many at a time. */
#define FOURS 4

/* Change of a cell from the one on its left, of its y moment, and its x moment. */
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

/* Clears the cells long before they are touched anew: a read right after a write of another width would wait. */
static inline void forget(Touched *column)
{
    for (Py_ssize_t i = 0; i < column->count; i++)
        column->cells[column->rows[i]] = (Cell){.touched = 0};
    column->count = 0;
}

/* Adds the touches of one column to it and to the next one. */
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

/* Adds a change to pixels, four by four: those beyond `count` gain 0. */
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

/* Adds the shares of a pixel's columns of cells to a pixel column, from place low to high. */
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
            switch (fine) { /* the compiler knows the number */
            case 1: spread_across(work->sums, share, rise, 1, top, high + bottom, lit, fused); break;
            case 2: spread_across(work->sums, share, rise, 2, top, high + bottom, lit, fused); break;
            case 3: spread_across(work->sums, share, rise, 3, top, high + bottom, lit, fused); break;
            default: spread_across(work->sums, share, rise, MOST_FINE, top, high + bottom, lit, fused);
            }
        }
    }
    forget(here); /* what lies beyond the last column */
}

INLINED void spread_terms(Work *work, int fused)
{
    for (Py_ssize_t term = 0; term < work->by->terms; term++)
        spread_term(work, term, fused);
}
BOTH(void, spread_terms, (Work *work), work)

/* From columns to rows. */
static void turn(const double *picture, Py_ssize_t high, Py_ssize_t wide, double *light)
{
    for (Py_ssize_t row = 0; row < high; row++)
        for (Py_ssize_t column = 0; column < wide; column++) {
            light[row * wide + column] = picture[2 * column * high + row];
            light[(high + row) * wide + column] = picture[(2 * column + 1) * high + row];
        }
}

/* The light of touched cells, as `draw_polygons`; -1 without memory. */
static int spread_touches(const Touches *touches, const Spread *by, Py_ssize_t rows, Py_ssize_t columns, double *light)
{
    Py_ssize_t high = rows + 2 * by->reach, wide = columns + 2 * by->reach, size = high * wide, cells = rows * by->fine;
    Scratch held = {.count = 0};
    Cell *room = scratch(&held, 2 * cells, sizeof(Cell));
    int32_t *numbers = scratch_as_is(&held, 2 * cells, sizeof(int32_t));
    const Py_ssize_t both = 2 * high + FOURS; /* opacity and glow, and the rest of the last four */
    double *sums = scratch(&held, 2 * by->fine * both + 2 * rows, sizeof(double));
    double *picture = scratch(&held, 2 * size, sizeof(double));
    if (!held.failed) {
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
        CHOSEN(spread_terms)(&work);
        turn(picture, high, wide, light + size);
    }
    discard(&held);
    return held.failed ? -1 : 0;
}

/* Finds the pixels that a cell lights by any of the terms. */
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

KERNEL(spread, 3)
{
    Py_ssize_t terms, size;
    const double *weights = input(call, 0, "d", &terms), *shares = input(call, 1, "d", &size);
    const Py_ssize_t fine = whole(call, 2);
    if (call->failed)
        return NULL;
    const Py_ssize_t wide = terms > 0 && 0 < fine && fine <= MOST_FINE ? size / (2 * terms * fine) : 0;
    if (wide < 1 || wide % 2 == 0 || size != 2 * terms * fine * wide)
        return wrong(call, "spread: shares (terms, 2, fine, 2 reach + 1), fine up to 4, are required");
    const Py_ssize_t stride = wide + FOURS - 1, lines = 2 * terms * fine;
    Spread *by = PyMem_Calloc(1, sizeof(Spread) + (size_t)(terms + lines * stride) * sizeof(double));
    if (by == NULL)
        return PyErr_NoMemory();
    double *kept = (double *)(by + 1);
    memcpy(kept, weights, (size_t)terms * sizeof(double));
    for (Py_ssize_t line = 0; line < lines; line++)
        memcpy(kept + terms + line * stride, shares + line * wide, (size_t)wide * sizeof(double));
    *by = (Spread){terms, fine, wide / 2, stride, kept, kept + terms, {0}, {0}};
    for (Py_ssize_t place = 0; place < fine; place++)
        find_lit(by, place);
    PyObject *capsule = PyCapsule_New(by, NAME, let_go);
    if (capsule == NULL)
        PyMem_Free(by);
    return capsule;
}

const Spread *spread_of(PyObject *given)
{
    return PyCapsule_GetPointer(given, NAME);
}

static Middle middle_of(const Pieces *pieces)
{
    Point origin = pieces->count ? pieces->of[0].start : (Point){NAN, NAN};
    Point area_moment = {0, 0}, light_moment = {0, 0};
    double area = 0, light = 0;
    for (Py_ssize_t i = 0; i < pieces->count; i++) {
        const Piece *piece = &pieces->of[i];
        Point a = {piece->start.x - origin.x, piece->start.y - origin.y};
        Point b = {piece->stop.x - origin.x, piece->stop.y - origin.y};
        double twice = a.x * b.y - a.y * b.x;
        double cover = piece->opacity * twice, shine = piece->glow * twice;
        area += cover;
        light += shine;
        area_moment = (Point){area_moment.x + cover * (a.x + b.x), area_moment.y + cover * (a.y + b.y)};
        light_moment = (Point){light_moment.x + shine * (a.x + b.x), light_moment.y + shine * (a.y + b.y)};
    }
    return (Middle){
        area / 2,
        light / 2,
        {origin.x + area_moment.x / (3 * area), origin.y + area_moment.y / (3 * area)},
        {origin.x + light_moment.x / (3 * light), origin.y + light_moment.y / (3 * light)},
    };
}

static int draw(const Pieces *pieces, const Grid *grid, const Spread *by, Py_ssize_t rows, Py_ssize_t columns,
                double *light)
{
    Scratch held = {.count = 0};
    Touches touches = {.last = scratch_as_is(&held, grid->columns, sizeof(int32_t))};
    int failed = touches.last == NULL;
    for (int64_t i = 0; i < grid->columns && !failed; i++)
        touches.last[i] = -1;
    for (Py_ssize_t i = 0; i < pieces->count && !failed; i++)
        failed = touch_cells(&pieces->of[i], grid, &touches) < 0;
    if (!failed)
        failed = spread_touches(&touches, by, rows, columns, light) < 0;
    PyMem_Free(touches.of);
    discard(&held);
    return failed ? -1 : 0;
}

int draw_polygons(const Point *start, const Point *stop, const int64_t *layer, Py_ssize_t edges, const double *glow,
                  Py_ssize_t layers, Point corner, Py_ssize_t rows, Py_ssize_t columns, const Spread *by, double *light,
                  Middle *middle)
{
    const Grid grid = {corner, (double)by->fine, rows * by->fine, columns * by->fine};
    Pieces pieces = {.count = 0};
    int failed = visible_pieces(start, stop, layer, edges, glow, layers, &pieces) < 0 ||
                 draw(&pieces, &grid, by, rows, columns, light) < 0;
    if (!failed)
        *middle = middle_of(&pieces);
    PyMem_Free(pieces.of);
    return failed ? -1 : 0;
}

KERNEL(sprite_light, 10)
{
    Py_ssize_t starts, stops, edges, layers, size;
    const Point *start = input(call, 0, "d", &starts), *stop = input(call, 1, "d", &stops);
    const int64_t *layer = input(call, 2, "l", &edges);
    const double *glow = input(call, 3, "d", &layers);
    const Point corner = {number(call, 4), number(call, 5)};
    const Py_ssize_t rows = whole(call, 6), columns = whole(call, 7);
    double *light = output(call, 9, "d", &size);
    const Spread *by = call->failed ? NULL : spread_of(call->given[8]);
    if (by == NULL)
        return NULL;
    if (starts != 2 * edges || stops != 2 * edges || rows < 1 || columns < 1 || rows > INT32_MAX / MOST_FINE ||
        columns > INT32_MAX / MOST_FINE || size != 3 * (rows + 2 * by->reach) * (columns + 2 * by->reach))
        return wrong(call, "sprite_light: the lengths of its arrays do not agree");
    Middle middle;
    if (draw_polygons(start, stop, layer, edges, glow, layers, corner, rows, columns, by, light, &middle) < 0)
        return NULL;
    return Py_BuildValue("(dddddd)", middle.area, middle.light, middle.center.x, middle.center.y, middle.signal_center.x,
                         middle.signal_center.y);
}
