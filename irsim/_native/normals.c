/* Noise of a frame's pixels: unit normals, each used where it is drawn; see irsim/rng.py, irsim/camera/noise.py and
 * irsim/camera/ar1.py. Rounded as OpenCV rounds. */
#include "kernels.h"

/* The generator SFC64 (C. Doty-Humphrey, PractRand): the raw words of numpy.random.SFC64. */
/* As numpy keeps it: three words of state and a counter. */
typedef struct {
    uint64_t a, b, c, counter;
} Sfc64;

static inline uint64_t next_word(Sfc64 *source)
{
    uint64_t word = source->a + source->b + source->counter++;
    source->a = source->b ^ (source->b >> 11);
    source->b = source->c + (source->c << 3);
    source->c = ((source->c << 24) | (source->c >> 40)) + word;
    return word;
}

/* The state that numpy.random.SFC64 begins with, given 256 bits: those of numpy.random.SeedSequence, which is after
 * M. E. O'Neill's seed_seq_fe and as stable as the generator. */
enum { ENTROPY_WORDS = 8, POOL_WORDS = 4, STATE_HALVES = 6, FIRST_ROUNDS = 12 };

static inline uint32_t hashed(uint32_t value, uint32_t *constant, uint32_t multiplier)
{
    value ^= *constant;
    *constant *= multiplier;
    value *= *constant;
    return value ^ value >> 16;
}

static inline uint32_t mix(uint32_t x, uint32_t y)
{
    uint32_t sum = 0xca01f9dd * x - 0x4973f715 * y;
    return sum ^ sum >> 16;
}

static inline Sfc64 seeded(const uint32_t *entropy)
{
    const uint32_t into_pool = 0x931e8875, out_of_pool = 0x58f38ded;
    uint32_t constant = 0x43b0d7e5, pool[POOL_WORDS], halves[STATE_HALVES];
    for (int i = 0; i < POOL_WORDS; i++)
        pool[i] = hashed(entropy[i], &constant, into_pool);
    for (int from = 0; from < POOL_WORDS; from++)
        for (int to = 0; to < POOL_WORDS; to++)
            if (from != to)
                pool[to] = mix(pool[to], hashed(pool[from], &constant, into_pool));
    for (int from = POOL_WORDS; from < ENTROPY_WORDS; from++)
        for (int to = 0; to < POOL_WORDS; to++)
            pool[to] = mix(pool[to], hashed(entropy[from], &constant, into_pool));
    constant = 0x8b51f9dd;
    for (int i = 0; i < STATE_HALVES; i++)
        halves[i] = hashed(pool[i % POOL_WORDS], &constant, out_of_pool);
    Sfc64 source = {
        .a = halves[0] | (uint64_t)halves[1] << 32,
        .b = halves[2] | (uint64_t)halves[3] << 32,
        .c = halves[4] | (uint64_t)halves[5] << 32,
        .counter = 1,
    };
    for (int i = 0; i < FIRST_ROUNDS; i++)
        next_word(&source);
    return source;
}

/* What every function that draws takes first: (seed, table, deep, refined). */
typedef struct {
    Sfc64 source;
    const int16_t *table;
    const double *deep;
    uint16_t refined;
} Drawing;

#define DRAWING_ARGUMENTS 4

#define NORMAL_UNIT 0x1p-13f /* of the table's words; see irsim/normal.py */

/* Uses `count` normals, words that count NORMAL_UNIT, those of the elements `from` on; `with` is what draw() was given. */
typedef void (*Use)(const int16_t *drawn, Py_ssize_t from, Py_ssize_t count, void *with);

/* Uses the normal of one element. */
typedef void (*Mend)(float drawn, Py_ssize_t place, void *with);

#define CELLS 65536
#define BLOCK 1024 /* normals at a time: they stay in the first-level cache */
#define AT_ONCE 64 /* words of a block of which it is asked together whether any is of an outer cell */

/* The table of the tails goes from the quantile of 2^-82 to that of 2^-12, by 2^DEPTH_BITS steps to a doubling; see
 * irsim/normal.py. */
#define DEEPEST ((uint64_t)(1023 - 82))
#define DEPTH_BITS 8
#define DEEP_LENGTH ((82 - 12) * (1 << DEPTH_BITS) + 2)

