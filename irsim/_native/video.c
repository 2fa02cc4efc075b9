/* Noise reduction over time and detail enhancement of a camera core; see irsim/camera/temporal_filter.py and
 * irsim/camera/detail.py. */
#include "kernels.h"

/* Changes of a row, and one more on either side. */
INLINED void changes(const uint16_t *counts, const float *filtered, float *change, Py_ssize_t columns)
{
    for (Py_ssize_t i = 0; i < columns; i++)
        change[i + 1] = (float)counts[i] - filtered[i];
    change[0] = change[1];
    change[columns + 1] = change[columns];
}

INLINED void filter(const float *filtered, const uint16_t *counts, Py_ssize_t rows, Py_ssize_t columns, float gain,
                    float slope, float *memory, float *out)
{
    const Py_ssize_t wide = columns + 2;
    float *above = memory, *here = memory + wide, *below = memory + 2 * wide, *sum = memory + 3 * wide;
    changes(counts, filtered, here, columns);
    memcpy(above, here, (size_t)wide * sizeof *here);
    for (Py_ssize_t row = 0; row < rows; row++) {
        const Py_ssize_t next = (row + 1 < rows ? row + 1 : row) * columns;
        changes(counts + next, filtered + next, below, columns);
        for (Py_ssize_t i = 0; i < wide; i++)
            sum[i] = (above[i] + here[i]) + below[i];
        const float *before = filtered + row * columns;
        float *after = out + row * columns;
        for (Py_ssize_t i = 0; i < columns; i++) {
            const float weight = gain + slope * fabsf((sum[i] + sum[i + 1]) + sum[i + 2]);
            after[i] = before[i] + (weight < 1.0f ? weight : 1.0f) * here[i + 1];
        }
        float *free = above;
        above = here;
        here = below;
        below = free;
    }
}

FUSING static void filter_fused(const float *filtered, const uint16_t *counts, Py_ssize_t rows, Py_ssize_t columns,
                                float gain, float slope, float *memory, float *out)
{
    filter(filtered, counts, rows, columns, gain, slope, memory, out);
}

static void filter_twice(const float *filtered, const uint16_t *counts, Py_ssize_t rows, Py_ssize_t columns, float gain,
                         float slope, float *memory, float *out)
{
    filter(filtered, counts, rows, columns, gain, slope, memory, out);
}

KERNEL(recursive, 6)
{
    Py_ssize_t length, other, written;
    const float *filtered = input(call, 0, "f", &length);
    const uint16_t *counts = input(call, 1, "H", &other);
    const Py_ssize_t columns = whole(call, 2);
    const float gain = (float)number(call, 3), slope = (float)number(call, 4);
    float *out = output(call, 5, "f", &written);
    if (!call->failed && (columns < 1 || length < 1 || length % columns || other != length || written != length))
        return wrong(call, "whole rows are required, of frames of one size");
    float *memory = room(call, 4 * (columns + 2), sizeof *memory);
    if (call->failed)
        return NULL;
    CHOSEN(filter)(filtered, counts, length / columns, columns, gain, slope, memory, out);
    return done(call);
}

typedef struct {
    const float *slope, *offset;
    Py_ssize_t rows; /* of the coarse grid */
    float most;
} Lines;

INLINED void apply(const float *counts, const Lines *by, Py_ssize_t rows, Py_ssize_t columns, uint16_t *out)
{
    const double scale = (double)by->rows / (double)rows;
    for (Py_ssize_t row = 0; row < rows; row++) {
        double at = ((double)row + 0.5) * scale - 0.5;
        at = at < 0.0 ? 0.0 : at;
        at = at > (double)(by->rows - 1) ? (double)(by->rows - 1) : at;
        const Py_ssize_t first = (Py_ssize_t)at, second = first + 1 < by->rows ? first + 1 : first;
        const float part = (float)(at - (double)first);
        const float *slope = by->slope + first * columns, *more_slope = by->slope + second * columns;
        const float *offset = by->offset + first * columns, *more_offset = by->offset + second * columns;
        const float *own = counts + row * columns;
        uint16_t *to = out + row * columns;
        for (Py_ssize_t i = 0; i < columns; i++) {
            const float line = slope[i] + part * (more_slope[i] - slope[i]);
            const float added = offset[i] + part * (more_offset[i] - offset[i]);
            float value = own[i] * line + added;
            value = value < 0.0f ? 0.0f : value;
            value = value > by->most ? by->most : value;
            to[i] = (uint16_t)(int32_t)(value + 0.5f);
        }
    }
}

FUSING static void apply_fused(const float *counts, const Lines *by, Py_ssize_t rows, Py_ssize_t columns, uint16_t *out)
{
    apply(counts, by, rows, columns, out);
}

static void apply_twice(const float *counts, const Lines *by, Py_ssize_t rows, Py_ssize_t columns, uint16_t *out)
{
    apply(counts, by, rows, columns, out);
}

KERNEL(enhance, 6)
{
    Py_ssize_t length, coarse, other, written;
    const float *counts = input(call, 0, "f", &length);
    const float *slope = input(call, 1, "f", &coarse), *offset = input(call, 2, "f", &other);
    const Py_ssize_t columns = whole(call, 3);
    const float most = (float)number(call, 4);
    uint16_t *out = output(call, 5, "H", &written);
    if (!call->failed && (columns < 1 || length < 1 || coarse < 1 || length % columns || coarse % columns ||
                          other != coarse || written != length || !(most >= 0.0f && most <= 65535.0f)))
        return wrong(call, "whole rows are required, frames of one size, and counts of 16 bits");
    if (call->failed)
        return NULL;
    const Lines by = {slope, offset, coarse / columns, most};
    CHOSEN(apply)(counts, &by, length / columns, columns, out);
    return done(call);
}
