/* Maxima of a response, their centres and sizes; medians along lines; see irtrack/detectors/base.py, morphology.py. */
#include "kernels.h"

/* A float32 picture, row after row, and n places in it. */
typedef struct {
    const float *pixels;
    Py_ssize_t rows, columns, count;
    const int64_t *places;
} Peaks;

/* Arguments 0 and 1: the picture (rows, columns) and the places (n,). */
static Peaks peaks_of(Call *call)
{
    Peaks peaks = {.count = 0};
    Py_ssize_t pixels;
    peaks.pixels = input(call, 0, "f", &pixels);
    if (!call->failed && last(call)->ndim != 2)
        wrong(call, "peaks: a picture (rows, columns) is required");
    if (call->failed)
        return peaks;
    peaks.rows = last(call)->shape[0];
    peaks.columns = last(call)->shape[1];
    peaks.places = input(call, 1, INTP, &peaks.count);
    for (Py_ssize_t k = 0; !call->failed && k < peaks.count; k++)
        if (peaks.places[k] < 0 || peaks.places[k] >= pixels)
            wrong(call, "peaks: a place is outside the picture");
    return peaks;
}

static inline Py_ssize_t clipped(Py_ssize_t at, Py_ssize_t count)
{
    return at < 0 ? 0 : at >= count ? count - 1 : at;
}

/* 0 where a pixel of the square around a place is higher; 2 where one is as high, or the place is at the frame's edge, which
 * is repeated; else 1. */
static uint8_t rank_of(const Peaks *peaks, Py_ssize_t place, Py_ssize_t reach)
{
    Py_ssize_t row = place / peaks->columns, column = place % peaks->columns, equal = 0;
    Py_ssize_t left = clipped(column - reach, peaks->columns), right = clipped(column + reach, peaks->columns);
    Py_ssize_t top = clipped(row - reach, peaks->rows), bottom = clipped(row + reach, peaks->rows);
    float own = peaks->pixels[place];
    for (Py_ssize_t y = top; y <= bottom; y++)
        for (const float *at = peaks->pixels + y * peaks->columns + left, *end = at + (right - left); at <= end; at++) {
            if (*at > own)
                return 0;
            equal += *at == own;
        }
    int at_edge = row == 0 || column == 0 || row == peaks->rows - 1 || column == peaks->columns - 1;
    return equal > 1 || at_edge ? 2 : 1;
}

/* Arguments: heights (rows, columns), places (n,), reach, found (n,) uint8. */
KERNEL(highest, 4)
{
    Py_ssize_t count;
    Peaks peaks = peaks_of(call);
    Py_ssize_t reach = whole(call, 2);
    uint8_t *found = output(call, 3, "B", &count);
    if (call->failed)
        return NULL;
    if (reach < 1 || reach > MOST_PIXELS || count != peaks.count)
        return wrong(call, "highest: lengths do not agree");
    for (Py_ssize_t k = 0; k < count; k++)
        found[k] = rank_of(&peaks, peaks.places[k], reach);
    return done(call);
}

/* A morphological closing of places by a square: pixels near one of them, closed, and numbered by their group from 2. */
typedef struct {
    int32_t *marks;
    Py_ssize_t rows, columns, reach;
} Closing;
enum { NEAR = 1, CLOSED = -1 };

/* Whether all pixels of the frame in the square around one are near a place. */
static int is_closed(const Closing *closing, Py_ssize_t row, Py_ssize_t column)
{
    Py_ssize_t left = clipped(column - closing->reach, closing->columns);
    Py_ssize_t right = clipped(column + closing->reach, closing->columns);
    Py_ssize_t bottom = clipped(row + closing->reach, closing->rows);
    for (Py_ssize_t y = clipped(row - closing->reach, closing->rows); y <= bottom; y++)
        for (Py_ssize_t x = left; x <= right; x++)
            if (closing->marks[y * closing->columns + x] == 0)
                return 0;
    return 1;
}