typedef struct {
    Py_ssize_t place;
    uint16_t word;
} Record;

typedef struct {
    Record *records;
    Py_ssize_t count, room;
} Outer;

/* One word of two thousand comes here. */
static int note(Outer *outer, Py_ssize_t place, uint16_t word)
{
    if (outer->count == outer->room) {
        Py_ssize_t room = 2 * outer->room + 64;
        Record *records = PyMem_Realloc(outer->records, (size_t)room * sizeof *records);
        if (records == NULL)
            return -1;
        outer->records = records;
        outer->room = room;
    }
    outer->records[outer->count++] = (Record){place, word};
    return 0;
}

/* The normal of a word in an outer cell, counted from the upper end on and then from the lower; `further` places it
 * within its cell. */
static float tail(const double *deep, uint16_t refined, uint16_t word, uint64_t further)
{
    const int upper = word < refined;
    const double from_end = upper ? refined - 1 - word : word - refined;
    const double p = (from_end + ((double)further + 0.5) * 0x1p-64) / CELLS;
    uint64_t bits;
    memcpy(&bits, &p, sizeof bits);
    const uint64_t place = (bits >> (52 - DEPTH_BITS)) - (DEEPEST << DEPTH_BITS);
    const uint64_t step = UINT64_C(1) << (52 - DEPTH_BITS);
    const double share = (double)(bits & (step - 1)) * (1.0 / (double)step);
    const double value = deep[place] + share * (deep[place + 1] - deep[place]);
    return (float)(upper ? -value : value);
}

/* The generator of a seed of 32 bytes: 0, or -1 with an exception. */
static int begin(Arrays *arrays, PyObject *given, Sfc64 *source)
{
    Py_ssize_t bytes;
    uint32_t entropy[ENTROPY_WORDS];
    const char *seed = array(arrays, given, "B", 0, &bytes);
    if (seed == NULL)
        return -1;
    if (bytes != sizeof entropy) {
        PyErr_SetString(PyExc_ValueError, "a seed of 32 bytes is wanted");
        return -1;
    }
    memcpy(entropy, seed, sizeof entropy);
    *source = seeded(entropy);
    return 0;
}

/* Reads the first DRAWING_ARGUMENTS arguments: 0, or -1 with an exception. */
static int drawing(Arrays *arrays, PyObject *const *given, Drawing *drawn)
{
    Py_ssize_t cells = 0, depths = 0;
    int begun = begin(arrays, given[0], &drawn->source) == 0;
    drawn->table = begun ? array(arrays, given[1], "h", 0, &cells) : NULL;
    drawn->deep = drawn->table ? array(arrays, given[2], "d", 0, &depths) : NULL;
    long refined = drawn->deep ? PyLong_AsLong(given[3]) : -1;
    if (PyErr_Occurred())
        return -1;
    if (cells != CELLS || depths != DEEP_LENGTH || refined < 0 || refined > CELLS >> 12) {
        PyErr_SetString(PyExc_ValueError, "a table of 65536, one of tails and the cells that it stands for are wanted");
        return -1;
    }
    drawn->refined = (uint16_t)refined;
    return 0;
}

/* The least of AT_ONCE words. */
INLINED int16_t least_of(const int16_t *words)
{
    int16_t least = 0;
    for (int i = 0; i < AT_ONCE; i++)
        least = words[i] < least ? words[i] : least;
    return least;
}

/* Outer cells' marks (see `cell_words` in irsim/normal.py) among AT_ONCE words, those of the elements from `from` on, are noted and become 0: 0, or -1
 * without memory. Kept out of the loop that it would slow down. */
static RARE int note_all(const Drawing *drawn, int16_t *words, Py_ssize_t from, Outer *outer)
{
    for (int i = 0; i < AT_ONCE; i++) {
        const int from_end = words[i] - INT16_MIN;
        if (from_end < 2 * drawn->refined) {
            if (note(outer, from + i, (uint16_t)from_end) < 0)
                return -1;
            words[i] = 0;
        }
    }
    return 0;
}

