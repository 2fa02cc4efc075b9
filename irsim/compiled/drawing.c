#include "drawing.h"
#include "fused.h"
#include "seeding.h"

#define CELLS 65536
#define BLOCK 1024 /* normals at a time, a multiple of 4: they stay in the first-level cache */

/* The table of the tails goes from the quantile of 2^-82 to that of 2^-12, by 2^DEPTH_BITS steps to a doubling; see
 * irsim/normal.py. */
#define DEEPEST ((uint64_t)(1023 - 82))
#define DEPTH_BITS 8
#define DEEP_LENGTH ((82 - 12) * (1 << DEPTH_BITS) + 2)

typedef struct {
    Py_ssize_t place;
    uint16_t word;
} Record;

#if defined(__GNUC__)
#define FETCH(place) __builtin_prefetch(place)
#else
#define FETCH(place) (void)(place)
#endif

#define LINE 16 /* float numbers in a line of the cache */

typedef struct {
    Record *records;
    Py_ssize_t count, room;
} Outer;

/* One word of two thousand comes here: kept out of the loop that it would slow down by a fifth. */
static RARE int note(Outer *outer, Py_ssize_t place, uint16_t word)
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

int drawing(Arrays *arrays, PyObject *const *given, Drawing *drawn)
{
    Py_ssize_t bytes = 0, cells = 0, depths = 0;
    const char *seed = array(arrays, given[0], "B", 0, &bytes);
    uint32_t entropy[ENTROPY_WORDS];
    drawn->table = seed ? array(arrays, given[1], "f", 0, &cells) : NULL;
    drawn->deep = drawn->table ? array(arrays, given[2], "d", 0, &depths) : NULL;
    long refined = drawn->deep ? PyLong_AsLong(given[3]) : -1;
    if (PyErr_Occurred())
        return -1;
    if (bytes != sizeof entropy || cells != CELLS || depths != DEEP_LENGTH || refined < 0 || refined > CELLS >> 12) {
        PyErr_SetString(PyExc_ValueError, "a seed of 32 bytes, a table of 65536, one of tails and the cells that it "
                                          "stands for are wanted");
        return -1;
    }
    memcpy(entropy, seed, sizeof entropy);
    drawn->source = seeded(entropy);
    drawn->refined = (uint16_t)refined;
    return 0;
}

/* What of the arrays is used with the normal at `place`, where there is one. */
INLINED void fetch(const float *const *streams, Py_ssize_t place, Py_ssize_t length)
{
    if (place < length)
        for (int i = 0; i < STREAMS; i++)
            FETCH(streams[i] + place);
}

/* Both ways to draw: compiled apart, as the loop of one has no time for a question. */
INLINED PyObject *draw_for(Drawing *drawn, Py_ssize_t length, Use use, Use mend, void *with,
                           const float *const *streams)
{
    float block[BLOCK];
    Outer outer = {NULL, 0, 0};
    Sfc64 source = drawn->source;
    const float *table = drawn->table;
    const uint16_t refined = drawn->refined, both_ends = (uint16_t)(2 * refined);
    for (Py_ssize_t from = 0; from < length; from += BLOCK) {
        Py_ssize_t count = length - from < BLOCK ? length - from : BLOCK;
        for (Py_ssize_t i = 0; i < count; i += 4) {
            uint64_t word = next_word(&source);
            if (streams != NULL && i % LINE == 0)
                fetch(streams, from + BLOCK + i, length);
            for (int part = 0; part < 4; part++) {
                uint16_t cell = (uint16_t)(word >> 16 * part), from_end = (uint16_t)(cell + refined); /* wraps */
                block[i + part] = table[cell];
                if (from_end < both_ends) {
                    block[i + part] = 0.0f;
                    if (note(&outer, from + i + part, from_end) < 0)
                        goto failed;
                }
            }
        }
        use(block, from, count, with);
    }
    while (outer.count > 0 && outer.records[outer.count - 1].place >= length)
        outer.count--; /* the last word has parts that no one asked for */
    for (Py_ssize_t i = 0; i < outer.count; i++) {
        const float value = tail(drawn->deep, refined, outer.records[i].word, next_word(&source));
        mend(&value, outer.records[i].place, 1, with);
    }
    PyMem_Free(outer.records);
    Py_RETURN_NONE;
failed:
    PyMem_Free(outer.records);
    return PyErr_NoMemory();
}

PyObject *draw(Drawing *drawn, Py_ssize_t length, Use use, Use mend, void *with)
{
    return draw_for(drawn, length, use, mend, with, NULL);
}

PyObject *draw_ahead(Drawing *drawn, Py_ssize_t length, Use use, Use mend, void *with,
                     const float *const streams[STREAMS])
{
    return draw_for(drawn, length, use, mend, with, streams);
}

static void store(const float *drawn, Py_ssize_t from, Py_ssize_t count, void *with)
{
    memcpy((float *)with + from, drawn, (size_t)count * sizeof *drawn);
}

/* normals(seed, table, deep, refined, out) */
PyObject *normals(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    Drawing drawn;
    Py_ssize_t length;
    PyObject *done = NULL;
    if (count != DRAWING_ARGUMENTS + 1) {
        PyErr_SetString(PyExc_TypeError, "normals takes 5 arguments");
        return NULL;
    }
    if (drawing(&arrays, given, &drawn) == 0) {
        float *out = array(&arrays, given[DRAWING_ARGUMENTS], "f", 1, &length);
        if (out != NULL)
            done = draw(&drawn, length, store, store, out);
    }
    release(&arrays);
    return done;
}