/* Marks the pixels of the square around a place as near, or those of them that are closed. */
static void mark(Closing *closing, Py_ssize_t place, int closed)
{
    Py_ssize_t row = place / closing->columns, column = place % closing->columns;
    Py_ssize_t left = clipped(column - closing->reach, closing->columns);
    Py_ssize_t right = clipped(column + closing->reach, closing->columns);
    Py_ssize_t bottom = clipped(row + closing->reach, closing->rows);
    for (Py_ssize_t y = clipped(row - closing->reach, closing->rows); y <= bottom; y++)
        for (Py_ssize_t x = left; x <= right; x++) {
            int32_t *own = closing->marks + y * closing->columns + x;
            if (!closed || (*own == NEAR && is_closed(closing, y, x)))
                *own = closed ? CLOSED : NEAR;
        }
}

/* Numbers all closed pixels that touch a closed one, directly or not; `stack` has room for each pixel once. */
static void number_group(Closing *closing, Py_ssize_t place, int32_t group, Py_ssize_t *stack)
{
    Py_ssize_t count = 1;
    stack[0] = place;
    closing->marks[place] = group;
    while (count > 0) {
        Py_ssize_t at = stack[--count], row = at / closing->columns, column = at % closing->columns;
        for (Py_ssize_t y = clipped(row - 1, closing->rows); y <= clipped(row + 1, closing->rows); y++)
            for (Py_ssize_t x = clipped(column - 1, closing->columns); x <= clipped(column + 1, closing->columns); x++)
                if (closing->marks[y * closing->columns + x] == CLOSED) {
                    closing->marks[y * closing->columns + x] = group;
                    stack[count++] = y * closing->columns + x;
                }
    }
}

/* Arguments: heights (rows, columns), places (n,) in rising order, reach, found (n,) uint8. */
KERNEL(merge_places, 4)
{
    Py_ssize_t count;
    Peaks peaks = peaks_of(call);
    Py_ssize_t reach = whole(call, 2), pixels = call->failed ? 0 : peaks.rows * peaks.columns;
    uint8_t *found = output(call, 3, "B", &count);
    if (!call->failed && (reach < 1 || reach > MOST_PIXELS || count != peaks.count || count > INT32_MAX - 2))
        wrong(call, "merge_places: lengths do not agree");
    Closing closing = {room(call, pixels, sizeof(int32_t)), peaks.rows, peaks.columns, reach};
    Py_ssize_t *stack = room(call, pixels, sizeof(*stack));
    double *sums = room(call, 3 * (count + 2), sizeof(double)), *least = room(call, count + 2, sizeof(double));
    Py_ssize_t *chosen = room(call, count + 2, sizeof(*chosen));
    if (call->failed)
        return NULL;
    for (int closed = 0; closed < 2; closed++)
        for (Py_ssize_t k = 0; k < count; k++)
            mark(&closing, peaks.places[k], closed);
    int32_t groups = 2;
    for (Py_ssize_t k = 0; k < count; k++) {
        Py_ssize_t place = peaks.places[k];
        if (closing.marks[place] == CLOSED)
            number_group(&closing, place, groups++, stack);
        double *sum = sums + 3 * closing.marks[place];
        sum[0] += 1;
        sum[1] += (double)(place / peaks.columns);
        sum[2] += (double)(place % peaks.columns);
    }
    for (Py_ssize_t k = 0; k < count; k++) {
        Py_ssize_t place = peaks.places[k], group = closing.marks[place];
        const double *sum = sums + 3 * group;
        double down = (double)(place / peaks.columns) - sum[1] / sum[0], across = (double)(place % peaks.columns) - sum[2] / sum[0];
        double distance = down * down + across * across;
        found[k] = sum[0] > 0 && (chosen[group] == 0 || distance < least[group]);
        if (found[k]) {
            if (chosen[group] > 0)
                found[chosen[group] - 1] = 0;
            chosen[group] = k + 1;
            least[group] = distance;
        }
    }
    return done(call);
}

/* Distance of a parabola's vertex from the middle one of three values. */
static double vertex(float before, double at, float after)
{
    double bend = (double)before - 2 * at + (double)after, least = bend < -1e-9 ? bend : -1e-9;
    double by = 0.5 * ((double)before - (double)after) / least;
    return by < -0.5 ? -0.5 : by > 0.5 ? 0.5 : by;
}

