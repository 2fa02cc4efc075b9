/* Cloud layers: two states mixed and shifted by parts of a pixel (see irsim/backgrounds/cloud_drift.py), sums of fields
 * (cloud_evolution.py), and their shading (clouds.py). States are 16-bit words: half as much memory is read. */
#include "kernels.h"

#define WHOLE 32768  /* what the shares of words sum to */
#define LEAST -32768 /* the word that stands for 0 */

/* What counts of a word and of the one right of it, in either state: below 0, so that a word holds all of one, too.
 * Sums of words so weighted fit 32 bits, and are exact. */
typedef struct {
    int16_t of_early, right_of_early, of_late, right_of_late;
} Shares;

/* Two states, a row and a column larger than the picture; the value of a sum of weighted words is it * unit + zero. */
typedef struct {
    Words early, late;
    Shares shares;
    float unit, zero;
    float *above; /* room for a row between its pixels: sums */
} Field;

/* The sum at a place between two columns, of both states. */
INLINED float beside(const Shares *of, const int16_t *early, const int16_t *late, Py_ssize_t i)
{
    return (float)(early[i] * of->of_early + early[i + 1] * of->right_of_early + late[i] * of->of_late +
                   late[i + 1] * of->right_of_late);
}

INLINED void begin_rows(const Field *field, Py_ssize_t columns)
{
    const Field own = *field;
    float *restrict above = own.above;
    for (Py_ssize_t i = 0; i < columns; i++)
        above[i] = beside(&own.shares, own.early.data, own.late.data, i);
}

/* The value of a pixel whose upper edge is kept, and its lower edge, which is kept as the next row's upper one. */
INLINED float between(const Field *field, float *kept, float below, float down, int fused)
{
    const float above = *kept;
    *kept = below;
    return plus(field->zero, plus(above, below - above, down, fused), field->unit, fused);
}

/* What the air before it lets through, and its own light: each as large as the picture. */
typedef struct {
    Plane passed, lit;
} Air;

