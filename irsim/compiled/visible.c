/* See irsim/shapes/visible.py, whose `visible_edges` does the same in the same order, so that pieces are the same to
 * the last bit, but for those of no length; here one edge after the other, with nothing kept but what covers it. */
#include "visible.h"

#include "wide.h"

/* As there: edges of each layer lie this much further in than those of the one in front. */
static const double INSET_PX = 1e-9;

static double inset_of(const Point *start, Py_ssize_t count)
{
    Extent box = NOTHING;
    for (Py_ssize_t i = 0; i < count; i++)
        box = with_point(box, start[i]);
    double side = greater(box.high.x - box.low.x, box.high.y - box.low.y);
    return count ? INSET_PX * lesser(side, 1.0) : 0.0;
}

/* An edge with its inset. */
typedef struct {
    Point start, stop, along;
    Extent box;
} Edge;

/* The lines of edges: across * x + down * y = level, greater inside the polygon. */
typedef struct {
    double *across, *down, *level;
} Lines;

/* Where an edge runs through a polygon: from entry to leave, 0..1 along it. */
typedef struct {
    int64_t polygon;
    double entry, leave;
} Through;

typedef struct {
    double place, order;
} Cut;

typedef struct {
    const Edge *edges;
    Lines lines;
    const int64_t *first; /* (layers + 1) first edge of each polygon */
    const Extent *boxes;  /* (layers) */
    const double *glow;
    Py_ssize_t layers;
    int64_t *near;        /* (layers) room: the polygons whose boxes meet that of the one at hand, rising */
    Py_ssize_t count_near;
    Through *through; /* (layers) room */
    Cut *cuts;        /* (2 layers) room */
    double *entries, *leaves; /* (edges) room */
} Picture;

static Edge inset(Point start, Point stop, double each, int64_t depth)
{
    Edge edge = {.along = {stop.x - start.x, stop.y - start.y}};
    double across = -edge.along.y, down = edge.along.x;
    double length = sqrt(across * across + down * down);
    double by = each * (double)depth / (length > 1e-300 ? length : 1e-300);
    edge.start = (Point){start.x + across * by, start.y + down * by};
    edge.stop = (Point){edge.start.x + edge.along.x, edge.start.y + edge.along.y};
    edge.box = with_point(with_point(NOTHING, edge.start), edge.stop);
    return edge;
}

/* Does an edge run through a polygon of `count` lines? Where on them it enters and leaves is only asked of one that is
 * beyond none of them with both its ends, and beyond some with one. */
static inline int runs_through(const Edge *edge, const double *restrict across, const double *restrict down,
                               const double *restrict level, Py_ssize_t count, double *restrict starts,
                               double *restrict stops, Through *through)
{
    const Point start = edge->start, stop = edge->stop;
    int any = 0, both = 0;
    for (Py_ssize_t i = 0; i < count; i++) {
        starts[i] = start.x * across[i] + start.y * down[i] - level[i];
        stops[i] = stop.x * across[i] + stop.y * down[i] - level[i];
        const int begins = starts[i] < 0, ends = stops[i] < 0;
        any |= begins | ends;
        both |= begins & ends;
    }
    if (both)
        return 0;
    double from = 0.0, to = 1.0;
    for (Py_ssize_t i = 0; any && i < count; i++) {
        const double crossing = starts[i] / (starts[i] - stops[i]); /* not used where both are on one side */
        from = greater(from, starts[i] < 0 ? crossing : 0.0);
        to = lesser(to, stops[i] < 0 ? crossing : 1.0);
    }
    through->entry = from;
    through->leave = to;
    return from < to;
}

static void find_near(Picture *picture, int64_t own)
{
    picture->count_near = 0;
    for (Py_ssize_t other = 0; other < picture->layers; other++)
        if (other != own && meet(&picture->boxes[own], &picture->boxes[other]))
            picture->near[picture->count_near++] = other;
}

/* The polygons that an edge runs through, up to the first that holds all of it: nothing beyond that one is seen. */
WIDE static Py_ssize_t all_through(const Picture *picture, const Edge *edge)
{
    Py_ssize_t found = 0;
    for (Py_ssize_t i = 0; i < picture->count_near; i++) {
        int64_t other = picture->near[i];
        if (!meet(&edge->box, &picture->boxes[other]))
            continue;
        Through *place = &picture->through[found];
        place->polygon = other;
        int64_t first = picture->first[other];
        if (!runs_through(edge, picture->lines.across + first, picture->lines.down + first,
                          picture->lines.level + first, picture->first[other + 1] - first, picture->entries,
                          picture->leaves, place))
            continue;
        found++;
        if (place->entry == 0.0 && place->leave == 1.0)
            break;
    }
    return found;
}

/* Where the edge of that number is cut, in the order that its plain twin sorts them in. */
static void sort_cuts(Cut *cuts, const Through *through, Py_ssize_t count, Py_ssize_t number)
{
    for (Py_ssize_t i = 0; i < 2 * count; i++) {
        double place = i < count ? through[i].entry : through[i - count].leave;
        Cut cut = {place, (double)(2 * number) + place};
        Py_ssize_t at = i;
        for (; at > 0 && cuts[at - 1].order > cut.order; at--)
            cuts[at] = cuts[at - 1];
        cuts[at] = cut;
    }
}

