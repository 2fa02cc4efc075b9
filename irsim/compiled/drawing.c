#include "drawing.h"
#include "seeding.h"

#define CELLS 65536
#define BLOCK 1024 /* normals at a time, a multiple of 4: they stay in the first-level cache */
#define WORDS 3    /* of an outer cell's record */

#if defined(__GNUC__)
#define RARE __attribute__((noinline, cold))
#else
#define RARE
#endif

typedef struct {
    uint64_t *records;
    Py_ssize_t count, room;
} Outer;

/* One word of two thousand comes here: kept out of the loop that it would slow down by a fifth. */
static RARE int note(Outer *outer, Py_ssize_t place, uint16_t word)
{
    if (outer->count == outer->room) {
        Py_ssize_t room = 2 * outer->room + 64;
        uint64_t *records = PyMem_Realloc(outer->records, (size_t)room * WORDS * sizeof *records);
        if (records == NULL)
            return -1;
        outer->records = records;
        outer->room = room;
    }
    outer->records[WORDS * outer->count] = (uint64_t)place;
    outer->records[WORDS * outer->count + 1] = word;
    outer->count++;
    return 0;
}

int drawing(Arrays *arrays, PyObject *const *given, Drawing *drawn)
{
    Py_ssize_t bytes = 0, cells = 0;
    const char *seed = array(arrays, given[0], "B", 0, &bytes);
    uint32_t entropy[ENTROPY_WORDS];
    drawn->table = seed ? array(arrays, given[1], "f", 0, &cells) : NULL;
    long refined = drawn->table ? PyLong_AsLong(given[2]) : -1;
    if (PyErr_Occurred())
        return -1;
    if (bytes != sizeof entropy || cells != CELLS || refined < 0 || refined > CELLS / 2 - 1) {
        PyErr_SetString(PyExc_ValueError, "a seed of 32 bytes, a table of 65536 and its outer cells are wanted");
        return -1;
    }
    memcpy(entropy, seed, sizeof entropy);
    drawn->source = seeded(entropy);
    drawn->refined = (uint16_t)refined;
    return 0;
}

PyObject *draw(Drawing *drawn, Py_ssize_t length, Use use, void *with)
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
    while (outer.count > 0 && outer.records[WORDS * (outer.count - 1)] >= (uint64_t)length)
        outer.count--; /* the last word has parts that no one asked for */
    for (Py_ssize_t i = 0; i < outer.count; i++)
        outer.records[WORDS * i + 2] = next_word(&source);
    PyObject *found = PyBytes_FromStringAndSize((const char *)outer.records, outer.count * WORDS * 8);
    PyMem_Free(outer.records);
    return found;
failed:
    PyMem_Free(outer.records);
    return PyErr_NoMemory();
}

static void store(const float *drawn, Py_ssize_t from, Py_ssize_t count, void *with)
{
    memcpy((float *)with + from, drawn, (size_t)count * sizeof *drawn);
}

/* normals(seed, table, refined, out) */
PyObject *normals(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    Drawing drawn;
    Py_ssize_t length;
    PyObject *outer = NULL;
    if (count != DRAWING_ARGUMENTS + 1) {
        PyErr_SetString(PyExc_TypeError, "normals takes 4 arguments");
        return NULL;
    }
    if (drawing(&arrays, given, &drawn) == 0) {
        float *out = array(&arrays, given[DRAWING_ARGUMENTS], "f", 1, &length);
        if (out != NULL)
            outer = draw(&drawn, length, store, out);
    }
    release(&arrays);
    return outer;
}
