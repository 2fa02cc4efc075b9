/* Noise of a frame's pixels: normals that are used where they are drawn. Rounded as the passes of OpenCV that they
 * stand for. */
#include "drawing.h"
#include "fused.h"
#include "grain.h"
#include "words.h"

/* What NAME(with, place, drawn, fused) does of a pixel with its normal, of a block of pixels. */
#define BLOCK_OF(name, type)                                                                                           \
    INLINED void name##_block(const int16_t *drawn, Py_ssize_t from, Py_ssize_t count, const type *with, int fused)    \
    {                                                                                                                  \
        const type own = *with;                                                                                        \
        EACH_ALONE                                                                                                     \
        for (Py_ssize_t i = 0; i < count; i++)                                                                         \
            name(&own, from + i, drawn[i] * NORMAL_UNIT, fused);                                                              \
    }

/* The same as a Use, and of one pixel as a Mend, each as the two that `plus` asks for; CHOSEN is the one for this
 * processor. */
#define USE(name)                                                                                                      \
    FUSING static void name##_fused(const int16_t *drawn, Py_ssize_t from, Py_ssize_t count, void *with)               \
    {                                                                                                                  \
        name##_block(drawn, from, count, with, 1);                                                                     \
    }                                                                                                                  \
    static void name##_twice(const int16_t *drawn, Py_ssize_t from, Py_ssize_t count, void *with)                      \
    {                                                                                                                  \
        name##_block(drawn, from, count, with, 0);                                                                     \
    }
#define MEND(name)                                                                                                     \
    FUSING static void name##_one_fused(float drawn, Py_ssize_t place, void *with)                                     \
    {                                                                                                                  \
        name(with, place, drawn, 1);                                                                                   \
    }                                                                                                                  \
    static void name##_one_twice(float drawn, Py_ssize_t place, void *with)                                            \
    {                                                                                                                  \
        name(with, place, drawn, 0);                                                                                   \
    }
#define CHOSEN(name) (fuses() ? name##_fused : name##_twice)

typedef struct {
    float *signal;
    float scale;
} Scaled;

INLINED void scaled(const Scaled *with, Py_ssize_t place, float drawn, int fused)
{
    with->signal[place] = plus(with->signal[place], drawn, with->scale, fused);
}
BLOCK_OF(scaled, Scaled)
USE(scaled)
MEND(scaled)

/* A pixel, and what it held. Both as numbers that Python reads without more ado. */
typedef struct {
    double place, held;
} Dark;

typedef struct {
    float *signal;
    float variance, well, few;
    Dark *dark; /* pixels that held few, from the first on */
    Py_ssize_t count, room;
    int failed;
} Shot;

static RARE void note_dark(Shot *to, Py_ssize_t place)
{
    if (to->count == to->room && !to->failed) {
        const Py_ssize_t room = 2 * to->room + 64;
        Dark *dark = PyMem_Realloc(to->dark, (size_t)room * sizeof *dark);
        if (dark == NULL) {
            to->failed = 1;
            return;
        }
        to->dark = dark;
        to->room = room;
    }
    if (!to->failed)
        to->dark[to->count++] = (Dark){(double)place, to->signal[place]};
}

INLINED void shot(const Shot *with, Py_ssize_t place, float drawn, int fused)
{
    const float held = with->signal[place], shaken = held >= with->well || held < with->few ? 0.0f : held;
    with->signal[place] = plus(held, sqrtf(shaken + with->variance), drawn, fused);
}
BLOCK_OF(shot, Shot)
MEND(shot)

/* What pixels that hold few do hold is noted before they are shaken. */
INLINED void noted_shot_block(const int16_t *drawn, Py_ssize_t from, Py_ssize_t count, Shot *with, int fused)
{
    int dark = 0;
    for (Py_ssize_t i = 0; i < count; i++)
        dark |= with->signal[from + i] < with->few;
    if (dark)
        for (Py_ssize_t place = from; place < from + count; place++)
            if (with->signal[place] < with->few)
                note_dark(with, place);
    shot_block(drawn, from, count, with, fused);
}
USE(noted_shot)

/* Roots are what takes time here. */
FUSING_WIDELY static void noted_shot_widely(const int16_t *drawn, Py_ssize_t from, Py_ssize_t count, void *with)
{
    noted_shot_block(drawn, from, count, with, 1);
}

/* States are words of one unit, in which the spread is, too. */
typedef struct {
    const int16_t *before, *after;
    int16_t *out;
    float weight, spread;
} Bridge;

INLINED void bridged(const Bridge *with, Py_ssize_t place, float drawn, int fused)
{
    const float both = (float)(with->before[place] + with->after[place]);
    float state = rintf(plus(both * with->weight, drawn, with->spread, fused));
    state = state > INT16_MIN ? state : INT16_MIN;
    state = state < INT16_MAX ? state : INT16_MAX;
    with->out[place] = (int16_t)(int32_t)state;
}
MEND(bridged)

