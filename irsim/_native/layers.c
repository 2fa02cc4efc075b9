/* Cloud layers: two states mixed and shifted by parts of a pixel (see irsim/backgrounds/cloud_drift.py), sums of fields
 * (cloud_evolution.py), and their shading (clouds.py). States are 16-bit words: half as much memory is read. */
#include "kernels.h"

#define WHOLE 32768  /* sum of the shares of words */
#define LEAST -32768 /* the word for the value 0 */

/* Shares of a word and of the one right of it, in either state, times -1: int16 holds -WHOLE. Weighted sums of words fit
 * 32 bits, and are exact. */
typedef struct {
    int16_t of_early, right_of_early, of_late, right_of_late;
} Shares;

/* Two states, a row and a column larger than the picture; the value of a weighted sum is sum * unit + zero. */
typedef struct {
    Words early, late;
    Shares shares;
    float unit, zero;
    float *above; /* room for a row between its pixels: sums */
} Field;

/* The sum between two columns, of both states. */
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

/* The value of a pixel by the sums at its upper edge, which is kept, and its lower edge, kept for the next row. */
INLINED float between(const Field *field, float *kept, float below, float down, int fused)
{
    const float above = *kept;
    *kept = below;
    return plus(field->zero, plus(above, below - above, down, fused), field->unit, fused);
}

/* Transmittance of the air before a layer, and its own light: each as large as the picture. */
typedef struct {
    Plane passed, lit;
} Air;

/* Sources of a row of the picture: words of both states of both fields, the light behind, and the air. */
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
/* Products of neighbouring words summed in one step: 0.32 ns a pixel, 0.45 with words as floats, 0.66 as the compiler
 * does that (Zen 3). Shares of a word and of the one right of it, eight times each. */
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

/* Eight pixels of a row from the i-th on, by transmittance and emission. */
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

/* As many pixels of a row as there are by sixteens, as in `lay_rows`; returns their number. */
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

BOTH(void, see, (const Field *field, float down, const Plane *out), field, down, out)

/* `under` may be the light itself; air may be NULL. Behind air of transmittance tau and light p, a layer of transmittance
 * t and emission e leaves of u: u t + tau e + p (1 - t) = (u - p) t + tau e + p. */
