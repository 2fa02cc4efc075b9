/* High-pass by background prediction from the samples of a neighbourhood; see irtrack/features/highpass.py. */
#include "kernels.h"

/* Sums of so many levels of one byte, and residuals, fit into 16 bits; of two bytes, into 32. */
#define MOST_SAMPLES 128

/* A part of a picture with a rim of `reach` pixels, row after row of `stride`. */
typedef struct {
    uint16_t *levels;
    Py_ssize_t rows, columns, reach, stride;
} Part;

/* Offsets of a pixel's samples from the upper left corner of its neighbourhood. */
typedef struct {
    Py_ssize_t at[MOST_SAMPLES];
    int count;
} Samples;

/* Pixel of a place on an axis that is mirrored at its edge pixels. */
static Py_ssize_t mirrored(Py_ssize_t at, Py_ssize_t edge)
{
    if (edge == 1)
        return 0;
    Py_ssize_t period = 2 * (edge - 1);
    at = (at % period + period) % period;
    return at < edge ? at : period - at;
}

/* Copies the part of a picture that begins at (left, top), and its rim. */
static void copy_part(const Picture *picture, Py_ssize_t left, Py_ssize_t top, Part part)
{
    Py_ssize_t end = left + part.columns + part.reach, inner_end = end < picture->columns ? end : picture->columns;
    left -= part.reach;
    Py_ssize_t inner = left > 0 ? left : 0;
    for (Py_ssize_t row = 0; row < part.rows + 2 * part.reach; row++) {
        Py_ssize_t from = mirrored(top - part.reach + row, picture->rows) * picture->columns;
        uint16_t *to = part.levels + row * part.stride;
        for (Py_ssize_t x = left; x < inner; x++)
            to[x - left] = level_at(picture, from + mirrored(x, picture->columns));
        for (Py_ssize_t x = inner; x < inner_end; x++)
            to[x - left] = level_at(picture, from + x);
        for (Py_ssize_t x = inner_end; x < end; x++)
            to[x - left] = level_at(picture, from + mirrored(x, picture->columns));
    }
}

/* The nearest of the grey levels 0 .. 255 to 128 + scale * residual, ties to the even one. Beside 1.5 * 2^23 a float
 * has no fraction, and its last bits are the level; floats above 0 are in the order of their bits. */
static inline uint8_t level_of(int32_t residual, float scale)
{
    float level = ((float)residual * scale + 128) + 0x1.8p23f;
    const int32_t black = 0x4b400000, white = black + 255;
    int32_t bits;
    memcpy(&bits, &level, sizeof bits);
    bits = bits > black ? bits : black;
    return (uint8_t)((bits < white ? bits : white) - black);
}

/* Writes a row of the picture; `sums` is room for it. Eight samples at a time are added up, so that sums are fetched
 * and put back less often. Differences of unsigned numbers are right where they fit into `Signed`. */
#define HIGH_PASS_ROW(name, Unsigned, Signed)                                                                          \
    WIDE static void name(const uint16_t *corner, const uint16_t *middle, Py_ssize_t columns, const Samples *samples, \
                          float scale, Unsigned *restrict sums, uint8_t *restrict picture)                            \
    {                                                                                                                  \
        memset(sums, 0, (size_t)columns * sizeof *sums);                                                               \
        int i = 0;                                                                                                     \
        for (; i + 8 <= samples->count; i += 8) {                                                                      \
            const uint16_t *a = corner + samples->at[i], *b = corner + samples->at[i + 1];                             \
            const uint16_t *c = corner + samples->at[i + 2], *d = corner + samples->at[i + 3];                         \
            const uint16_t *e = corner + samples->at[i + 4], *f = corner + samples->at[i + 5];                         \
            const uint16_t *g = corner + samples->at[i + 6], *h = corner + samples->at[i + 7];                         \
            for (Py_ssize_t x = 0; x < columns; x++)                                                                   \
                sums[x] = (Unsigned)(sums[x] + a[x] + b[x] + c[x] + d[x] + e[x] + f[x] + g[x] + h[x]);                 \
        }                                                                                                              \
        for (; i < samples->count; i++) {                                                                              \
            const uint16_t *a = corner + samples->at[i];                                                               \
            for (Py_ssize_t x = 0; x < columns; x++)                                                                   \
                sums[x] = (Unsigned)(sums[x] + a[x]);                                                                  \
        }                                                                                                              \
        Unsigned all = (Unsigned)samples->count;                                                                       \
        for (Py_ssize_t x = 0; x < columns; x++)                                                                       \
            picture[x] = level_of((Signed)(Unsigned)(all * middle[x] - sums[x]), scale);                               \
    }

