/* Contrast of patches with their eight neighbours; see irtrack/detectors/local_contrast.py. */
#include "kernels.h"

#define LEAST(a, b) ((a) < (b) ? (a) : (b))
#define GREATEST(a, b) ((a) > (b) ? (a) : (b))

/* A row of the means of patches, and those one patch above and below; each goes on by a patch on both sides. */
typedef struct {
    const float *above, *middle, *below;
    Py_ssize_t side, columns;
} Row;

/* The least product of differences to opposite neighbours; 0 where a neighbour is brighter. */
WIDE static void patch_row(Row row, const float *unused, float *restrict largest)
{
    (void)unused;
    const float *a = row.above, *m = row.middle, *b = row.below;
    Py_ssize_t s = row.side;
    for (Py_ssize_t x = 0; x < row.columns; x++) {
        float right = m[x] - m[x + s], left = m[x] - m[x - s], lower = m[x] - b[x], upper = m[x] - a[x];
        float lower_right = m[x] - b[x + s], upper_left = m[x] - a[x - s];
        float lower_left = m[x] - b[x - s], upper_right = m[x] - a[x + s];
        float along = LEAST(right * left, lower * upper), across = LEAST(lower_right * upper_left, lower_left * upper_right);
        float least = LEAST(along, across);
        float first = LEAST(LEAST(right, lower), LEAST(lower_right, lower_left));
        float contrast = first > 0 ? least : 0;
        largest[x] = GREATEST(largest[x], contrast);
    }
}

/* The square of the highest pixel over the brightest neighbour, which is at least 1. */
WIDE static void local_row(Row row, const float *peak, float *restrict largest)
{
    const float *a = row.above, *m = row.middle, *b = row.below;
    Py_ssize_t s = row.side;
    for (Py_ssize_t x = 0; x < row.columns; x++) {
        float upper = GREATEST(GREATEST(a[x - s], a[x]), a[x + s]), lower = GREATEST(GREATEST(b[x - s], b[x]), b[x + s]);
        float brightest = GREATEST(GREATEST(upper, lower), GREATEST(GREATEST(m[x - s], m[x + s]), 1.0f));
        float contrast = peak[x] * peak[x] / brightest;
        largest[x] = GREATEST(largest[x], contrast);
    }
}

/* Arguments: mean (rows + 2 side, columns + 2 side), side, largest (rows, columns), for `local` peak (rows, columns). */
static PyObject *contrast(Call *call, int local)
{
    Py_ssize_t pixels, wide, peaks = 0;
    const float *mean = input(call, 0, "f", &wide);
    Py_ssize_t side = whole(call, 1);
    float *largest = output(call, 2, "f", &pixels);
    Py_ssize_t rows = 0, columns = 0;
    if (!call->failed && last(call)->ndim == 2) {
        rows = last(call)->shape[0];
        columns = last(call)->shape[1];
    }
    const float *peak = local ? input(call, 3, "f", &peaks) : NULL;
    if (call->failed)
        return NULL;
    if (side < 1 || side > MOST_PIXELS || rows < 1 || rows > MOST_PIXELS || columns > MOST_PIXELS ||
        wide != (rows + 2 * side) * (columns + 2 * side) || (local && peaks != pixels))
        return wrong(call, "contrast: sizes do not agree");
    Py_ssize_t stride = columns + 2 * side;
    for (Py_ssize_t y = 0; y < rows; y++) {
        const float *middle = mean + (y + side) * stride + side;
        Row row = {middle - side * stride, middle, middle + side * stride, side, columns};
        (local ? local_row : patch_row)(row, local ? peak + y * columns : NULL, largest + y * columns);
    }
    return done(call);
}

KERNEL(patch_contrast, 3) { return contrast(call, 0); }

KERNEL(local_contrast, 4) { return contrast(call, 1); }