/* Arguments: heights (rows, columns), places (n,), centers (n, 2). */
KERNEL(vertices, 3)
{
    Py_ssize_t numbers;
    Peaks peaks = peaks_of(call);
    double *centers = output(call, 2, "d", &numbers);
    if (call->failed)
        return NULL;
    if (numbers != 2 * peaks.count)
        return wrong(call, "vertices: lengths do not agree");
    for (Py_ssize_t k = 0; k < peaks.count; k++) {
        Py_ssize_t row = peaks.places[k] / peaks.columns, column = peaks.places[k] % peaks.columns;
        const float *at = peaks.pixels + peaks.places[k];
        centers[2 * k] = (double)column;
        centers[2 * k + 1] = (double)row;
        if (column > 0 && column < peaks.columns - 1)
            centers[2 * k] += vertex(at[-1], *at, at[1]);
        if (row > 0 && row < peaks.rows - 1)
            centers[2 * k + 1] += vertex(at[-peaks.columns], *at, at[peaks.columns]);
    }
    return done(call);
}

/* The value of rank k of the values, which are put in part into order (Hoare's selection). */
static float ranked(float *values, Py_ssize_t count, Py_ssize_t k)
{
    Py_ssize_t left = 0, right = count - 1;
    while (left < right) {
        float pivot = values[left + (right - left) / 2];
        Py_ssize_t i = left, j = right;
        while (i <= j) {
            while (values[i] < pivot)
                i++;
            while (pivot < values[j])
                j--;
            if (i <= j) {
                float swapped = values[i];
                values[i++] = values[j];
                values[j--] = swapped;
            }
        }
        if (k <= j)
            right = j;
        else if (k >= i)
            left = i;
        else
            break;
    }
    return values[k];
}

/* Pixels of a line through a place, outwards, at which its height above the level falls below the half. */
static double arm(const Peaks *peaks, Py_ssize_t place, Py_ssize_t down, Py_ssize_t across, Py_ssize_t reach,
                  double level, double half)
{
    Py_ssize_t row = place / peaks->columns, column = place % peaks->columns, first = 0;
    double inner = 0, outer = (double)peaks->pixels[place] - level;
    do {
        first++;
        inner = outer;
        Py_ssize_t y = clipped(row + down * first, peaks->rows), x = clipped(column + across * first, peaks->columns);
        outer = (double)peaks->pixels[y * peaks->columns + x] - level;
    } while (first < reach && !(outer < half));
    double by = (inner - half) / (inner - outer > 1e-6 ? inner - outer : 1e-6);
    return (double)(first - 1) + (by < 0 ? 0 : by > 1 ? 1 : by);
}

/* Arguments: picture (rows, columns), places (n,), reach, edges (n, 8 reach), sizes (n, 2), heights (n,). */
KERNEL(peak_sizes, 6)
{
    Py_ssize_t pixels, numbers, count;
    Peaks peaks = peaks_of(call);
    Py_ssize_t reach = whole(call, 2);
    float *edges = output(call, 3, "f", &pixels);
    double *sizes = output(call, 4, "d", &numbers), *heights = output(call, 5, "d", &count);
    if (call->failed)
        return NULL;
    if (reach < 1 || reach > MOST_PIXELS || count != peaks.count || numbers != 2 * count || pixels / (8 * reach) != count ||
        pixels % (8 * reach))
        return wrong(call, "peak_sizes: lengths do not agree");
    float *sorted = room(call, 8 * reach, sizeof(float));
    if (sorted == NULL)
        return NULL;
    for (Py_ssize_t k = 0; k < count; k++) {
        Py_ssize_t place = peaks.places[k], row = place / peaks.columns, column = place % peaks.columns;
        float *edge = edges + 8 * reach * k;
        for (Py_ssize_t i = -reach; i <= reach; i++) {
            Py_ssize_t y = clipped(row + i, peaks.rows), x = clipped(column + i, peaks.columns);
            edge[i + reach] = peaks.pixels[clipped(row - reach, peaks.rows) * peaks.columns + x];
            edge[i + 3 * reach + 1] = peaks.pixels[clipped(row + reach, peaks.rows) * peaks.columns + x];
            if (-reach < i && i < reach) {
                const float *line = peaks.pixels + y * peaks.columns;
                edge[i + 5 * reach + 1] = line[clipped(column - reach, peaks.columns)];
                edge[i + 7 * reach] = line[clipped(column + reach, peaks.columns)];
            }
        }
        memcpy(sorted, edge, (size_t)(8 * reach) * sizeof(float));
        double level = ranked(sorted, 8 * reach, 4 * reach), height = (double)peaks.pixels[place] - level, half = height / 2;
        double across = arm(&peaks, place, 0, -1, reach, level, half) + arm(&peaks, place, 0, 1, reach, level, half);
        double down = arm(&peaks, place, -1, 0, reach, level, half) + arm(&peaks, place, 1, 0, reach, level, half);
        heights[k] = height;
        sizes[2 * k] = across > 1 ? across : 1;
        sizes[2 * k + 1] = down > 1 ? down : 1;
    }
    return done(call);
}

