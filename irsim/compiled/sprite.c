/* The light of convex polygons that hide each other, in the pixels of a patch; see irsim/shapes/silhouette.py. */
#include "sprite.h"

#include "spread.h"

/* Integrals of opacity and glow over a field, and their centroids, by Green's theorem; nan where the integral is 0. */
typedef struct {
    double area, light;
    Point center, signal_center;
} Middle;

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

static int draw(const Pieces *pieces, const Grid *grid, const Bands *rows, const Bands *columns, const double *weights,
                Py_ssize_t terms, int64_t fine, int64_t margin, double *light)
{
    Scratch held = {.count = 0};
    Touches touches = {.last = scratch(&held, grid->columns, sizeof(int32_t))};
    int failed = touches.last == NULL;
    for (int64_t i = 0; i < grid->columns && !failed; i++)
        touches.last[i] = -1;
    for (Py_ssize_t i = 0; i < pieces->count && !failed; i++)
        failed = touch_cells(&pieces->of[i], grid, &touches) < 0;
    if (!failed)
        failed = spread_touches(&touches, rows, columns, weights, terms, fine, margin, light) < 0;
    PyMem_Free(touches.of);
    discard(&held);
    return failed ? -1 : 0;
}

/* Are the bands such that nothing is read or written beside them? */
static int bands_fit(const Bands *bands, Py_ssize_t length, Py_ssize_t terms, int64_t fine, int64_t margin)
{
    if (bands->width < 1 || length != 2 * terms * bands->cells * bands->width || bands->cells % fine ||
        bands->pixels != bands->cells / fine + 2 * margin)
        return 0;
    for (Py_ssize_t i = 0; i < bands->cells; i++)
        if (bands->first[i] < 0 || bands->first[i] > bands->pixels - bands->width)
            return 0;
    return 1;
}

/* sprite_light(start, stop, layer, glow, left, top, fine, margin, weights, first_down, down, first_across, across,
 * light): light takes (3, rows, columns) of cover, alpha and emission; returned are area, signal, and the x and y of
 * the area's and of the signal's centroid. */
PyObject *sprite_light(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    if (count != 14) {
        PyErr_SetString(PyExc_TypeError, "sprite_light takes 14 arguments");
        return NULL;
    }
    Arrays arrays = {.count = 0};
    PyObject *result = NULL;
    Pieces pieces = {.count = 0};
    Py_ssize_t starts, stops, edges, layers, terms, downs, acrosses, room;
    Grid grid;
    Bands rows, columns;
    const Point *start = array(&arrays, given[0], "d", 0, &starts);
    const Point *stop = start ? array(&arrays, given[1], "d", 0, &stops) : NULL;
    const int64_t *layer = stop ? array(&arrays, given[2], "l", 0, &edges) : NULL;
    const double *glow = layer ? array(&arrays, given[3], "d", 0, &layers) : NULL;
    const double *weights = glow ? array(&arrays, given[8], "d", 0, &terms) : NULL;
    rows.first = weights ? array(&arrays, given[9], "l", 0, &rows.cells) : NULL;
    rows.shares = rows.first ? array(&arrays, given[10], "d", 0, &downs) : NULL;
    columns.first = rows.shares ? array(&arrays, given[11], "l", 0, &columns.cells) : NULL;
    columns.shares = columns.first ? array(&arrays, given[12], "d", 0, &acrosses) : NULL;
    double *light = columns.shares ? array(&arrays, given[13], "d", 1, &room) : NULL;
    if (light == NULL)
        goto done;
    grid.corner = (Point){PyFloat_AsDouble(given[4]), PyFloat_AsDouble(given[5])};
    int64_t fine = PyLong_AsLong(given[6]), margin = PyLong_AsLong(given[7]);
    if (PyErr_Occurred())
        goto done;
    int fits = starts == 2 * edges && stops == 2 * edges && terms > 0 && fine > 0 && fine < 1024 && margin >= 0 &&
               rows.cells > 0 && columns.cells > 0 && rows.cells < INT32_MAX;
    if (fits) {
        rows.width = downs / (2 * terms * rows.cells);
        columns.width = acrosses / (2 * terms * columns.cells);
        rows.pixels = rows.cells / fine + 2 * margin;
        columns.pixels = columns.cells / fine + 2 * margin;
        fits = bands_fit(&rows, downs, terms, fine, margin) && bands_fit(&columns, acrosses, terms, fine, margin) &&
               room == 3 * rows.pixels * columns.pixels;
    }
    if (!fits) {
        PyErr_SetString(PyExc_ValueError, "sprite_light: the lengths of its arrays do not agree");
        goto done;
    }
    grid.fine = (double)fine;
    grid.rows = rows.cells;
    grid.columns = columns.cells;
    if (visible_pieces(start, stop, layer, edges, glow, layers, &pieces) < 0 ||
        draw(&pieces, &grid, &rows, &columns, weights, terms, fine, margin, light) < 0)
        goto done;
    Middle middle = middle_of(&pieces);
    result = Py_BuildValue("(dddddd)", middle.area, middle.light, middle.center.x, middle.center.y,
                           middle.signal_center.x, middle.signal_center.y);
done:
    PyMem_Free(pieces.of);
    release(&arrays);
    return result;
}