HIGH_PASS_ROW(row_of_bytes, uint16_t, int16_t)
HIGH_PASS_ROW(row_of_words, uint32_t, int32_t)

/* Takes the samples of a kernel (side, side) of the number of samples of each pixel: 1; 0 where they are more than
 * MOST_SAMPLES; -1 with an exception. */
static int samples_of(Call *call, const float *kernel, Py_ssize_t side, Py_ssize_t stride, Samples *samples)
{
    samples->count = 0;
    for (Py_ssize_t i = 0; i < side * side; i++) {
        float times = kernel[i];
        if (!(times >= 0) || (times <= MOST_SAMPLES && times != (float)(int)times)) {
            wrong(call, "high_pass: the samples of a pixel are out of range");
            return -1;
        }
        if (times > (float)(MOST_SAMPLES - samples->count))
            return 0;
        for (int j = 0; j < (int)times; j++)
            samples->at[samples->count++] = i / side * stride + i % side;
    }
    return samples->count > 0 || wrong(call, "high_pass: a kernel without samples") != NULL ? 1 : -1;
}

KERNEL(high_pass, 6)
{
    Py_ssize_t size, pixels;
    Picture seen = image(call, 0);
    const float *kernel = input(call, 1, "f", &size);
    Py_ssize_t side = !call->failed && last(call)->ndim == 2 ? last(call)->shape[0] : 0;
    double gain = number(call, 2);
    Py_ssize_t left = whole(call, 3), top = whole(call, 4);
    uint8_t *picture = output(call, 5, "B", &pixels);
    if (call->failed)
        return NULL;
    if (side % 2 != 1 || side * side != size || last(call)->ndim != 2)
        return wrong(call, "high_pass: sizes do not agree");
    Part part = {.rows = last(call)->shape[0], .columns = last(call)->shape[1], .reach = side / 2};
    part.stride = part.columns + 2 * part.reach;
    if (seen.rows > MOST_PIXELS || seen.columns > MOST_PIXELS || side > MOST_PIXELS || left < 0 || top < 0 ||
        left > seen.columns - part.columns || top > seen.rows - part.rows)
        return wrong(call, "high_pass: a part out of range");
    Samples samples;
    int few = samples_of(call, kernel, side, part.stride, &samples);
    if (few < 0)
        return NULL;
    if (few == 0 || part.rows == 0 || part.columns == 0)
        return Py_NewRef(few ? Py_True : Py_False);
    part.levels = room(call, (part.rows + 2 * part.reach) * part.stride, sizeof *part.levels);
    void *sums = room(call, part.columns, sizeof(uint32_t));
    if (call->failed)
        return NULL;
    copy_part(&seen, left, top, part);
    float scale = (float)(gain / samples.count);
    for (Py_ssize_t row = 0; row < part.rows; row++) {
        const uint16_t *corner = part.levels + row * part.stride;
        const uint16_t *middle = corner + part.reach * part.stride + part.reach;
        uint8_t *to = picture + row * part.columns;
        if (seen.bytes == 1)
            row_of_bytes(corner, middle, part.columns, &samples, scale, sums, to);
        else
            row_of_words(corner, middle, part.columns, &samples, scale, sums, to);
    }
    return Py_NewRef(Py_True);
}
