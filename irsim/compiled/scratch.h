/* Memory of one call: all of it is given back by `discard`. */
#ifndef IRSIM_SCRATCH_H
#define IRSIM_SCRATCH_H

#define PY_SSIZE_T_CLEAN
#include <Python.h>

#define MOST_SCRATCH 32

typedef struct {
    void *of[MOST_SCRATCH];
    int count;
} Scratch;

/* Room for `count` things of `size` bytes, all zero; NULL with an exception where there is none. */
static inline void *scratch(Scratch *held, Py_ssize_t count, size_t size)
{
    void *room = held->count < MOST_SCRATCH ? PyMem_Calloc((size_t)(count > 0 ? count : 1), size) : NULL;
    if (room == NULL) {
        PyErr_NoMemory();
        return NULL;
    }
    held->of[held->count++] = room;
    return room;
}

static inline void discard(Scratch *held)
{
    while (held->count > 0)
        PyMem_Free(held->of[--held->count]);
}

#endif