INLINED void lay_rows(const Field *passed, const Field *emitted, float down, const Plane *under, const Plane *light,
                      const Air *air, int fused)
{
    const Field through = *passed, own = *emitted;
    begin_rows(passed, light->columns);
    begin_rows(emitted, light->columns);
    for (Py_ssize_t row = 0; row < light->rows; row++) {
        const Row at = row_of(&through, &own, under, light, air, row);
        const Py_ssize_t done = fused ? lay_sixteens(&through, &own, down, &at, light->columns) : 0;
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

/* Compiled apart: without air none is read. */
INLINED void lay_in(const Field *passed, const Field *emitted, float down, const Plane *under, const Plane *light,
                    const Air *air, int fused)
{
    if (air == NULL)
        lay_rows(passed, emitted, down, under, light, NULL, fused);
    else
        lay_rows(passed, emitted, down, under, light, air, fused);
}
BOTH(void, lay_in, (const Field *passed, const Field *emitted, float down, const Plane *under, const Plane *light,
                    const Air *air), passed, emitted, down, under, light, air)

#define SHARES 4

static Shares shares_of(Call *call, int first)
{
    int16_t found[SHARES];
    Py_ssize_t sum = 0;
    int right = 1;
    for (int i = 0; i < SHARES; i++) {
        const Py_ssize_t share = whole(call, first + i);
        right &= 0 <= share && share <= WHOLE;
        found[i] = (int16_t)-share;
        sum += share;
    }
    if (!call->failed && (!right || sum != WHOLE))
        wrong(call, "shares of 0 to 32768 that sum to 32768 are required");
    return (Shares){found[0], found[1], found[2], found[3]};
}

static int as_large(const Plane *one, const Plane *other)
{
    return one->rows == other->rows && one->columns == other->columns;
}

/* Reads, from argument `first` on: four shares, down, the unit of each field, the picture, early and late of each field. */
static void fields_of(Call *call, int first, float *down, Plane *picture, Field *fields, int count)
{
    const Shares shares = shares_of(call, first);
    const int states = first + SHARES + 2 + count;
    *down = (float)number(call, first + SHARES);
    *picture = plane(call, states - 1, PyBUF_WRITABLE);
    for (int i = 0; i < count; i++) {
        const float unit = (float)number(call, first + SHARES + 1 + i);
        const Words early = words(call, states + 2 * i), late = words(call, states + 2 * i + 1);
        fields[i] = (Field){early, late, shares, unit / -WHOLE, unit * -LEAST, room(call, picture->columns, sizeof(float))};
        if (!call->failed && (early.rows != picture->rows + 1 || early.columns != picture->columns + 1 ||
                              late.rows != early.rows || late.columns != early.columns))
            wrong(call, "states a row and a column larger than the picture are required");
    }
}

KERNEL(moved, 9)
{
    float down;
    Plane out;
    Field field;
    fields_of(call, 0, &down, &out, &field, 1);
    if (!call->failed)
        CHOSEN(see)(&field, down, &out);
    return done(call);
}

KERNEL_OF(veil, 13, 15)
{
    if (call->count == 14)
        return PyErr_Format(PyExc_TypeError, "veil takes both tau and path, or neither");
    float down;
    Plane light;
    Field fields[2];
    Air air;
    const int airy = call->count == 15;
    fields_of(call, 1, &down, &light, fields, 2);
    const Plane under = plane(call, 0, 0);
    if (airy)
        air = (Air){plane(call, 13, 0), plane(call, 14, 0)};
    if (call->failed)
        return NULL;
    if (!as_large(&under, &light) || (airy && !(as_large(&air.passed, &light) && as_large(&air.lit, &light))))
        return wrong(call, "the light under a veil, and the air before it, must be as large as the picture");
    CHOSEN(lay_in)(&fields[0], &fields[1], down, &under, &light, airy ? &air : NULL);
    return done(call);
}

#define FIELDS 4
#define MIX_BLOCK 256 /* pixels at a time: their sums stay in the first-level cache */

/* Four times two fields side by side, of side x side each. */
typedef struct {
    const float *fields[FIELDS];
    float shares[FIELDS], scales[2];
    Py_ssize_t side;
} Mixture;

/* A stretch of a row within the fields from their pixel `place` on. They are summed side by side, then taken apart. */
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

BOTH(void, mix, (const Mixture *of, Py_ssize_t row, Py_ssize_t column, const Plane *first, const Plane *second), of, row,
     column, first, second)

/* Argument i as a tuple of `count` numbers. */
static void numbers_of(Call *call, int i, float *out, Py_ssize_t count)
{
    PyObject *given = call->given[i];
    if (!call->failed && (!PyTuple_Check(given) || PyTuple_Size(given) != count)) {
        PyErr_Format(PyExc_TypeError, "a tuple of %zd is required", count);
        call->failed = 1;
    }
    for (Py_ssize_t j = 0; j < count && !call->failed; j++) {
        out[j] = (float)PyFloat_AsDouble(PyTuple_GetItem(given, j));
        call->failed = PyErr_Occurred() != NULL;
    }
}

KERNEL(mixed, 7 + FIELDS)
{
    Mixture of;
    numbers_of(call, 0, of.shares, FIELDS);
    numbers_of(call, 1, of.scales, 2);
    of.side = whole(call, 2);
    const Py_ssize_t row = whole(call, 3), column = whole(call, 4);
    const Plane first = plane(call, 5, PyBUF_WRITABLE), second = plane(call, 6, PyBUF_WRITABLE);
    int right = 0 < of.side && of.side <= INT32_MAX;
    for (int j = 0; j < FIELDS; j++) {
        Py_ssize_t length;
        of.fields[j] = input(call, 7 + j, "f", &length);
        right = right && length == 2 * of.side * of.side;
    }
    if (call->failed)
        return NULL;
    if (!right)
        return wrong(call, "two fields of side x side, side by side, are required");
    if (row < 0 || column < 0 || !as_large(&first, &second))
        return wrong(call, "two pictures of one size from a row and a column on are required");
    CHOSEN(mix)(&of, row, column % of.side, &first, &second);
    return done(call);
}

#define ENTRIES (UINT16_MAX + 1)
#define CLOUD_BLOCK 512 /* pixels at a time: the passes over them stay in the first-level cache */

/* Thickness at which cloud begins, depth for each unit above it, light added by full sun; the place of warmth in the
 * table of its glow is warmth * step + middle. */
typedef struct {
    float edge, depth, sunlit, step, middle;
    const float *glow;
} Look;

#define FAINTEST 88.0F /* from here on the power of two is 2^-127, whose bits are those of 0 */

/* e^-x for x from 0 to FAINTEST, where it is 0: a power of two times a series, within 2e-7. */
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
    float thick[CLOUD_BLOCK], deep[CLOUD_BLOCK], lit_by[CLOUD_BLOCK]; /* kept: else the compiler branches at 0 */
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

WIDE static void paint_any(const Look *look, const float *thickness, const float *warmth, const float *lit,
                           float *passed, float *emitted, Py_ssize_t count)
{
    if (lit == NULL) /* compiled apart: no sunlight is read */
        paint(look, thickness, warmth, NULL, passed, emitted, count, 0);
    else
        paint(look, thickness, warmth, lit, passed, emitted, count, 1);
}

KERNEL(cloud, 11)
{
    Py_ssize_t length, warm, sunny, entries, left, light;
    const float *thickness = input(call, 0, "f", &length), *warmth = input(call, 1, "f", &warm), *lit = NULL;
    sunny = length;
    if (call->given[2] != Py_None)
        lit = input(call, 2, "f", &sunny);
    const Look look = {(float)number(call, 3), (float)number(call, 4), (float)number(call, 5), (float)number(call, 7),
                       (float)number(call, 8), input(call, 6, "f", &entries)};
    float *passed = output(call, 9, "f", &left), *emitted = output(call, 10, "f", &light);
    if (call->failed)
        return NULL;
    if (warm != length || left != length || light != length || sunny != length || entries != ENTRIES)
        return wrong(call, "pictures of one size are required, and a table of 65536");
    paint_any(&look, thickness, warmth, lit, passed, emitted, length);
    return done(call);
}
