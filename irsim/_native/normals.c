/* Noise of a frame's pixels: unit normals, each used where it is drawn; see irsim/rng.py, irsim/camera/noise.py and
 * irsim/camera/ar1.py. Rounded as OpenCV rounds. */
#include "kernels.h"

/* The generator SFC64 (C. Doty-Humphrey, PractRand), as numpy.random.SFC64: three words of state and a counter. */
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

/* First state of numpy.random.SFC64 by 256 bits of numpy.random.SeedSequence (after M. E. O'Neill's seed_seq_fe). */
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

/* The first arguments of each kernel that draws: (seed, table, deep, refined). */
typedef struct {
    Sfc64 source;
    const int16_t *table;
    const double *deep;
    uint16_t refined;
} Drawing;

#define NORMAL_UNIT 0x1p-13f /* of the table's words; see irsim/rng.py */

/* Uses `count` normals, in NORMAL_UNIT, of the elements `from` on; `with` is the last argument of draw(). */
typedef void (*Use)(const int16_t *drawn, Py_ssize_t from, Py_ssize_t count, void *with);

/* Uses the normal of one element. */
typedef void (*Mend)(float drawn, Py_ssize_t place, void *with);

#define CELLS 65536
#define BLOCK 1024 /* normals at a time: they stay in the first-level cache */
#define AT_ONCE 64 /* words of a block that are searched together for one of an outer cell */

/* Table of the tails: from the quantile of 2^-82 to that of 2^-12, 2^DEPTH_BITS steps to a doubling; see irsim/rng.py. */
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