#define LOWER(a, b) ((a) < (b) ? (a) : (b))
#define HIGHER(a, b) ((a) > (b) ? (a) : (b))
/* Puts the lower one of two values first. */
#define SORT(a, b)                                                                                                     \
    do {                                                                                                               \
        uint16_t lower = LOWER(a, b);                                                                                  \
        b = HIGHER(a, b);                                                                                              \
        a = lower;                                                                                                     \
    } while (0)
#define MOST_REACH 5
#define BLOCK 64

/* Raises largest (count,) to the medians of 2 reach + 1 pixels, `step` apart; the first at `line`. Forgetful selection. */
WIDE static void raise_to_medians(const uint16_t *line, Py_ssize_t step, Py_ssize_t reach, Py_ssize_t count,
                                  uint16_t *restrict largest)
{
    uint16_t held[MOST_REACH + 2][BLOCK] = {{0}};
    Py_ssize_t start = reach + 2, total = 2 * reach + 1;
    for (Py_ssize_t begin = 0; begin < count; begin += BLOCK) {
        Py_ssize_t width = count - begin < BLOCK ? count - begin : BLOCK;
        for (Py_ssize_t k = 0; k < start; k++)
            for (Py_ssize_t x = 0; x < width; x++)
                held[k][x] = line[k * step + begin + x];
        Py_ssize_t kept = start;
        for (Py_ssize_t next = start; kept > 1; next++) {
            for (Py_ssize_t k = 1; k < kept; k++) /* the least comes to the front, the greatest to the end */
                for (Py_ssize_t x = 0; x < BLOCK; x++)
                    SORT(held[0][x], held[k][x]);
            for (Py_ssize_t k = 1; k < kept - 1; k++)
                for (Py_ssize_t x = 0; x < BLOCK; x++)
                    SORT(held[k][x], held[kept - 1][x]);
            kept -= 1; /* of the last one */
            if (next < total)
                for (Py_ssize_t x = 0; x < width; x++)
                    held[0][x] = line[next * step + begin + x];
            else {
                for (Py_ssize_t x = 0; x < BLOCK; x++)
                    held[0][x] = held[1][x];
                break;
            }
        }
        for (Py_ssize_t x = 0; x < width; x++)
            largest[begin + x] = HIGHER(largest[begin + x], held[0][x]);
    }
}

/* Arguments: wide (rows + 2 reach, columns + 2 reach), reach, largest (rows, columns). */
KERNEL(line_medians, 3)
{
    Py_ssize_t pixels, within;
    const uint16_t *wide = input(call, 0, "H", &pixels);
    Py_ssize_t reach = whole(call, 1);
    uint16_t *largest = output(call, 2, "H", &within);
    if (!call->failed && last(call)->ndim != 2)
        wrong(call, "line_medians: a picture (rows, columns) is required");
    if (call->failed)
        return NULL;
    Py_ssize_t rows = last(call)->shape[0], columns = last(call)->shape[1], stride = columns + 2 * reach;
    if (reach < 1 || reach > MOST_REACH || rows > MOST_PIXELS || columns > MOST_PIXELS ||
        pixels != (rows + 2 * reach) * stride)
        return wrong(call, "line_medians: sizes do not agree");
    for (Py_ssize_t y = 0; y < rows; y++) {
        const uint16_t *middle = wide + (y + reach) * stride + reach;
        uint16_t *out = largest + y * columns;
        const Py_ssize_t steps[] = {1, stride, stride + 1, stride - 1};
        memset(out, 0, (size_t)columns * sizeof(*out));
        for (int k = 0; k < 4; k++)
            raise_to_medians(middle - reach * steps[k], steps[k], reach, columns, out);
    }
    return done(call);
}
