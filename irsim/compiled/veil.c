/* A layer that changes: two states of it mixed and moved by parts of a pixel, alone or laid over a picture. States are
 * words, as half as much need be read. */
#include "fused.h"
#include "plane.h"
#include "veil.h"

#if defined(__x86_64__) && defined(__GNUC__)
#define EIGHTS
#include <immintrin.h>
#endif

/* Two states, a row and a column larger than the picture. */
typedef struct {
    Words early, late;
    float of_early, right_of_early, of_late, right_of_late; /* what counts of a word and of the one right of it */
    float *above;                                           /* room for a row between its pixels */
} Field;

/* The value at a place between two columns, of both states. */
INLINED float beside(const Field *field, const uint16_t *early, const uint16_t *late, Py_ssize_t i, int fused)
{
    float sum = plus(early[i] * field->of_early, early[i + 1], field->right_of_early, fused);
    return plus(plus(sum, late[i], field->of_late, fused), late[i + 1], field->right_of_late, fused);
}

INLINED void begin(const Field *field, Py_ssize_t columns, int fused)
{
    const Field own = *field;
    float *restrict above = own.above;
    for (Py_ssize_t i = 0; i < columns; i++)
        above[i] = beside(&own, own.early.data, own.late.data, i, fused);
}

INLINED void see(const Field *field, float down, const Plane *out, int fused)
{
    const Field own = *field;
    float *restrict above = own.above;
    begin(field, out->columns, fused);
    for (Py_ssize_t row = 0; row < out->rows; row++) {
        const uint16_t *early = own.early.data + (row + 1) * own.early.stride;
        const uint16_t *late = own.late.data + (row + 1) * own.late.stride;
        float *restrict values = out->data + row * out->stride;
        for (Py_ssize_t i = 0; i < out->columns; i++) {
            const float below = beside(&own, early, late, i, fused);
            values[i] = plus(above[i], below - above[i], down, fused);
            above[i] = below;
        }
    }
}

/* What the air before it lets through, and its own light: each as large as the picture. */
typedef struct {
    Plane passed, lit;
} Air;

/* What a row of the picture is made from: the words of both states of both fields, what is seen, and the air. */
typedef struct {
    const uint16_t *early, *late, *own_early, *own_late;
    const float *seen, *tau, *lit;
    float *values;
} Row;

INLINED Row row_of(const Field *passed, const Field *emitted, const Plane *under, const Plane *light, const Air *air,
                   Py_ssize_t row)
{
    return (Row){.early = passed->early.data + (row + 1) * passed->early.stride,
                 .late = passed->late.data + (row + 1) * passed->late.stride,
                 .own_early = emitted->early.data + (row + 1) * emitted->early.stride,
                 .own_late = emitted->late.data + (row + 1) * emitted->late.stride,
                 .seen = under->data + row * under->stride,
                 .tau = air == NULL ? NULL : air->passed.data + row * air->passed.stride,
                 .lit = air == NULL ? NULL : air->lit.data + row * air->lit.stride,
                 .values = light->data + row * light->stride};
}

#ifdef EIGHTS
/* The compiler converts words by sixteens, whose halves it takes apart: 0.66 ns a pixel, 0.45 by eights (Zen 3). What
 * counts of a word and of the one right of it, eight times each. */
typedef struct {
    __m256 of_early, right_of_early, of_late, right_of_late;
} Shares;

FUSING INLINED Shares shares_of(const Field *field)
{
    return (Shares){_mm256_set1_ps(field->of_early), _mm256_set1_ps(field->right_of_early),
                    _mm256_set1_ps(field->of_late), _mm256_set1_ps(field->right_of_late)};
}

FUSING INLINED __m256 eight(const uint16_t *words)
{
    return _mm256_cvtepi32_ps(_mm256_cvtepu16_epi32(_mm_loadu_si128((const __m128i *)words)));
}

/* See `beside`. */
FUSING INLINED __m256 eight_beside(const Shares *shares, const uint16_t *early, const uint16_t *late)
{
    __m256 sum = _mm256_mul_ps(eight(early), shares->of_early);
    sum = _mm256_fmadd_ps(eight(early + 1), shares->right_of_early, sum);
    sum = _mm256_fmadd_ps(eight(late), shares->of_late, sum);
    return _mm256_fmadd_ps(eight(late + 1), shares->right_of_late, sum);
}

/* The pixels whose lower edges are `below`, which are kept as the next row's upper ones. */
FUSING INLINED __m256 eight_between(float *kept, __m256 below, __m256 down)
{
    const __m256 above = _mm256_loadu_ps(kept);
    _mm256_storeu_ps(kept, below);
    return _mm256_fmadd_ps(_mm256_sub_ps(below, above), down, above);
}

