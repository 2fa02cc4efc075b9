/* Arguments of a C kernel, read by the buffer protocol, so that numpy's headers are not needed. Used by irtrack, too. */
#ifndef IRSIM_ARGUMENTS_H
#define IRSIM_ARGUMENTS_H

#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <stdint.h>
#include <string.h>

#define MOST_ARRAYS 16

/* The arrays of one call; all are given back by `release`. */
typedef struct {
    Py_buffer of[MOST_ARRAYS];
    int count;
} Arrays;

static inline void release(Arrays *arrays)
{
    while (arrays->count > 0)
        PyBuffer_Release(&arrays->of[--arrays->count]);
}

static inline int is_of(const Py_buffer *view, const char *format)
{
    if (view->format == NULL)
        return 0;
    if (strcmp(format, "l") == 0) /* int64 is a long or a long long, whichever numpy takes first */
        return view->itemsize == 8 && (strcmp(view->format, "l") == 0 || strcmp(view->format, "q") == 0);
    return strcmp(view->format, format) == 0;
}

/* The data of a C-contiguous array with elements of `format` ("d", "f", "l", "h", "H", "B", "?": numpy's letters), NULL with an
 * exception where it is none; `length` takes the number of its elements. */
static inline void *array(Arrays *arrays, PyObject *given, const char *format, int writable, Py_ssize_t *length)
{
    if (arrays->count == MOST_ARRAYS) {
        PyErr_Format(PyExc_TypeError, "more than %d arrays", MOST_ARRAYS);
        return NULL;
    }
    Py_buffer *view = &arrays->of[arrays->count];
    int flags = PyBUF_C_CONTIGUOUS | PyBUF_FORMAT | (writable ? PyBUF_WRITABLE : 0);
    if (PyObject_GetBuffer(given, view, flags) < 0)
        return NULL;
    arrays->count++;
    if (!is_of(view, format)) {
        PyErr_Format(PyExc_TypeError, "an array of %s is wanted, not of %s", format,
                     view->format ? view->format : "bytes");
        return NULL;
    }
    if (length)
        *length = view->len / view->itemsize;
    return view->buf;
}

/* A loop marked WIDE is compiled twice, also for AVX2; the loader chooses. That takes the GNU linker and loader. */
#if defined(__x86_64__) && defined(__GNUC__) && defined(__gnu_linux__) && !defined(__clang__)
#define WIDE __attribute__((target_clones("avx2", "default")))
#else
#define WIDE
#endif

#endif
