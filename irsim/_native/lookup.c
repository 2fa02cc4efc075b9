/* Tables of 16-bit words, read for whole pictures; see irsim/lookup.py. */
#include <stdint.h>

#include "lookup.h"

#define ENTRIES (UINT16_MAX + 1)

/* Four at a time: a third faster than one by one. */
#define READ(name, entry)                                                                                              \
    static void name(const entry *restrict table, const uint16_t *restrict words, entry *restrict out,                 \
                     Py_ssize_t length)                                                                                \
    {                                                                                                                  \
        Py_ssize_t i = 0;                                                                                              \
        for (; i + 4 <= length; i += 4) {                                                                              \
            out[i] = table[words[i]];                                                                                  \
            out[i + 1] = table[words[i + 1]];                                                                          \
            out[i + 2] = table[words[i + 2]];                                                                          \
            out[i + 3] = table[words[i + 3]];                                                                          \
        }                                                                                                              \
        for (; i < length; i++)                                                                                        \
            out[i] = table[words[i]];                                                                                  \
    }

READ(read_bytes, uint8_t)
READ(read_floats, float)

/* 1, or 0 where it is of something else; -1 with an exception where it is no array. */
static int holds_floats(PyObject *given)
{
    Py_buffer view;
    if (PyObject_GetBuffer(given, &view, PyBUF_C_CONTIGUOUS | PyBUF_FORMAT) < 0)
        return -1;
    int floats = is_of(&view, "f");
    PyBuffer_Release(&view);
    return floats;
}

/* lookup(table, words, out): table and out of float32 or of uint8 */
PyObject *lookup(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    if (count != 3)
        return PyErr_Format(PyExc_TypeError, "lookup takes 3 arguments, not %zd", count);
    const int floats = holds_floats(given[0]);
    if (floats < 0)
        return NULL;
    Arrays arrays = {.count = 0};
    const char *format = floats ? "f" : "B";
    Py_ssize_t entries, length, wanted;
    const void *table = array(&arrays, given[0], format, 0, &entries);
    const uint16_t *words = table ? array(&arrays, given[1], "H", 0, &length) : NULL;
    void *out = words ? array(&arrays, given[2], format, 1, &wanted) : NULL;
    int done = out != NULL && entries == ENTRIES && wanted == length;
    if (done && floats)
        read_floats(table, words, out, length);
    else if (done)
        read_bytes(table, words, out, length);
    else if (out != NULL)
        PyErr_Format(PyExc_ValueError, "a table of %d is wanted, and a place for each word", ENTRIES);
    release(&arrays);
    if (!done)
        return NULL;
    Py_RETURN_NONE;
}
