/* Windows moved by mean shift; see irtrack/features/mean_shift.py for the equations. */
#include "kernels.h"

#define LARGEST_BANDWIDTH 1e6

/* Memory of a window: of its pixels, row after row, the bin, the slope g of the kernel and terms of sums; of its bins
 * (the last for pixels outside the frame) the mass and eq. 10; of its columns and rows, the offset from the centre, px,
 * its square in bandwidths, and the pixel in the frame, or OUTSIDE. */
typedef struct {
    uint16_t *cells;
    double *slope, *terms, *mass, *ratio, *offset[2], *square[2];
    Py_ssize_t *place[2];
} Memory;

typedef struct {
    Picture picture;
    double h[2], ramp;
    Py_ssize_t reach[2], bins;
} Search;

static Py_ssize_t across(const Search *search, int axis)
{
    return 2 * search->reach[axis] + 1;
}

static void place_pixels(const Search *search, const double center[2], Memory memory)
{
    const Py_ssize_t edge[2] = {search->picture.columns, search->picture.rows};
    for (int axis = 0; axis < 2; axis++) {
        double middle = floor(center[axis] + 0.5);
        for (Py_ssize_t i = 0; i < across(search, axis); i++) {
            double pixel = middle + (double)(i - search->reach[axis]), off = pixel - center[axis];
            double bandwidths = off / search->h[axis];
            memory.offset[axis][i] = off;
            memory.square[axis][i] = bandwidths * bandwidths;
            memory.place[axis][i] = pixel >= 0 && pixel < (double)edge[axis] ? (Py_ssize_t)pixel : OUTSIDE;
        }
    }
}

/* Fills cells, slopes, and the mass in each bin as a share of the whole kernel's. */
static void count_pixels(const Search *search, const double center[2], Memory memory)
{
    place_pixels(search, center, memory);
    memset(memory.mass, 0, (size_t)(search->bins + 1) * sizeof *memory.mass);
    for (Py_ssize_t row = 0; row < across(search, 1); row++) {
        for (Py_ssize_t column = 0; column < across(search, 0); column++) {
            uint16_t bin = (uint16_t)search->bins;
            if (memory.place[1][row] != OUTSIDE && memory.place[0][column] != OUTSIDE) {
                uint16_t seen = bin_at(&search->picture, memory.place[1][row], memory.place[0][column]);
                bin = seen < bin ? seen : bin;
            }
            double r2 = memory.square[0][column] + memory.square[1][row];
            double profile = 1 - r2, slope = (1 - sqrt(r2)) * search->ramp + 0.5;
            memory.mass[bin] += profile < 0 ? 0 : profile;
            *memory.slope++ = slope < 0 ? 0 : slope > 1 ? 1 : slope;
            *memory.cells++ = bin;
        }
    }
    double whole = pairwise_sum(memory.mass, search->bins + 1);
    for (Py_ssize_t u = 0; u < search->bins; u++)
        memory.mass[u] /= whole;
}

/* The step that eq. 13 makes from a centre. */
static void step_from(const Search *search, const double center[2], const double *reference, Memory memory, double step[2])
{
    count_pixels(search, center, memory);
    for (Py_ssize_t u = 0; u < search->bins; u++)
        memory.ratio[u] = memory.mass[u] > 0 ? sqrt(reference[u] / memory.mass[u]) : 0;
    memory.ratio[search->bins] = 0;
    Py_ssize_t wide = across(search, 0), pixels = wide * across(search, 1);
    for (Py_ssize_t i = 0; i < pixels; i++)
        memory.terms[i] = memory.slope[i] = memory.ratio[memory.cells[i]] * memory.slope[i];
    double total = pairwise_sum(memory.terms, pixels);
    if (total == 0)
        total = INFINITY;
    for (int axis = 0; axis < 2; axis++) {
        for (Py_ssize_t row = 0; row < across(search, 1); row++)
            for (Py_ssize_t column = 0; column < wide; column++) {
                Py_ssize_t i = row * wide + column;
                memory.terms[i] = memory.slope[i] * memory.offset[axis][axis == 0 ? column : row];
            }
        step[axis] = pairwise_sum(memory.terms, pixels) / total;
    }
}

static void make_room(Call *call, const Search *search, Memory *memory)
{
    Py_ssize_t columns = across(search, 0), rows = across(search, 1), bins = search->bins + 1;
    Py_ssize_t pixels = columns * rows, sides = columns + rows;
    memory->cells = room(call, pixels, sizeof *memory->cells);
    memory->place[0] = room(call, sides, sizeof *memory->place[0]);
    memory->slope = room(call, 2 * (pixels + bins + sides), sizeof *memory->slope);
    if (call->failed)
        return;
    memory->terms = memory->slope + pixels;
    memory->mass = memory->terms + pixels;
    memory->ratio = memory->mass + bins;
    memory->offset[0] = memory->ratio + bins;
    memory->offset[1] = memory->offset[0] + columns;
    memory->square[0] = memory->offset[1] + rows;
    memory->square[1] = memory->square[0] + columns;
    memory->place[1] = memory->place[0] + columns;
}

KERNEL(mean_shift, 10)
{
    Py_ssize_t numbers, space, windows;
    Search search = {.picture = binned_image(call, 0), .h = {number(call, 2), number(call, 3)}};
    const double *reference = input(call, 4, "d", &search.bins);
    Py_ssize_t iterations = whole(call, 5);
    double eps = number(call, 6), *centers = output(call, 7, "d", &numbers), *mass = output(call, 8, "d", &space);
    double *visible = output(call, 9, "d", &windows);
    if (call->failed)
        return NULL;
    if (numbers != 2 * windows || space != windows * search.bins || search.bins < 1 || search.bins >= UINT16_MAX)
        return wrong(call, "mean_shift: lengths do not agree");
    for (int axis = 0; axis < 2; axis++) {
        if (!(search.h[axis] > 0 && search.h[axis] < LARGEST_BANDWIDTH))
            return wrong(call, "mean_shift: a bandwidth out of range");
        /* The ramp of g ends half a pixel beyond h, and a centre lies up to half a pixel from the middle pixel. */
        search.reach[axis] = (Py_ssize_t)(search.h[axis] + 1);
    }
    search.ramp = sqrt(search.h[0] * search.h[1]);
    Memory memory;
    make_room(call, &search, &memory);
    if (call->failed)
        return NULL;
    for (Py_ssize_t i = 0; i < windows; i++) {
        double *center = centers + 2 * i, step[2] = {INFINITY, INFINITY};
        for (Py_ssize_t k = 0; k < iterations && hypot(step[0], step[1]) >= eps; k++) {
            step_from(&search, center, reference, memory, step);
            center[0] += step[0];
            center[1] += step[1];
        }
        count_pixels(&search, center, memory);
        memcpy(mass + i * search.bins, memory.mass, (size_t)search.bins * sizeof *mass);
        visible[i] = pairwise_sum(memory.mass, search.bins);
    }
    return done(call);
}