/* Called for one word of two thousand. */
static int note(Outer *outer, Py_ssize_t place, uint16_t word)
{
    if (outer->count == outer->room) {
        Record *records = grown(outer->records, &outer->room, sizeof *records);
        if (records == NULL)
            return -1;
        outer->records = records;
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

static Drawing drawing(Call *call)
{
    Py_ssize_t bytes, cells, depths;
    uint32_t entropy[ENTROPY_WORDS];
    const char *seed = input(call, 0, "B", &bytes);
    Drawing drawn = {.table = input(call, 1, "h", &cells), .deep = input(call, 2, "d", &depths)};
    const Py_ssize_t refined = whole(call, 3);
    if (call->failed)
        return drawn;
    if (bytes != sizeof entropy || cells != CELLS || depths != DEEP_LENGTH || refined < 0 || refined > CELLS >> 12) {
        wrong(call, "a seed of 32 bytes, a table of 65536, one of tails and the number of its cells are required");
        return drawn;
    }
    memcpy(entropy, seed, sizeof entropy);
    drawn.source = seeded(entropy);
    drawn.refined = (uint16_t)refined;
    return drawn;
}

/* The least of AT_ONCE words. */
INLINED int16_t least_of(const int16_t *words)
{
    int16_t least = 0;
    for (int i = 0; i < AT_ONCE; i++)
        least = words[i] < least ? words[i] : least;
    return least;
}

/* Notes the outer cells' marks (see `cell_words` in irsim/rng.py) among AT_ONCE words of the elements `from` on, and
 * sets them to 0; -1 without memory. */
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

/* The normals of `count` elements `from` on, by the table; -1 without memory. */
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

INLINED int draw_by(const Drawing *drawn, Py_ssize_t length, Use use, Mend mend, void *with, int fused)
{
    (void)fused; /* `use` and `mend` are */
    int16_t block[BLOCK];
    Outer outer = {NULL, 0, 0};
    Sfc64 source = drawn->source;
    int failed = 0;
    for (Py_ssize_t from = 0; from < length && !failed; from += BLOCK) {
        const Py_ssize_t count = length - from < BLOCK ? length - from : BLOCK;
        failed = by_table(drawn, &source, block, from, count, &outer) < 0;
        if (!failed)
            use(block, from, count, with);
    }
    for (Py_ssize_t i = 0; i < outer.count && !failed; i++) {
        const Record record = outer.records[i];
        if (record.place < length) /* the last word may have parts beyond */
            mend(tail(drawn->deep, drawn->refined, record.word, next_word(&source)), record.place, with);
    }
    PyMem_Free(outer.records);
    return failed;
}
BOTH(int, draw_by, (const Drawing *drawn, Py_ssize_t length, Use use, Mend mend, void *with), drawn, length, use, mend,
     with)

/* Draws `length` normals. `use` gets 0 for those of outer cells; `mend` adds them one by one afterwards. */
static void draw(Call *call, const Drawing *drawn, Py_ssize_t length, Use use, Mend mend, void *with)
{
    if (!call->failed && CHOSEN(draw_by)(drawn, length, use, mend, with)) {
        call->failed = 1;
        PyErr_NoMemory();
    }
}

/* NAME(with, place, drawn, fused), which uses the normal of one pixel, as a Mend, and over a block of pixels. */
#define MEND(name) BOTH(void, name, (float drawn, Py_ssize_t place, void *with), with, place, drawn)
#define USE(name)                                                                                                      \
    BOTH(void, name##_block, (const int16_t *drawn, Py_ssize_t from, Py_ssize_t count, void *with), drawn, from,       \
         count, with)
#define BLOCK_OF(name, type)                                                                                           \
    INLINED void name##_block(const int16_t *drawn, Py_ssize_t from, Py_ssize_t count, const type *with, int fused)    \
    {                                                                                                                  \
        const type own = *with;                                                                                        \
        EACH_ALONE                                                                                                     \
        for (Py_ssize_t i = 0; i < count; i++)                                                                         \
            name(&own, from + i, drawn[i] * NORMAL_UNIT, fused);                                                       \
    }

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

KERNEL(add_normals, 6)
{
    Py_ssize_t length;
    const Drawing drawn = drawing(call);
    Scaled to = {output(call, 4, "f", &length), (float)number(call, 5)};
    draw(call, &drawn, length, CHOSEN(scaled_block), CHOSEN(scaled), &to);
    return done(call);
}

/* A pixel's flat index and its signal, as numbers that Python reads directly. */
typedef struct {
    double place, held;
} Dark;

typedef struct {
    float *signal;
    float variance, well, few;
    Dark *dark; /* pixels that held less than few, from the first on */
    Py_ssize_t count, room;
    int failed;
} Shot;

static RARE void note_dark(Shot *to, Py_ssize_t place)
{
    if (to->count == to->room && !to->failed) {
        Dark *dark = grown(to->dark, &to->room, sizeof *dark);
        to->failed = dark == NULL;
        to->dark = dark ? dark : to->dark;
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

/* Dark pixels are noted before noise is added. */
INLINED void noted_shot_block(const int16_t *drawn, Py_ssize_t from, Py_ssize_t count, Shot *with, int fused)
{
    int dark = 0;
    for (Py_ssize_t i = 0; i < count; i++)
        dark |= with->signal[from + i] < with->few;
    for (Py_ssize_t place = from; dark && place < from + count; place++)
        if (with->signal[place] < with->few)
            note_dark(with, place);
    shot_block(drawn, from, count, with, fused);
}
USE(noted_shot)

KERNEL(add_shot, 8)
{
    Py_ssize_t length;
    const Drawing drawn = drawing(call);
    Shot to = {.signal = output(call, 4, "f", &length),
               .variance = (float)number(call, 5),
               .well = (float)number(call, 6),
               .few = (float)number(call, 7)};
    draw(call, &drawn, length, CHOSEN(noted_shot_block), CHOSEN(shot), &to);
    PyObject *dark = call->failed ? NULL
                     : to.failed  ? PyErr_NoMemory()
                                  : PyBytes_FromStringAndSize((const char *)to.dark, to.count * (Py_ssize_t)sizeof *to.dark);
    PyMem_Free(to.dark);
    return dark;
}

/* States and spread are in words of one unit. */
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
FUSING INLINED __m256i eight_bridged(const Bridge *with, const int16_t *drawn, Py_ssize_t place)
{
    const __m256i both = _mm256_add_epi32(eight_whole(with->before + place), eight_whole(with->after + place));
    const __m256 mean = _mm256_mul_ps(_mm256_cvtepi32_ps(both), _mm256_set1_ps(with->weight));
    const __m256 normal = _mm256_mul_ps(eight(drawn), _mm256_set1_ps(NORMAL_UNIT));
    return _mm256_cvtps_epi32(_mm256_fmadd_ps(normal, _mm256_set1_ps(with->spread), mean));
}

/* Rounded to the nearest, halves to even, and clipped to 16 bits. */
FUSING static Py_ssize_t bridged_sixteens(const int16_t *drawn, Py_ssize_t from, Py_ssize_t count, const Bridge *with)
{
    const Bridge own = *with;
    Py_ssize_t i = 0;
    for (; i + 16 <= count; i += 16) {
        const __m256i both = _mm256_packs_epi32(eight_bridged(&own, drawn + i, from + i),
                                                eight_bridged(&own, drawn + i + 8, from + i + 8));
        _mm256_storeu_si256((__m256i *)(own.out + from + i), _mm256_permute4x64_epi64(both, 0xd8));
    }
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

KERNEL(bridge, 9)
{
    Py_ssize_t length, before, after;
    const Drawing drawn = drawing(call);
    Bridge to = {input(call, 4, "h", &before), input(call, 5, "h", &after), output(call, 8, "h", &length),
                 (float)number(call, 6), (float)number(call, 7)};
    if (!call->failed && (before != length || after != length))
        return wrong(call, "states of one length are required");
    draw(call, &drawn, length, CHOSEN(bridged_block), CHOSEN(bridged), &to);
    return done(call);
}