static int64_t nearest(const Through *through, Py_ssize_t count, double middle, int64_t nothing)
{
    for (Py_ssize_t i = 0; i < count; i++)
        if (through[i].entry < middle && middle < through[i].leave)
            return through[i].polygon; /* they rise */
    return nothing;
}

static int keep(Pieces *pieces, const Edge *edge, int64_t layer, double begin, double end, double opacity, double glow)
{
    if (pieces->count == pieces->room) {
        Py_ssize_t room = 2 * pieces->room + 256;
        Piece *grown = PyMem_Realloc(pieces->of, (size_t)room * sizeof(Piece));
        if (grown == NULL) {
            PyErr_NoMemory();
            return -1;
        }
        pieces->of = grown;
        pieces->room = room;
    }
    Point start = {edge->start.x + edge->along.x * begin, edge->start.y + edge->along.y * begin};
    Point stop = {edge->start.x + edge->along.x * end, edge->start.y + edge->along.y * end};
    pieces->of[pieces->count++] = (Piece){start, stop, opacity, glow, layer};
    return 0;
}

static int keep_visible(const Picture *picture, Py_ssize_t number, int64_t own, Pieces *pieces)
{
    const Edge *edge = &picture->edges[number];
    Py_ssize_t count = all_through(picture, edge);
    sort_cuts(picture->cuts, picture->through, count, number);
    int open = 0; /* is there a piece that may go on? */
    double from = 0.0, to = 0.0, opacity = 0.0, gain = 0.0;
    for (Py_ssize_t i = 0; i <= 2 * count; i++) {
        double begin = i ? picture->cuts[i - 1].place : 0.0, end = i < 2 * count ? picture->cuts[i].place : 1.0;
        int64_t behind = nearest(picture->through, count, (begin + end) / 2, picture->layers);
        int bare = behind == picture->layers;
        double gains = picture->glow[own] - (bare ? 0.0 : picture->glow[behind]);
        if (behind <= own || !(bare || gains != 0))
            continue;
        if (open && begin == to && (double)bare == opacity && gains == gain) {
            to = end;
            continue;
        }
        if (open && keep(pieces, edge, own, from, to, opacity, gain) < 0)
            return -1;
        open = 1;
        from = begin;
        to = end;
        opacity = bare;
        gain = gains;
    }
    return open ? keep(pieces, edge, own, from, to, opacity, gain) : 0;
}

/* The first edge of each polygon; -1 with an exception where layers do not rise, or not from 0 to below `layers`. */
static int find_first(const int64_t *layer, Py_ssize_t count, Py_ssize_t layers, int64_t *first)
{
    Py_ssize_t next = 0;
    for (Py_ssize_t i = 0; i < count; i++) {
        if (layer[i] < (i ? layer[i - 1] : 0) || layer[i] >= layers) {
            PyErr_SetString(PyExc_ValueError, "layers of edges must rise from 0 to below the number of layers");
            return -1;
        }
        while (next <= layer[i])
            first[next++] = i;
    }
    while (next <= layers)
        first[next++] = count;
    return 0;
}

int visible_pieces(const Point *start, const Point *stop, const int64_t *layer, Py_ssize_t count, const double *glow,
                   Py_ssize_t layers, Pieces *pieces)
{
    Scratch held = {.count = 0};
    Edge *edges = scratch(&held, count, sizeof(Edge));
    double *room = edges ? scratch(&held, 5 * count, sizeof(double)) : NULL;
    int64_t *first = room ? scratch(&held, layers + 1, sizeof(int64_t)) : NULL;
    Extent *boxes = first ? scratch(&held, layers, sizeof(Extent)) : NULL;
    int64_t *near = boxes ? scratch(&held, layers, sizeof(int64_t)) : NULL;
    Through *through = near ? scratch(&held, layers, sizeof(Through)) : NULL;
    Cut *cuts = through ? scratch(&held, 2 * layers, sizeof(Cut)) : NULL;
    int failed = cuts == NULL || find_first(layer, count, layers, first) < 0;
    if (!failed) {
        double each = inset_of(start, count);
        Lines lines = {room, room + count, room + 2 * count};
        for (Py_ssize_t i = 0; i < layers; i++)
            boxes[i] = NOTHING;
        for (Py_ssize_t i = 0; i < count; i++) {
            Edge edge = edges[i] = inset(start[i], stop[i], each, layer[i]);
            boxes[layer[i]] = with_point(with_point(boxes[layer[i]], edge.start), edge.stop);
            lines.across[i] = edge.start.y - edge.stop.y;
            lines.down[i] = edge.stop.x - edge.start.x;
            lines.level[i] = lines.across[i] * edge.start.x + lines.down[i] * edge.start.y;
        }
        Picture picture = {edges, lines, first, boxes, glow, layers, near, 0, through, cuts, room + 3 * count,
                           room + 4 * count};
        for (Py_ssize_t i = 0; i < count && !failed; i++) {
            if (i == first[layer[i]])
                find_near(&picture, layer[i]);
            failed = keep_visible(&picture, i, layer[i], pieces) < 0;
        }
    }
    discard(&held);
    return failed ? -1 : 0;
}
