/* A layer that changes: two states of it mixed and moved by parts of a pixel, alone or laid over a picture. States are
 * words, as half as much need be read. */
#include "fused.h"
#include "plane.h"
#include "sixteens.h"
#include "states.h"
#include "veil.h"

INLINED void see(const Field *field, float down, const Plane *out, int fused)
{
    const Field own = *field;
    begin(field, out->columns);
    for (Py_ssize_t row = 0; row < out->rows; row++) {
        const int16_t *early = own.early.data + (row + 1) * own.early.stride;
        const int16_t *late = own.late.data + (row + 1) * own.late.stride;
        float *restrict values = out->data + row * out->stride, *restrict above = own.above;
        for (Py_ssize_t i = 0; i < out->columns; i++)
            values[i] = between(&own, above + i, beside(&own.shares, early, late, i), down, fused);
    }
}

/* `under` may be the light itself; air may be NULL. Behind air that passes tau and shines by p a field of transmittance
 * t and emission e leaves of u: u t + tau e + p (1 - t) = (u - p) t + tau e + p. */
INLINED void lay(const Field *passed, const Field *emitted, float down, const Plane *under, const Plane *light,
                 const Air *air, int fused, int by_sixteens)
{
    const Field through = *passed, own = *emitted;
    begin(passed, light->columns);
    begin(emitted, light->columns);
    for (Py_ssize_t row = 0; row < light->rows; row++) {
        const Row at = row_of(&through, &own, under, light, air, row);
        const Py_ssize_t done = by_sixteens ? lay_sixteens(&through, &own, down, &at, light->columns) : 0;
        float *restrict through_above = through.above, *restrict own_above = own.above;
        EACH_ALONE
        for (Py_ssize_t i = done; i < light->columns; i++) {
            const float below = beside(&through.shares, at.early, at.late, i);
            const float own_below = beside(&own.shares, at.own_early, at.own_late, i);
            const float left = between(&through, through_above + i, below, down, fused);
            const float added = between(&own, own_above + i, own_below, down, fused);
            at.values[i] =
                air == NULL ? plus(added, at.seen[i], left, fused)
                            : plus(plus(at.lit[i], added, at.tau[i], fused), at.seen[i] - at.lit[i], left, fused);
        }
    }
}

FUSING static void see_fused(const Field *field, float down, const Plane *out)
{
    see(field, down, out, 1);
}

static void see_twice(const Field *field, float down, const Plane *out)
{
    see(field, down, out, 0);
}

/* Both ways are compiled apart: without air nothing of it is read. */
INLINED void lay_in(const Field *passed, const Field *emitted, float down, const Plane *under, const Plane *light,
                    const Air *air, int fused, int by_sixteens)
{
    if (air == NULL)
        lay(passed, emitted, down, under, light, NULL, fused, by_sixteens);
    else
        lay(passed, emitted, down, under, light, air, fused, by_sixteens);
}

FUSING static void lay_fused(const Field *passed, const Field *emitted, float down, const Plane *under,
                             const Plane *light, const Air *air)
{
    lay_in(passed, emitted, down, under, light, air, 1, 1);
}

static void lay_twice(const Field *passed, const Field *emitted, float down, const Plane *under,
                      const Plane *light, const Air *air)
{
    lay_in(passed, emitted, down, under, light, air, 0, 0);
}

static int larger(const Words *state, const Plane *picture)
{
    return state->rows == picture->rows + 1 && state->columns == picture->columns + 1;
}

/* A share of WHOLE among the arguments, as it counts: 0, or -1 with an exception. */
static int share_of(PyObject *given, int16_t *out)
{
    const long share = PyLong_AsLong(given);
    if (PyErr_Occurred())
        return -1;
    if (share < 0 || share > WHOLE) {
        PyErr_Format(PyExc_ValueError, "shares of 0 to %d are wanted", WHOLE);
        return -1;
    }
    *out = (int16_t)-share;
    return 0;
}

#define SHARES 4