#ifdef SIXTEENS
FUSING INLINED __m256 eight_bridged(const Bridge *with, const int16_t *drawn, Py_ssize_t place)
{
    const __m256i both = _mm256_add_epi32(eight_whole(with->before + place), eight_whole(with->after + place));
    const __m256 mean = _mm256_mul_ps(_mm256_cvtepi32_ps(both), _mm256_set1_ps(with->weight));
    return _mm256_fmadd_ps(_mm256_mul_ps(eight(drawn), _mm256_set1_ps(NORMAL_UNIT)), _mm256_set1_ps(with->spread), mean);
}

FUSING static Py_ssize_t bridged_sixteens(const int16_t *drawn, Py_ssize_t from, Py_ssize_t count, const Bridge *with)
{
    const Bridge own = *with;
    Py_ssize_t i = 0;
    for (; i + 16 <= count; i += 16)
        store_words(own.out + from + i, eight_bridged(&own, drawn + i, from + i),
                    eight_bridged(&own, drawn + i + 8, from + i + 8));
    return i;
}
#else
#define bridged_sixteens(drawn, from, count, with) 0
#endif

INLINED void bridged_block(const int16_t *drawn, Py_ssize_t from, Py_ssize_t count, const Bridge *with, int fused)
{
    for (Py_ssize_t i = fused ? bridged_sixteens(drawn, from, count, with) : 0; i < count; i++)
        bridged(with, from + i, drawn[i] * NORMAL_UNIT, fused);
}
USE(bridged)

/* The numbers among the arguments from `first` on: 0, or -1 with an exception. */
static int numbers(PyObject *const *given, int first, int count, float *out)
{
    for (int i = 0; i < count; i++) {
        out[i] = (float)PyFloat_AsDouble(given[first + i]);
        if (PyErr_Occurred())
            return -1;
    }
    return 0;
}

static int so_many(const char *name, Py_ssize_t given, Py_ssize_t wanted)
{
    if (given == wanted)
        return 1;
    PyErr_Format(PyExc_TypeError, "%s takes %zd arguments, not %zd", name, wanted, given);
    return 0;
}

/* add_normals(seed, table, pieces, deep, refined, signal, scale) */
PyObject *add_normals(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    Drawing drawn;
    Scaled to;
    Py_ssize_t length;
    PyObject *done = NULL;
    if (so_many("add_normals", count, 7) && drawing(&arrays, given, &drawn) == 0 &&
        (to.signal = array(&arrays, given[5], "f", 1, &length)) != NULL && numbers(given, 6, 1, &to.scale) == 0)
        done = draw(&drawn, length, CHOSEN(scaled), CHOSEN(scaled_one), &to);
    release(&arrays);
    return done;
}

/* add_shot(seed, table, pieces, deep, refined, signal, variance, well, few) */
PyObject *add_shot(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    Drawing drawn;
    Shot to = {.dark = NULL};
    Py_ssize_t length;
    float limits[3];
    PyObject *done = NULL;
    if (so_many("add_shot", count, 9) && drawing(&arrays, given, &drawn) == 0 &&
        (to.signal = array(&arrays, given[5], "f", 1, &length)) != NULL && numbers(given, 6, 3, limits) == 0) {
        to.variance = limits[0];
        to.well = limits[1];
        to.few = limits[2];
        done = draw(&drawn, length, fuses_widely() ? noted_shot_widely : CHOSEN(noted_shot), CHOSEN(shot_one), &to);
        if (done != NULL) {
            Py_DECREF(done);
            done = to.failed ? PyErr_NoMemory()
                             : PyBytes_FromStringAndSize((const char *)to.dark, to.count * (Py_ssize_t)sizeof *to.dark);
        }
    }
    PyMem_Free(to.dark);
    release(&arrays);
    return done;
}

/* bridge(seed, table, pieces, deep, refined, before, after, weight, spread, out) */
PyObject *bridge(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    Drawing drawn;
    Bridge to;
    Py_ssize_t length, before, after;
    float scales[2];
    PyObject *done = NULL;
    if (so_many("bridge", count, 10) && drawing(&arrays, given, &drawn) == 0 &&
        (to.before = array(&arrays, given[5], "h", 0, &before)) != NULL &&
        (to.after = array(&arrays, given[6], "h", 0, &after)) != NULL &&
        (to.out = array(&arrays, given[9], "h", 1, &length)) != NULL && numbers(given, 7, 2, scales) == 0) {
        to.weight = scales[0];
        to.spread = scales[1];
        if (before == length && after == length)
            done = draw(&drawn, length, CHOSEN(bridged), CHOSEN(bridged_one), &to);
        else
            PyErr_SetString(PyExc_ValueError, "states of one length are wanted");
    }
    release(&arrays);
    return done;
}
