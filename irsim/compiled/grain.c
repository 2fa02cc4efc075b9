/* Noise of a frame's pixels: normals that are used where they are drawn. Rounded as the passes of OpenCV that they
 * stand for. */
#include "drawing.h"
#include "fused.h"
#include "grain.h"

/* A loop as the two that `plus` asks for, NAME_fused and NAME_twice; CHOSEN is the one for this processor. */
#define BOTH(name)                                                                                                     \
    FUSING static void name##_fused(const float *drawn, Py_ssize_t from, Py_ssize_t count, void *with)                 \
    {                                                                                                                  \
        name(drawn, from, count, with, 1);                                                                             \
    }                                                                                                                  \
    static void name##_twice(const float *drawn, Py_ssize_t from, Py_ssize_t count, void *with)                        \
    {                                                                                                                  \
        name(drawn, from, count, with, 0);                                                                             \
    }
#define CHOSEN(name) (fuses() ? name##_fused : name##_twice)

typedef struct {
    float *signal;
    float scale;
} Scaled;

INLINED void scaled(const float *drawn, Py_ssize_t from, Py_ssize_t count, void *with, int fused)
{
    const Scaled *to = with;
    float *restrict signal = to->signal + from;
    const float scale = to->scale;
    for (Py_ssize_t i = 0; i < count; i++)
        signal[i] = plus(signal[i], drawn[i], scale, fused);
}
BOTH(scaled)

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

INLINED void shot(const float *drawn, Py_ssize_t from, Py_ssize_t count, void *with, int fused)
{
    const Shot *to = with;
    float *restrict signal = to->signal + from;
    const float variance = to->variance, well = to->well, few = to->few;
    for (Py_ssize_t i = 0; i < count; i++) {
        float held = signal[i], shaken = held >= well || held < few ? 0.0f : held;
        signal[i] = plus(held, sqrtf(shaken + variance), drawn[i], fused);
    }
}

/* The same of normals whose pixels were not seen before. */
INLINED void shot_first(const float *drawn, Py_ssize_t from, Py_ssize_t count, void *with, int fused)
{
    Shot *to = with;
    int dark = 0;
    for (Py_ssize_t i = 0; i < count; i++)
        dark |= to->signal[from + i] < to->few;
    if (dark)
        for (Py_ssize_t place = from; place < from + count; place++)
            if (to->signal[place] < to->few)
                note_dark(to, place);
    shot(drawn, from, count, with, fused);
}
BOTH(shot_first)
BOTH(shot)

/* Roots are what takes time here. */
FUSING_WIDELY static void shot_first_widely(const float *drawn, Py_ssize_t from, Py_ssize_t count, void *with)
{
    shot_first(drawn, from, count, with, 1);
}

typedef struct {
    const float *before, *after;
    float *out;
    float weight, spread;
} Bridge;

INLINED void bridged(const float *drawn, Py_ssize_t from, Py_ssize_t count, void *with, int fused)
{
    const Bridge *to = with;
    const float *before = to->before + from, *after = to->after + from;
    float *restrict out = to->out + from;
    const float weight = to->weight, spread = to->spread;
    for (Py_ssize_t i = 0; i < count; i++)
        out[i] = plus(plus(after[i] * weight, before[i], weight, fused), drawn[i], spread, fused);
}
BOTH(bridged)

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
        done = draw(&drawn, length, CHOSEN(scaled), CHOSEN(scaled), &to);
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
        done = draw(&drawn, length, fuses_widely() ? shot_first_widely : CHOSEN(shot_first), CHOSEN(shot), &to);
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
        (to.before = array(&arrays, given[5], "f", 0, &before)) != NULL &&
        (to.after = array(&arrays, given[6], "f", 0, &after)) != NULL &&
        (to.out = array(&arrays, given[9], "f", 1, &length)) != NULL && numbers(given, 7, 2, scales) == 0) {
        to.weight = scales[0];
        to.spread = scales[1];
        if (before == length && after == length)
            done = draw_ahead(&drawn, length, CHOSEN(bridged), CHOSEN(bridged), &to,
                              (const float *const[STREAMS]){to.before, to.after, to.out});
        else
            PyErr_SetString(PyExc_ValueError, "states of one length are wanted");
    }
    release(&arrays);
    return done;
}
