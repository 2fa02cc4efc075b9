/* Points and boxes in the picture, px. */
#ifndef IRSIM_POINTS_H
#define IRSIM_POINTS_H

#include <math.h>

typedef struct {
    double x, y;
} Point;

typedef struct {
    Point low, high;
} Extent;

static const Extent NOTHING = {{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};

static inline double lesser(double a, double b)
{
    return a < b ? a : b;
}

static inline double greater(double a, double b)
{
    return a > b ? a : b;
}

static inline Extent with_point(Extent held, Point point)
{
    Extent wider = {{lesser(held.low.x, point.x), lesser(held.low.y, point.y)},
                    {greater(held.high.x, point.x), greater(held.high.y, point.y)}};
    return wider;
}

static inline int meet(const Extent *a, const Extent *b)
{
    return (a->low.x <= b->high.x) & (b->low.x <= a->high.x) & (a->low.y <= b->high.y) & (b->low.y <= a->high.y);
}

#endif
