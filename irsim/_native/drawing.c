#include "drawing.h"
#include "fused.h"
#include "seeding.h"

#ifdef WIDE_VECTORS
#include <immintrin.h>
#endif

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

/* What the table holds, by polynomials: PIECES of each of POWERS; see irsim/normal.py. */
#define PIECES 32
#define POWERS 5

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

int begin(Arrays *arrays, PyObject *given, Sfc64 *source)
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

int drawing(Arrays *arrays, PyObject *const *given, Drawing *drawn)
{
    Py_ssize_t cells = 0, factors = 0, depths = 0;
    int begun = begin(arrays, given[0], &drawn->source) == 0;
    drawn->table = begun ? array(arrays, given[1], "h", 0, &cells) : NULL;
    drawn->pieces = drawn->table ? array(arrays, given[2], "f", 0, &factors) : NULL;
    drawn->deep = drawn->pieces ? array(arrays, given[3], "d", 0, &depths) : NULL;
    long refined = drawn->deep ? PyLong_AsLong(given[4]) : -1;
    if (PyErr_Occurred())
        return -1;
    if (cells != CELLS || factors != POWERS * PIECES || depths != DEEP_LENGTH ||
        refined < 0 || refined > CELLS >> 12) {
        PyErr_SetString(PyExc_ValueError, "a table of 65536, its 5 x 32 factors, one of tails and the cells that it "
                                          "stands for are wanted");
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

#ifdef WIDE_VECTORS
#define WIDTH 16
#define WORDS (BLOCK / 4)

/* Those of a whole block, of its words, worked out from the pieces; the words of the next are drawn meanwhile, which
 * would be waited for otherwise. 0, or -1 without memory. */
FUSING_WIDELY static int by_pieces(const Drawing *drawn, Sfc64 *source, const uint64_t *words, uint64_t *next,
                                   int16_t *block, Py_ssize_t from, Outer *outer)
{
    Sfc64 own = *source;
    __m512 low[POWERS], high[POWERS];
    for (int power = 0; power < POWERS; power++) {
        low[power] = _mm512_loadu_ps(drawn->pieces + power * PIECES);
        high[power] = _mm512_loadu_ps(drawn->pieces + power * PIECES + WIDTH);
    }
    const __m512i refined = _mm512_set1_epi32(drawn->refined), sign = _mm512_set1_epi32(INT32_MIN);
    const __m512i digits = _mm512_set1_epi32(0x7fffff), one = _mm512_set1_epi32(0x3f800000); /* of a float; 1.0f */
    for (Py_ssize_t i = 0; i < BLOCK; i += WIDTH) {
        for (int word = 0; word < WIDTH / 4; word++)
            next[i / 4 + word] = next_word(&own);
        /* A word of the upper half is below 0 here: with all its bits turned it is the cell from the upper end. */
        const __m512i word = _mm512_cvtepi16_epi32(_mm256_loadu_si256((const __m256i *)(words + i / 4)));
        const __m512i upper = _mm512_srai_epi32(word, 31), cell = _mm512_xor_si512(word, upper);
        const __m512i bits = _mm512_castps_si512(_mm512_cvtepi32_ps(cell)), piece = _mm512_srli_epi32(bits, 22);
        const __m512 x = _mm512_castsi512_ps(_mm512_or_si512(_mm512_and_si512(bits, digits), one));
        __m512 value = _mm512_permutex2var_ps(low[POWERS - 1], piece, high[POWERS - 1]);
        for (int power = POWERS - 2; power >= 0; power--)
            value = _mm512_fmadd_ps(value, x, _mm512_permutex2var_ps(low[power], piece, high[power]));
        value = _mm512_castsi512_ps(
            _mm512_xor_si512(_mm512_castps_si512(value), _mm512_and_si512(upper, sign)));
        const __mmask16 inner = _mm512_cmpge_epi32_mask(cell, refined);
        const __m512i rounded = _mm512_cvtps_epi32(_mm512_mul_ps(value, _mm512_set1_ps(1 / NORMAL_UNIT)));
        _mm256_storeu_si256((__m256i *)(block + i), _mm512_maskz_cvtepi32_epi16(inner, rounded));
        if (inner != UINT16_MAX)
            for (int part = 0; part < WIDTH; part++) {
                const uint16_t from_end = (uint16_t)((words[(i + part) / 4] >> 16 * (part % 4)) + drawn->refined);
                if (!(inner >> part & 1) && note(outer, from + i + part, from_end) < 0)
                    return -1;
            }
    }
    *source = own;
    return 0;
}

/* All whole blocks, each used while it is at hand: how many normals they are, or -1 without memory. */
INLINED Py_ssize_t whole_blocks(const Drawing *drawn, Sfc64 *source, int16_t *block, Py_ssize_t length, Use use,
                                void *with, Outer *outer)
{
    uint64_t words[2][WORDS];
    Sfc64 after = *source; /* the words drawn for a block; `source` is a block ahead */
    if (length >= BLOCK)
        for (int i = 0; i < WORDS; i++)
            words[0][i] = next_word(source);
    Py_ssize_t from = 0;
    for (int now = 0; length - from >= BLOCK; from += BLOCK, now = !now) {
        after = *source;
        if (by_pieces(drawn, source, words[now], words[!now], block, from, outer) < 0)
            return -1;
        use(block, from, BLOCK, with);
    }
    *source = after;
    return from;
}
#endif

INLINED PyObject *draw_by(const Drawing *drawn, Py_ssize_t length, Use use, Mend mend, void *with, int widely)
{
    int16_t block[BLOCK];
    Outer outer = {NULL, 0, 0};
    Sfc64 source = drawn->source;
    Py_ssize_t from = 0;
#ifdef WIDE_VECTORS
    if (widely && (from = whole_blocks(drawn, &source, block, length, use, with, &outer)) < 0)
        goto failed;
#endif
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
    return draw_by(drawn, length, use, mend, with, fuses_widely());
}

PyObject *draw(const Drawing *drawn, Py_ssize_t length, Use use, Mend mend, void *with)
{
    return fuses() ? draw_fused(drawn, length, use, mend, with) : draw_by(drawn, length, use, mend, with, 0);
}

static void store(const int16_t *drawn, Py_ssize_t from, Py_ssize_t count, void *with)
{
    float *restrict out = (float *)with + from;
    for (Py_ssize_t i = 0; i < count; i++)
        out[i] = drawn[i] * NORMAL_UNIT;
}

static void store_one(float drawn, Py_ssize_t place, void *with)
{
    ((float *)with)[place] = drawn;
}

/* normals(seed, table, pieces, deep, refined, out) */
PyObject *normals(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    Drawing drawn;
    Py_ssize_t length;
    PyObject *done = NULL;
    if (count != DRAWING_ARGUMENTS + 1) {
        PyErr_SetString(PyExc_TypeError, "normals takes 6 arguments");
        return NULL;
    }
    if (drawing(&arrays, given, &drawn) == 0) {
        float *out = array(&arrays, given[DRAWING_ARGUMENTS], "f", 1, &length);
        if (out != NULL)
            done = draw(&drawn, length, store, store_one, out);
    }
    release(&arrays);
    return done;
}
