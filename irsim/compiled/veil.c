/* A layer that changes: two states of it mixed and moved by parts of a pixel, alone or laid over a picture. Rounded as
 * by OpenCV's addWeighted and getRectSubPix. */
#include "fused.h"
#include "plane.h"
#include "veil.h"

/* Two states, a row and a column larger than the picture, and what each pixel takes of them. */
typedef struct {
    Plane early, late;
    float *upper, *lower; /* two rows of them, mixed */
} Field;

typedef struct {
    float early, late;                 /* shares of the states */
    float here, right, below, across; /* weights of a pixel, of the one right of it, and of those below them */
} Look;

INLINED void mix_row(const Field *field, const Look *look, Py_ssize_t row, float *restrict out, int fused)
{
    const float *early = field->early.data + row * field->early.stride;
    const float *late = field->late.data + row * field->late.stride;
    const float early_share = look->early, late_share = look->late;
    const Py_ssize_t columns = field->early.columns;
    for (Py_ssize_t i = 0; i < columns; i++)
        out[i] = plus(late[i] * late_share, early[i], early_share, fused);
}

/* The rows that a row of the picture lies between; to be called for all rows from 0 on. */
INLINED void next_rows(Field *field, const Look *look, Py_ssize_t row, int fused)
{
    float *above = field->upper;
    field->upper = field->lower;
    field->lower = above;
    if (row == 0)
        mix_row(field, look, 0, field->upper, fused);
    mix_row(field, look, row + 1, field->lower, fused);
}

INLINED float between(const Look *look, const float *upper, const float *lower, Py_ssize_t i, int fused)
{
    float sum = plus(upper[i] * look->here, upper[i + 1], look->right, fused);
    return plus(plus(sum, lower[i], look->below, fused), lower[i + 1], look->across, fused);
}

INLINED void see(Field *field, const Look *seen, const Plane *out, int fused)
{
    const Look look = *seen;
    for (Py_ssize_t row = 0; row < out->rows; row++) {
        next_rows(field, &look, row, fused);
        const float *upper = field->upper, *lower = field->lower;
        float *restrict values = out->data + row * out->stride;
        for (Py_ssize_t i = 0; i < out->columns; i++)
            values[i] = between(&look, upper, lower, i, fused);
    }
}

INLINED void lay(Field *passed, Field *emitted, const Look *seen, const Plane *light, int fused)
{
    const Look look = *seen;
    for (Py_ssize_t row = 0; row < light->rows; row++) {
        next_rows(passed, &look, row, fused);
        next_rows(emitted, &look, row, fused);
        const float *upper = passed->upper, *lower = passed->lower;
        const float *upper_emitted = emitted->upper, *lower_emitted = emitted->lower;
        float *restrict values = light->data + row * light->stride;
        for (Py_ssize_t i = 0; i < light->columns; i++)
            values[i] = values[i] * between(&look, upper, lower, i, fused) +
                        between(&look, upper_emitted, lower_emitted, i, fused);
    }
}

FUSING static void see_fused(Field *field, const Look *look, const Plane *out)
{
    see(field, look, out, 1);
}

static void see_twice(Field *field, const Look *look, const Plane *out)
{
    see(field, look, out, 0);
}

FUSING static void lay_fused(Field *passed, Field *emitted, const Look *look, const Plane *light)
{
    lay(passed, emitted, look, light, 1);
}

static void lay_twice(Field *passed, Field *emitted, const Look *look, const Plane *light)
{
    lay(passed, emitted, look, light, 0);
}

static int larger(const Plane *state, const Plane *picture)
{
    return state->rows == picture->rows + 1 && state->columns == picture->columns + 1;
}

/* Reads (share, right, down, picture, early, late, ...) with so many fields; the room for their rows, for the caller
 * to free, or NULL with an exception. */
static float *looked_at(Arrays *arrays, PyObject *const *given, Look *look, Plane *picture, Field *fields, int count)
{
    double numbers[3];
    for (int i = 0; i < 3; i++) {
        numbers[i] = PyFloat_AsDouble(given[i]);
        if (PyErr_Occurred())
            return NULL;
    }
    const float right = (float)numbers[1], down = (float)numbers[2];
    *look = (Look){(float)(1 - numbers[0]),
                   (float)numbers[0],
                   (1 - right) * (1 - down),
                   right * (1 - down),
                   (1 - right) * down,
                   right * down};
    if (plane(arrays, given[3], 1, picture) < 0)
        return NULL;
    for (int i = 0; i < count; i++) {
        if (plane(arrays, given[4 + 2 * i], 0, &fields[i].early) < 0 ||
            plane(arrays, given[5 + 2 * i], 0, &fields[i].late) < 0)
            return NULL;
        if (!larger(&fields[i].early, picture) || !larger(&fields[i].late, picture)) {
            PyErr_SetString(PyExc_ValueError, "states a row and a column larger than the picture are wanted");
            return NULL;
        }
    }
    const size_t length = (size_t)picture->columns + 1;
    float *room = PyMem_Malloc(2 * (size_t)count * length * sizeof *room);
    if (room == NULL) {
        PyErr_NoMemory();
        return NULL;
    }
    for (int i = 0; i < count; i++) {
        fields[i].upper = room + 2 * (size_t)i * length;
        fields[i].lower = fields[i].upper + length;
    }
    return room;
}

/* moved(share, right, down, out, early, late) */
PyObject *moved(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    Look look;
    Plane out;
    Field field;
    if (count != 6)
        return PyErr_Format(PyExc_TypeError, "moved takes 6 arguments, not %zd", count);
    float *room = looked_at(&arrays, given, &look, &out, &field, 1);
    if (room != NULL)
        (fuses() ? see_fused : see_twice)(&field, &look, &out);
    PyMem_Free(room);
    release(&arrays);
    if (room == NULL)
        return NULL;
    Py_RETURN_NONE;
}

/* veil(share, right, down, light, early passed, late passed, early emitted, late emitted) */
PyObject *veil(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    Look look;
    Plane light;
    Field fields[2];
    if (count != 8)
        return PyErr_Format(PyExc_TypeError, "veil takes 8 arguments, not %zd", count);
    float *room = looked_at(&arrays, given, &look, &light, fields, 2);
    if (room != NULL)
        (fuses() ? lay_fused : lay_twice)(&fields[0], &fields[1], &look, &light);
    PyMem_Free(room);
    release(&arrays);
    if (room == NULL)
        return NULL;
    Py_RETURN_NONE;
}