/* Reads what counts of a word and of the one right of it, of the early state and of the late one. */
static int shares_of(PyObject *const *given, Shares *out)
{
    int16_t *const each[SHARES] = {&out->of_early, &out->right_of_early, &out->of_late, &out->right_of_late};
    int sum = 0;
    for (int i = 0; i < SHARES; i++) {
        if (share_of(given[i], each[i]) < 0)
            return -1;
        sum -= *each[i];
    }
    if (sum == WHOLE)
        return 0;
    PyErr_Format(PyExc_ValueError, "shares that sum to %d are wanted", WHOLE);
    return -1;
}

/* Reads (four shares, down, unit of each field, picture, early and late of each field); the room for their rows, for
 * the caller to free, or NULL with an exception. */
static float *looked_at(Arrays *arrays, PyObject *const *given, float *down, Plane *picture, Field *fields, int count)
{
    Shares shares;
    double numbers[3];
    if (shares_of(given, &shares) < 0)
        return NULL;
    for (int i = 0; i < 1 + count; i++) {
        numbers[i] = PyFloat_AsDouble(given[SHARES + i]);
        if (PyErr_Occurred())
            return NULL;
    }
    *down = (float)numbers[0];
    PyObject *const *states = given + SHARES + 1 + count;
    if (plane(arrays, *states++, 1, picture) < 0)
        return NULL;
    for (int i = 0; i < count; i++) {
        Field *field = &fields[i];
        if (words(arrays, *states++, &field->early) < 0 || words(arrays, *states++, &field->late) < 0)
            return NULL;
        if (!larger(&field->early, picture) || !larger(&field->late, picture)) {
            PyErr_SetString(PyExc_ValueError, "states a row and a column larger than the picture are wanted");
            return NULL;
        }
        const float unit = (float)numbers[1 + i];
        field->shares = shares;
        field->unit = unit / -WHOLE;
        field->zero = unit * -LEAST;
    }
    float *room = PyMem_Calloc((size_t)count, ((size_t)picture->columns + 1) * sizeof *room);
    if (room == NULL) {
        PyErr_NoMemory();
        return NULL;
    }
    for (int i = 0; i < count; i++)
        fields[i].above = room + i * picture->columns;
    return room;
}

/* moved(four shares, down, unit, out, early, late) */
PyObject *moved(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    float down;
    Plane out;
    Field field;
    if (count != 9)
        return PyErr_Format(PyExc_TypeError, "moved takes 9 arguments, not %zd", count);
    float *room = looked_at(&arrays, given, &down, &out, &field, 1);
    if (room != NULL)
        (fuses() ? see_fused : see_twice)(&field, down, &out);
    PyMem_Free(room);
    release(&arrays);
    if (room == NULL)
        return NULL;
    Py_RETURN_NONE;
}

static int as_large(const Plane *one, const Plane *other)
{
    return one->rows == other->rows && one->columns == other->columns;
}

/* veil(under, four shares, down, unit passed, unit emitted, light, early passed, late passed, early emitted, late
 * emitted[, what the air passes, its light]) */
PyObject *veil(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    float down;
    Plane light, under;
    Air before;
    Field fields[2];
    if (count != 13 && count != 15)
        return PyErr_Format(PyExc_TypeError, "veil takes 13 or 15 arguments, not %zd", count);
    const Air *air = count == 15 ? &before : NULL;
    float *room = looked_at(&arrays, given + 1, &down, &light, fields, 2);
    int done = room != NULL && plane(&arrays, given[0], 0, &under) == 0;
    if (done && air != NULL)
        done = plane(&arrays, given[13], 0, &before.passed) == 0 && plane(&arrays, given[14], 0, &before.lit) == 0;
    if (done && (!as_large(&under, &light) ||
                 (air != NULL && !(as_large(&before.passed, &light) && as_large(&before.lit, &light))))) {
        PyErr_SetString(PyExc_ValueError, "what is under a veil, and the air before it, is to be as large as the picture");
        done = 0;
    }
    if (done)
        (fuses() ? lay_fused : lay_twice)(&fields[0], &fields[1], down, &under, &light, air);
    PyMem_Free(room);
    release(&arrays);
    if (!done)
        return NULL;
    Py_RETURN_NONE;
}