/* The normals of `count` elements from `from` on, by the table: 0, or -1 without memory. */
INLINED int by_table(const Drawing *drawn, Sfc64 *source, int16_t *block, Py_ssize_t from, Py_ssize_t count,
                     Outer *outer)
{
    const int16_t *table = drawn->table;
    Sfc64 own = *source;
    Py_ssize_t end = 0;
    for (; end < count; end += 4) {
        const uint64_t word = next_word(&own);
        for (int part = 0; part < 4; part++)
            block[end + part] = table[(uint16_t)(word >> 16 * part)];
    }
    *source = own;
    for (; end % AT_ONCE; end++)
        block[end] = 0;
    const int beyond = INT16_MIN + 2 * drawn->refined;
    for (Py_ssize_t i = 0; i < end; i += AT_ONCE)
        if (least_of(block + i) < beyond && note_all(drawn, block + i, from + i, outer) < 0)
            return -1;
    return 0;
}

INLINED PyObject *draw_by(const Drawing *drawn, Py_ssize_t length, Use use, Mend mend, void *with)
{
    int16_t block[BLOCK];
    Outer outer = {NULL, 0, 0};
    Sfc64 source = drawn->source;
    Py_ssize_t from = 0;
    for (; from < length; from += BLOCK) {
        const Py_ssize_t count = length - from < BLOCK ? length - from : BLOCK;
        if (by_table(drawn, &source, block, from, count, &outer) < 0)
            goto failed;
        use(block, from, count, with);
    }
    while (outer.count > 0 && outer.records[outer.count - 1].place >= length)
        outer.count--; /* the last word has parts that no one asked for */
    for (Py_ssize_t i = 0; i < outer.count; i++)
        mend(tail(drawn->deep, drawn->refined, outer.records[i].word, next_word(&source)), outer.records[i].place,
             with);
    PyMem_Free(outer.records);
    Py_RETURN_NONE;
failed:
    PyMem_Free(outer.records);
    return PyErr_NoMemory();
}

FUSING static PyObject *draw_fused(const Drawing *drawn, Py_ssize_t length, Use use, Mend mend, void *with)
{
    return draw_by(drawn, length, use, mend, with);
}

/* Draws `length` normals: None, or NULL with an exception. `use` sees 0 for those of outer cells; `mend` adds them
 * one by one afterwards. */
static PyObject *draw(const Drawing *drawn, Py_ssize_t length, Use use, Mend mend, void *with)
{
    return fuses() ? draw_fused(drawn, length, use, mend, with) : draw_by(drawn, length, use, mend, with);
}

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

/* add_normals(seed, table, deep, refined, signal, scale) */
PyObject *add_normals(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    Drawing drawn;
    Scaled to;
    Py_ssize_t length;
    PyObject *done = NULL;
    if (so_many("add_normals", count, 6) && drawing(&arrays, given, &drawn) == 0 &&
        (to.signal = array(&arrays, given[4], "f", 1, &length)) != NULL && numbers(given, 5, 1, &to.scale) == 0)
        done = draw(&drawn, length, CHOSEN(scaled), CHOSEN(scaled_one), &to);
    release(&arrays);
    return done;
}

/* add_shot(seed, table, deep, refined, signal, variance, well, few) */
PyObject *add_shot(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    Drawing drawn;
    Shot to = {.dark = NULL};
    Py_ssize_t length;
    float limits[3];
    PyObject *done = NULL;
    if (so_many("add_shot", count, 8) && drawing(&arrays, given, &drawn) == 0 &&
        (to.signal = array(&arrays, given[4], "f", 1, &length)) != NULL && numbers(given, 5, 3, limits) == 0) {
        to.variance = limits[0];
        to.well = limits[1];
        to.few = limits[2];
        done = draw(&drawn, length, CHOSEN(noted_shot), CHOSEN(shot_one), &to);
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

/* bridge(seed, table, deep, refined, before, after, weight, spread, out) */
PyObject *bridge(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    Drawing drawn;
    Bridge to;
    Py_ssize_t length, before, after;
    float scales[2];
    PyObject *done = NULL;
    if (so_many("bridge", count, 9) && drawing(&arrays, given, &drawn) == 0 &&
        (to.before = array(&arrays, given[4], "h", 0, &before)) != NULL &&
        (to.after = array(&arrays, given[5], "h", 0, &after)) != NULL &&
        (to.out = array(&arrays, given[8], "h", 1, &length)) != NULL && numbers(given, 6, 2, scales) == 0) {
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