/* What a row of the picture is made from: the words of both states of both fields, what is seen, and the air. */
typedef struct {
    const int16_t *early, *late, *own_early, *own_late;
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

#ifdef SIXTEENS
/* By sixteens of words, products of neighbours summed in one step: 0.32 ns a pixel alone, 0.45 where each word is
 * made a float, 0.66 as the compiler does that (Zen 3). What counts of a word and of the one right of it, eight times
 * each. */
typedef struct {
    __m256i early, late;
    __m256 unit, zero;
} Pairs;

typedef struct {
    __m256 first, second;
} Sixteen;

FUSING INLINED __m256i pair_of(int16_t share, int16_t right)
{
    return _mm256_set1_epi32((int32_t)((uint32_t)(uint16_t)right << 16 | (uint16_t)share));
}

FUSING INLINED Pairs pairs_of(const Field *field)
{
    const Shares of = field->shares;
    return (Pairs){pair_of(of.of_early, of.right_of_early), pair_of(of.of_late, of.right_of_late),
                   _mm256_set1_ps(field->unit), _mm256_set1_ps(field->zero)};
}

/* Every second sum, from the first on. */
FUSING INLINED __m256i every_second(const Pairs *of, const int16_t *early, const int16_t *late)
{
    return _mm256_add_epi32(_mm256_madd_epi16(_mm256_loadu_si256((const __m256i *)early), of->early),
                            _mm256_madd_epi16(_mm256_loadu_si256((const __m256i *)late), of->late));
}

/* See `beside`. */
FUSING INLINED Sixteen sixteen_beside(const Pairs *of, const int16_t *early, const int16_t *late)
{
    const __m256i even = every_second(of, early, late), odd = every_second(of, early + 1, late + 1);
    const __m256i low = _mm256_unpacklo_epi32(even, odd), high = _mm256_unpackhi_epi32(even, odd);
    return (Sixteen){_mm256_cvtepi32_ps(_mm256_permute2x128_si256(low, high, 0x20)),
                     _mm256_cvtepi32_ps(_mm256_permute2x128_si256(low, high, 0x31))};
}

/* See `between`. */
FUSING INLINED __m256 eight_between(const Pairs *of, float *kept, __m256 below, __m256 down)
{
    const __m256 above = _mm256_loadu_ps(kept);
    _mm256_storeu_ps(kept, below);
    return _mm256_fmadd_ps(_mm256_fmadd_ps(_mm256_sub_ps(below, above), down, above), of->unit, of->zero);
}

/* Eight pixels of a row from the i-th on, of what they pass and emit. */
FUSING INLINED void lay_eight(const Row *row, Py_ssize_t i, __m256 left, __m256 added, int airy)
{
    __m256 seen = _mm256_loadu_ps(row->seen + i);
    if (airy) {
        const __m256 lit = _mm256_loadu_ps(row->lit + i);
        added = _mm256_fmadd_ps(added, _mm256_loadu_ps(row->tau + i), lit);
        seen = _mm256_sub_ps(seen, lit);
    }
    _mm256_storeu_ps(row->values + i, _mm256_fmadd_ps(seen, left, added));
}

/* As many pixels of a row as there are by sixteens, as `lay` has them; how many they are. */
FUSING static Py_ssize_t lay_sixteens(const Field *passed, const Field *emitted, float down, const Row *at,
                                      Py_ssize_t columns)
{
    const Pairs through = pairs_of(passed), own = pairs_of(emitted);
    const __m256 share = _mm256_set1_ps(down);
    const Row row = *at;
    float *through_above = passed->above, *own_above = emitted->above;
    const int airy = row.tau != NULL;
    Py_ssize_t i = 0;
    for (; i + 16 <= columns; i += 16) {
        const Sixteen below = sixteen_beside(&through, row.early + i, row.late + i);
        const Sixteen own_below = sixteen_beside(&own, row.own_early + i, row.own_late + i);
        lay_eight(&row, i, eight_between(&through, through_above + i, below.first, share),
                  eight_between(&own, own_above + i, own_below.first, share), airy);
        lay_eight(&row, i + 8, eight_between(&through, through_above + i + 8, below.second, share),
                  eight_between(&own, own_above + i + 8, own_below.second, share), airy);
    }
    return i;
}
#else
#define lay_sixteens(passed, emitted, down, at, columns) 0
#endif

INLINED void see(const Field *field, float down, const Plane *out, int fused)
{
    const Field own = *field;
    begin_rows(field, out->columns);
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
INLINED void lay_rows(const Field *passed, const Field *emitted, float down, const Plane *under, const Plane *light,
                 const Air *air, int fused, int by_sixteens)
{
    const Field through = *passed, own = *emitted;
    begin_rows(passed, light->columns);
    begin_rows(emitted, light->columns);
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
        lay_rows(passed, emitted, down, under, light, NULL, fused, by_sixteens);
    else
        lay_rows(passed, emitted, down, under, light, air, fused, by_sixteens);
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

#define FIELDS 4
#define MIX_BLOCK 256 /* pixels at a time: what is summed of them stays in the nearest cache */

/* Four times two fields side by side, of side x side each. */
typedef struct {
    const float *fields[FIELDS];
    float shares[FIELDS], scales[2];
    Py_ssize_t side;
} Mixture;

/* A stretch of a row within the fields, whose first pixel is their number `place`. They are summed side by side, and
 * only then taken apart. */
INLINED void mix_stretch(const Mixture *of, Py_ssize_t place, Py_ssize_t count, float *restrict ones,
                         float *restrict others, int fused)
{
    const Mixture own = *of;
    float both[2 * MIX_BLOCK];
    for (Py_ssize_t from = 0; from < count; from += MIX_BLOCK) {
        const Py_ssize_t length = count - from < MIX_BLOCK ? count - from : MIX_BLOCK, first = 2 * (place + from);
        for (Py_ssize_t i = 0; i < 2 * length; i++) {
            float sum = own.fields[0][first + i] * own.shares[0];
            for (int j = 1; j < FIELDS; j++)
                sum = plus(sum, own.fields[j][first + i], own.shares[j], fused);
            both[i] = sum;
        }
        for (Py_ssize_t i = 0; i < length; i++) {
            ones[from + i] = both[2 * i] * own.scales[0];
            others[from + i] = both[2 * i + 1] * own.scales[1];
        }
    }
}

INLINED void mix(const Mixture *of, Py_ssize_t row, Py_ssize_t column, const Plane *first, const Plane *second,
                 int fused)
{
    const Mixture own = *of;
    for (Py_ssize_t y = 0; y < first->rows; y++) {
        float *restrict ones = first->data + y * first->stride, *restrict others = second->data + y * second->stride;
        Py_ssize_t begin = (row + y) % own.side * own.side + column, x = 0;
        while (x < first->columns) { /* up to where the fields begin anew */
            const Py_ssize_t left = own.side - (column + x) % own.side;
            const Py_ssize_t end = x + left < first->columns ? x + left : first->columns;
            mix_stretch(&own, begin + x, end - x, ones + x, others + x, fused);
            x = end;
            begin -= own.side;
        }
    }
}

FUSING static void mix_fused(const Mixture *of, Py_ssize_t row, Py_ssize_t column, const Plane *first,
                             const Plane *second)
{
    mix(of, row, column, first, second, 1);
}

static void mix_twice(const Mixture *of, Py_ssize_t row, Py_ssize_t column, const Plane *first, const Plane *second)
{
    mix(of, row, column, first, second, 0);
}

/* As many numbers as there are in a tuple; -1 with an exception where it holds something else. */
static int numbers(PyObject *given, float *out, Py_ssize_t count)
{
    if (!PyTuple_Check(given) || PyTuple_Size(given) != count) {
        PyErr_Format(PyExc_TypeError, "a tuple of %zd is wanted", count);
        return -1;
    }
    for (Py_ssize_t i = 0; i < count; i++) {
        out[i] = (float)PyFloat_AsDouble(PyTuple_GetItem(given, i));
        if (PyErr_Occurred())
            return -1;
    }
    return 0;
}

/* mixed(shares, scales, side, row, column, first, second, four fields two by two) */
PyObject *mixed(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    if (count != 7 + FIELDS)
        return PyErr_Format(PyExc_TypeError, "mixed takes %d arguments, not %zd", 7 + FIELDS, count);
    Mixture of;
    if (numbers(given[0], of.shares, FIELDS) < 0 || numbers(given[1], of.scales, 2) < 0)
        return NULL;
    of.side = PyLong_AsSsize_t(given[2]);
    const Py_ssize_t row = PyLong_AsSsize_t(given[3]), column = PyLong_AsSsize_t(given[4]);
    if (PyErr_Occurred())
        return NULL;
    Arrays arrays = {.count = 0};
    Plane first, second;
    int done = plane(&arrays, given[5], 1, &first) == 0 && plane(&arrays, given[6], 1, &second) == 0;
    for (int j = 0; done && j < FIELDS; j++) {
        Py_ssize_t length;
        of.fields[j] = array(&arrays, given[7 + j], "f", 0, &length);
        done = of.fields[j] != NULL;
        if (done && (of.side < 1 || length != 2 * of.side * of.side)) {
            PyErr_SetString(PyExc_ValueError, "two fields of side x side, side by side, are wanted");
            done = 0;
        }
    }
    if (done && (row < 0 || column < 0 || second.rows != first.rows || second.columns != first.columns)) {
        PyErr_SetString(PyExc_ValueError, "two pictures of one size from a row and a column on are wanted");
        done = 0;
    }
    if (done)
        (fuses() ? mix_fused : mix_twice)(&of, row, column % of.side, &first, &second);
    release(&arrays);
    if (!done)
        return NULL;
    Py_RETURN_NONE;
}

#define ENTRIES (UINT16_MAX + 1)
#define CLOUD_BLOCK 512 /* pixels between passes: what they leave for each other stays in the nearest cache */

/* Thickness above which there is cloud, depth for each unit above it, what full sunlight adds; places of warmth in the
 * table of its glow: warmth times `step`, from `middle` on. */
typedef struct {
    float edge, depth, sunlit, step, middle;
    const float *glow;
} Look;

#define FAINTEST 88.0F /* from here on the power of two is 2^-127, whose bits are those of 0 */

/* e^-x of x from 0 to FAINTEST, where it is 0: within 2e-7 of it, a power of two, and the rest by its series. */
INLINED float faded(float x)
{
    const float power = x * 1.44269504F; /* log2 e */
    const int32_t whole = (int32_t)(power + 0.5F);
    const float y = ((float)whole - power) * 0.693147181F; /* -ln 2 / 2 to ln 2 / 2 */
    const float series =
        1 + y * (1 + y * (1.0F / 2 + y * (1.0F / 6 + y * (1.0F / 24 + y * (1.0F / 120 + y * (1.0F / 720))))));
    const union {
        int32_t bits;
        float value;
    } scale = {(127 - whole) << 23};
    return series * scale.value;
}

INLINED float within(float value, float most)
{
    const float above = value > 0 ? value : 0.0F; /* nan, too, is 0 */
    return above < most ? above : most;
}

INLINED void paint(const Look *look, const float *restrict thickness, const float *restrict warmth,
                   const float *restrict lit, float *restrict passed, float *restrict emitted, Py_ssize_t count,
                   int sunny)
{
    const Look own = *look;
    int32_t places[CLOUD_BLOCK];
    float thick[CLOUD_BLOCK], deep[CLOUD_BLOCK], lit_by[CLOUD_BLOCK]; /* written and read again: else the compiler branches where they are 0 */
    for (Py_ssize_t from = 0; from < count; from += CLOUD_BLOCK) {
        const Py_ssize_t length = count - from < CLOUD_BLOCK ? count - from : CLOUD_BLOCK;
        const float *restrict above = thickness + from, *restrict warm = warmth + from;
        const float *restrict sun = sunny ? lit + from : NULL;
        float *restrict left = passed + from, *restrict light = emitted + from;
        for (Py_ssize_t i = 0; i < length; i++) {
            places[i] = (int32_t)rintf(within(warm[i] * own.step + own.middle, ENTRIES - 1));
            thick[i] = within(above[i] - own.edge, FAINTEST);
            deep[i] = within((above[i] - own.edge) * own.depth, FAINTEST);
            lit_by[i] = sunny ? within(sun[i], 1.0F) : 0.0F;
        }
        for (Py_ssize_t i = 0; i < length; i++)
            light[i] = own.glow[places[i]];
        for (Py_ssize_t i = 0; i < length; i++) {
            const float added = sunny ? own.sunlit * lit_by[i] * faded(thick[i]) : 0.0F;
            left[i] = faded(deep[i]);
            light[i] = (light[i] + added) * (1 - left[i]);
        }
    }
}

/* Both ways are compiled apart: without sun nothing of it is read. */
INLINED void paint_in(const Look *look, const float *thickness, const float *warmth, const float *lit, float *passed,
                      float *emitted, Py_ssize_t count)
{
    if (lit == NULL)
        paint(look, thickness, warmth, NULL, passed, emitted, count, 0);
    else
        paint(look, thickness, warmth, lit, passed, emitted, count, 1);
}

FUSING static void paint_fused(const Look *look, const float *thickness, const float *warmth, const float *lit,
                               float *passed, float *emitted, Py_ssize_t count)
{
    paint_in(look, thickness, warmth, lit, passed, emitted, count);
}

static void paint_twice(const Look *look, const float *thickness, const float *warmth, const float *lit,
                        float *passed, float *emitted, Py_ssize_t count)
{
    paint_in(look, thickness, warmth, lit, passed, emitted, count);
}

/* cloud(thickness, warmth, lit, edge, depth, sunlit, glow, step, middle, passed, emitted): all float32 of one length
 * but the table; lit may be None */
PyObject *cloud(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    if (count != 11)
        return PyErr_Format(PyExc_TypeError, "cloud takes 11 arguments, not %zd", count);
    Look look;
    float *const numbers[] = {&look.edge, &look.depth, &look.sunlit, &look.step, &look.middle};
    const int places[] = {3, 4, 5, 7, 8};
    for (int i = 0; i < 5; i++) {
        *numbers[i] = (float)PyFloat_AsDouble(given[places[i]]);
        if (PyErr_Occurred())
            return NULL;
    }
    Arrays arrays = {.count = 0};
    Py_ssize_t length, warm, sunny, entries, left, light;
    const float *thickness = array(&arrays, given[0], "f", 0, &length);
    const float *warmth = thickness ? array(&arrays, given[1], "f", 0, &warm) : NULL;
    look.glow = warmth ? array(&arrays, given[6], "f", 0, &entries) : NULL;
    float *passed = look.glow ? array(&arrays, given[9], "f", 1, &left) : NULL;
    float *emitted = passed ? array(&arrays, given[10], "f", 1, &light) : NULL;
    const float *lit = emitted && given[2] != Py_None ? array(&arrays, given[2], "f", 0, &sunny) : NULL;
    int done = emitted != NULL && (lit != NULL || given[2] == Py_None);
    if (done && (warm != length || left != length || light != length || (lit != NULL && sunny != length) ||
                 entries != ENTRIES)) {
        PyErr_Format(PyExc_ValueError, "pictures of one size are wanted, and a table of %d", ENTRIES);
        done = 0;
    }
    if (done)
        (fuses() ? paint_fused : paint_twice)(&look, thickness, warmth, lit, passed, emitted, length);
    release(&arrays);
    if (!done)
        return NULL;
    Py_RETURN_NONE;
}
