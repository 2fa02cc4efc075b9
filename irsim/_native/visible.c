/* Visible pieces of the edges of convex polygons. `visible_edges` in irsim/geometry/polygon.py does the same in the same
 * order, so that pieces agree to the last bit. */
#include "body.h"

/* Edges of each layer lie this much further in than those of the layer in front. */
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
} InsetEdge;

/* The lines of edges: across * x + down * y = level, greater inside the polygon. */
typedef struct {
    double *across, *down, *level;
} Lines;

/* The part of an edge in a polygon: from entry to leave, 0..1 along it. */
typedef struct {
    int64_t polygon;
    double entry, leave;
} Through;

typedef struct {
    double place, order;
} Cut;

typedef struct {
    const InsetEdge *edges;
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

static InsetEdge inset(Point start, Point stop, double each, int64_t depth)
{
    InsetEdge edge = {.along = {stop.x - start.x, stop.y - start.y}};
    double across = -edge.along.y, down = edge.along.x;
    double length = sqrt(across * across + down * down);
    double by = each * (double)depth / (length > 1e-300 ? length : 1e-300);
    edge.start = (Point){start.x + across * by, start.y + down * by};
    edge.stop = (Point){edge.start.x + edge.along.x, edge.start.y + edge.along.y};
    edge.box = with_point(with_point(NOTHING, edge.start), edge.stop);
    return edge;
}

/* The lines of one polygon, and room for how far an edge's ends are beyond each. */
typedef struct {
    const double *across, *down, *level;
    Py_ssize_t count;
    double *starts, *stops;
} Sides;

/* 1 with the part of an edge in a polygon, 0 where there is none. Crossings count only with lines that one end is beyond;
 * an edge with both ends beyond a line is outside. */
static inline int runs_through(const InsetEdge *edge, const Sides *sides, Through *through)
{
    const Point start = edge->start, stop = edge->stop;
    const double *restrict across = sides->across, *restrict down = sides->down, *restrict level = sides->level;
    double *restrict starts = sides->starts, *restrict stops = sides->stops;
    const Py_ssize_t count = sides->count;
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

#ifdef SIXTEENS
#define FOURS 4
/* The same, four lines at a time: whole bodies take 0.9 of the time. */
FUSING INLINED int runs_through_by_fours(const InsetEdge *edge, const Sides *sides, Through *through)
{
    static const int64_t asked[2 * FOURS] = {-1, -1, -1, -1, 0, 0, 0, 0};
    const __m256d start_x = _mm256_set1_pd(edge->start.x), start_y = _mm256_set1_pd(edge->start.y);
    const __m256d stop_x = _mm256_set1_pd(edge->stop.x), stop_y = _mm256_set1_pd(edge->stop.y);
    const __m256d zero = _mm256_setzero_pd(), one = _mm256_set1_pd(1.0);
    __m256d from = zero, to = one;
    int any = 0;
    for (Py_ssize_t i = 0; i < sides->count; i += FOURS) {
        const Py_ssize_t left = sides->count - i, absent = left < FOURS ? FOURS - left : 0;
        const __m256i some = _mm256_loadu_si256((const __m256i *)(asked + absent));
        const __m256d x = _mm256_maskload_pd(sides->across + i, some);
        const __m256d y = _mm256_maskload_pd(sides->down + i, some);
        const __m256d level = _mm256_maskload_pd(sides->level + i, some); /* absent lines have nothing beyond */
        const __m256d starts = _mm256_sub_pd(_mm256_add_pd(_mm256_mul_pd(start_x, x), _mm256_mul_pd(start_y, y)), level);
        const __m256d stops = _mm256_sub_pd(_mm256_add_pd(_mm256_mul_pd(stop_x, x), _mm256_mul_pd(stop_y, y)), level);
        const __m256d begins = _mm256_cmp_pd(starts, zero, _CMP_LT_OQ), ends = _mm256_cmp_pd(stops, zero, _CMP_LT_OQ);
        if (!_mm256_testz_pd(begins, ends))
            return 0;
        if (_mm256_movemask_pd(_mm256_or_pd(begins, ends))) {
            const __m256d crossing = _mm256_div_pd(starts, _mm256_sub_pd(starts, stops));
            from = _mm256_max_pd(from, _mm256_blendv_pd(zero, crossing, begins));
            to = _mm256_min_pd(to, _mm256_blendv_pd(one, crossing, ends));
            any = 1;
        }
    }
    double entries[FOURS] = {0.0}, leaves[FOURS] = {1.0};
    if (any) {
        _mm256_storeu_pd(entries, from);
        _mm256_storeu_pd(leaves, to);
        for (int i = 1; i < FOURS; i++) {
            entries[0] = greater(entries[0], entries[i]);
            leaves[0] = lesser(leaves[0], leaves[i]);
        }
    }
    through->entry = entries[0];
    through->leave = leaves[0];
    return entries[0] < leaves[0];
}
#else
#define runs_through_by_fours runs_through
#endif

static void find_near(Picture *picture, int64_t own)
{
    picture->count_near = 0;
    for (Py_ssize_t other = 0; other < picture->layers; other++)
        if (other != own && meet(&picture->boxes[own], &picture->boxes[other]))
            picture->near[picture->count_near++] = other;
}

/* Finds the polygons that an edge runs through, up to the first that holds all of it: it hides all beyond. */
INLINED Py_ssize_t find_through(const Picture *picture, const InsetEdge *edge, int fused)
{
    Py_ssize_t found = 0;
    for (Py_ssize_t i = 0; i < picture->count_near; i++) {
        int64_t other = picture->near[i];
        if (!meet(&edge->box, &picture->boxes[other]))
            continue;
        Through *place = &picture->through[found];
        place->polygon = other;
        const Lines *lines = &picture->lines;
        const int64_t first = picture->first[other];
        const Sides sides = {lines->across + first, lines->down + first, lines->level + first,
                             picture->first[other + 1] - first, picture->entries, picture->leaves};
        if (!(fused ? runs_through_by_fours : runs_through)(edge, &sides, place))
            continue;
        found++;
        if (place->entry == 0.0 && place->leave == 1.0)
            break;
    }
    return found;
}

BOTH(Py_ssize_t, find_through, (const Picture *picture, const InsetEdge *edge), picture, edge)

/* Sorts the cuts of edge `number` in the order of the plain twin. */
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

static int keep(Pieces *pieces, const InsetEdge *edge, int64_t layer, double begin, double end, double opacity, double glow)
{
    if (pieces->count == pieces->room) {
        Piece *larger = grown(pieces->of, &pieces->room, sizeof(Piece));
        if (larger == NULL) {
            PyErr_NoMemory();
            return -1;
        }
        pieces->of = larger;
    }
    Point start = {edge->start.x + edge->along.x * begin, edge->start.y + edge->along.y * begin};
    Point stop = {edge->start.x + edge->along.x * end, edge->start.y + edge->along.y * end};
    pieces->of[pieces->count++] = (Piece){start, stop, opacity, glow, layer};
    return 0;
}

static int keep_visible(const Picture *picture, Py_ssize_t number, int64_t own, Pieces *pieces)
{
    const InsetEdge *edge = &picture->edges[number];
    Py_ssize_t count = CHOSEN(find_through)(picture, edge);
    sort_cuts(picture->cuts, picture->through, count, number);
    int open = 0; /* a piece may go on */
    double from = 0.0, to = 0.0, opacity = 0.0, gain = 0.0;
    for (Py_ssize_t i = 0; i <= 2 * count; i++) {
        double begin = i ? picture->cuts[i - 1].place : 0.0, end = i < 2 * count ? picture->cuts[i].place : 1.0;
        if (!(begin < end))
            continue; /* of no length */
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
    InsetEdge *edges = scratch_as_is(&held, count, sizeof(InsetEdge));
    double *room = scratch_as_is(&held, 5 * count, sizeof(double));
    int64_t *first = scratch_as_is(&held, layers + 1, sizeof(int64_t));
    Extent *boxes = scratch_as_is(&held, layers, sizeof(Extent));
    int64_t *near = scratch_as_is(&held, layers, sizeof(int64_t));
    Through *through = scratch_as_is(&held, layers, sizeof(Through));
    Cut *cuts = scratch_as_is(&held, 2 * layers, sizeof(Cut));
    int failed = held.failed || find_first(layer, count, layers, first) < 0;
    if (!failed) {
        double each = inset_of(start, count);
        Lines lines = {room, room + count, room + 2 * count};
        for (Py_ssize_t i = 0; i < layers; i++)
            boxes[i] = NOTHING;
        for (Py_ssize_t i = 0; i < count; i++) {
            InsetEdge edge = edges[i] = inset(start[i], stop[i], each, layer[i]);
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