/* As many pixels of a row as there are by eights, as `lay` has them; how many they are. */
FUSING static Py_ssize_t lay_eights(const Field *passed, const Field *emitted, float down, const Row *at,
                                    Py_ssize_t columns)
{
    const Shares through = shares_of(passed), own = shares_of(emitted);
    const __m256 share = _mm256_set1_ps(down);
    const Row row = *at;
    float *through_above = passed->above, *own_above = emitted->above;
    const int airy = row.tau != NULL;
    Py_ssize_t i = 0;
    for (; i + 8 <= columns; i += 8) {
        const __m256 below = eight_beside(&through, row.early + i, row.late + i);
        const __m256 own_below = eight_beside(&own, row.own_early + i, row.own_late + i);
        const __m256 left = eight_between(through_above + i, below, share);
        __m256 added = eight_between(own_above + i, own_below, share), seen = _mm256_loadu_ps(row.seen + i);
        if (airy) {
            const __m256 lit = _mm256_loadu_ps(row.lit + i);
            added = _mm256_fmadd_ps(added, _mm256_loadu_ps(row.tau + i), lit);
            seen = _mm256_sub_ps(seen, lit);
        }
        _mm256_storeu_ps(row.values + i, _mm256_fmadd_ps(seen, left, added));
    }
    return i;
}
#else
#define lay_eights(passed, emitted, down, at, columns) 0
#endif

/* `under` may be the light itself; air may be NULL. Behind air that passes tau and shines by p a field of transmittance
 * t and emission e leaves of u: u t + tau e + p (1 - t) = (u - p) t + tau e + p. */
INLINED void lay(const Field *passed, const Field *emitted, float down, const Plane *under, const Plane *light,
                 const Air *air, int fused, int by_eights)
{
    const Field through = *passed, own = *emitted;
    begin(passed, light->columns, fused);
    begin(emitted, light->columns, fused);
    for (Py_ssize_t row = 0; row < light->rows; row++) {
        const Row at = row_of(&through, &own, under, light, air, row);
        const Py_ssize_t done = by_eights ? lay_eights(&through, &own, down, &at, light->columns) : 0;
        float *restrict through_above = through.above, *restrict own_above = own.above;
        EACH_ALONE
        for (Py_ssize_t i = done; i < light->columns; i++) {
            const float below = beside(&through, at.early, at.late, i, fused);
            const float own_below = beside(&own, at.own_early, at.own_late, i, fused);
            const float left = plus(through_above[i], below - through_above[i], down, fused);
            const float added = plus(own_above[i], own_below - own_above[i], down, fused);
            at.values[i] =
                air == NULL ? plus(added, at.seen[i], left, fused)
                            : plus(plus(at.lit[i], added, at.tau[i], fused), at.seen[i] - at.lit[i], left, fused);
            through_above[i] = below;
            own_above[i] = own_below;
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
                    const Air *air, int fused, int by_eights)
{
    if (air == NULL)
        lay(passed, emitted, down, under, light, NULL, fused, by_eights);
    else
        lay(passed, emitted, down, under, light, air, fused, by_eights);
}

FUSING_WIDELY static void lay_widely(const Field *passed, const Field *emitted, float down, const Plane *under,
                                     const Plane *light, const Air *air)
{
    lay_in(passed, emitted, down, under, light, air, 1, 0);
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

/* Reads (share, right, down, unit of each field, picture, early and late of each field); the room for their rows, for
 * the caller to free, or NULL with an exception. */
static float *looked_at(Arrays *arrays, PyObject *const *given, float *down, Plane *picture, Field *fields, int count)
{
    double numbers[5];
    for (int i = 0; i < 3 + count; i++) {
        numbers[i] = PyFloat_AsDouble(given[i]);
        if (PyErr_Occurred())
            return NULL;
    }
    const double share = numbers[0], right = numbers[1];
    *down = (float)numbers[2];
    PyObject *const *states = given + 3 + count;
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
        const double late = numbers[3 + i] * share, early = numbers[3 + i] * (1 - share);
        field->of_early = (float)(early * (1 - right));
        field->right_of_early = (float)(early * right);
        field->of_late = (float)(late * (1 - right));
        field->right_of_late = (float)(late * right);
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

/* moved(share, right, down, unit, out, early, late) */
PyObject *moved(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    float down;
    Plane out;
    Field field;
    if (count != 7)
        return PyErr_Format(PyExc_TypeError, "moved takes 7 arguments, not %zd", count);
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

/* veil(under, share, right, down, unit passed, unit emitted, light, early passed, late passed, early emitted, late
 * emitted[, what the air passes, its light]) */
PyObject *veil(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    float down;
    Plane light, under;
    Air before;
    Field fields[2];
    if (count != 11 && count != 13)
        return PyErr_Format(PyExc_TypeError, "veil takes 11 or 13 arguments, not %zd", count);
    const Air *air = count == 13 ? &before : NULL;
    float *room = looked_at(&arrays, given + 1, &down, &light, fields, 2);
    int done = room != NULL && plane(&arrays, given[0], 0, &under) == 0;
    if (done && air != NULL)
        done = plane(&arrays, given[11], 0, &before.passed) == 0 && plane(&arrays, given[12], 0, &before.lit) == 0;
    if (done && (!as_large(&under, &light) ||
                 (air != NULL && !(as_large(&before.passed, &light) && as_large(&before.lit, &light))))) {
        PyErr_SetString(PyExc_ValueError, "what is under a veil, and the air before it, is to be as large as the picture");
        done = 0;
    }
    if (done)
        (fuses_widely() ? lay_widely
         : fuses()      ? lay_fused
                        : lay_twice)(&fields[0], &fields[1], down, &under, &light, air);
    PyMem_Free(room);
    release(&arrays);
    if (!done)
        return NULL;
    Py_RETURN_NONE;
}
