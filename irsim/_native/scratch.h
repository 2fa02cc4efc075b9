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

static inline void *held_by(Scratch *held, void *room)
{
    if (room == NULL) {
        PyErr_NoMemory();
        return NULL;
    }
    held->of[held->count++] = room;
    return room;
}

/* Room for `count` things of `size` bytes, all zero; NULL with an exception where there is none. */
static inline void *scratch(Scratch *held, Py_ssize_t count, size_t size)
{
    const size_t things = (size_t)(count > 0 ? count : 1);
    return held_by(held, held->count < MOST_SCRATCH ? PyMem_Calloc(things, size) : NULL);
}

/* The same, with whatever was in it: for what is written before it is read. */
static inline void *scratch_as_is(Scratch *held, Py_ssize_t count, size_t size)
{
    const size_t things = (size_t)(count > 0 ? count : 1);
    const int fits = things <= PY_SSIZE_T_MAX / size && held->count < MOST_SCRATCH;
    return held_by(held, fits ? PyMem_Malloc(things * size) : NULL);
}

static inline void discard(Scratch *held)
{
    while (held->count > 0)
        PyMem_Free(held->of[--held->count]);
}

#endif
