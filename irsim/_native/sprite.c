/* See irsim/geometry/silhouette.py, whose `sprites` does the same with arrays. */
#include "sprite.h"

#include "arguments.h"

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

/* sprite_light(start, stop, layer, glow, left, top, rows, columns, spread, light): see `draw_polygons`; returned are
 * area, signal, and the x and y of the area's and of the signal's centroid. */
PyObject *sprite_light(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    if (count != 10)
        return PyErr_Format(PyExc_TypeError, "sprite_light takes 10 arguments, not %zd", count);
    Arrays arrays = {.count = 0};
    PyObject *result = NULL;
    Py_ssize_t starts, stops, edges, layers, room;
    const Point *start = array(&arrays, given[0], "d", 0, &starts);
    const Point *stop = start ? array(&arrays, given[1], "d", 0, &stops) : NULL;
    const int64_t *layer = stop ? array(&arrays, given[2], "l", 0, &edges) : NULL;
    const double *glow = layer ? array(&arrays, given[3], "d", 0, &layers) : NULL;
    double *light = glow ? array(&arrays, given[9], "d", 1, &room) : NULL;
    const Spread *by = light ? spread_of(given[8]) : NULL;
    if (by == NULL)
        goto done;
    const Point corner = {PyFloat_AsDouble(given[4]), PyFloat_AsDouble(given[5])};
    const Py_ssize_t rows = PyLong_AsSsize_t(given[6]), columns = PyLong_AsSsize_t(given[7]);
    if (PyErr_Occurred())
        goto done;
    if (starts != 2 * edges || stops != 2 * edges || rows < 1 || columns < 1 || rows > INT32_MAX / MOST_FINE ||
        columns > INT32_MAX / MOST_FINE || room != 3 * (rows + 2 * by->reach) * (columns + 2 * by->reach)) {
        PyErr_SetString(PyExc_ValueError, "sprite_light: the lengths of its arrays do not agree");
        goto done;
    }
    Middle middle;
    if (draw_polygons(start, stop, layer, edges, glow, layers, corner, rows, columns, by, light, &middle) == 0)
        result = Py_BuildValue("(dddddd)", middle.area, middle.light, middle.center.x, middle.center.y,
                               middle.signal_center.x, middle.signal_center.y);
done:
    release(&arrays);
    return result;
}
