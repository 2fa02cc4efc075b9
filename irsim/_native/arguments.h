/* Arguments and memory of a C kernel, for irsim and irtrack. Arrays come by the buffer protocol, so that numpy's headers
 * are not needed. */
#ifndef IRSIM_ARGUMENTS_H
#define IRSIM_ARGUMENTS_H

#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#define MOST_ARRAYS 16 /* more than any kernel takes */
#define MOST_SCRATCH 32

/* Memory until `discard`. After a failure, with an exception, all further requests give NULL. */
typedef struct {
    void *of[MOST_SCRATCH];
    int count, failed;
} Scratch;

static inline void *held_by(Scratch *held, void *room)
{
    if (room == NULL && !held->failed)
        PyErr_NoMemory();
    held->failed |= room == NULL;
    return room == NULL ? NULL : (held->of[held->count++] = room);
}

/* Memory for `count` items of `size` bytes, all zero. */
static inline void *scratch(Scratch *held, Py_ssize_t count, size_t size)
{
    const int fits = held->count < MOST_SCRATCH && !held->failed;
    return held_by(held, fits ? PyMem_Calloc((size_t)(count > 0 ? count : 1), size) : NULL);
}

/* The same, not cleared: for values that are written before they are read. */
static inline void *scratch_as_is(Scratch *held, Py_ssize_t count, size_t size)
{
    const size_t items = (size_t)(count > 0 ? count : 1);
    const int fits = items <= PY_SSIZE_T_MAX / size && held->count < MOST_SCRATCH && !held->failed;
    return held_by(held, fits ? PyMem_Malloc(items * size) : NULL);
}

static inline void discard(Scratch *held)
{
    while (held->count > 0)
        PyMem_Free(held->of[--held->count]);
}

/* Memory for about twice as many items as *room; NULL without memory, and `of` stays. */
static inline void *grown(void *of, Py_ssize_t *room, size_t size)
{
    const Py_ssize_t more = 2 * *room + 256;
    void *larger = PyMem_Realloc(of, (size_t)more * size);
    *room = larger ? more : *room;
    return larger;
}

/* One call of a kernel. `failed` is set with an exception; then the functions below return 0 or NULL. */
typedef struct {
    PyObject *const *given;
    Py_ssize_t count;
    Py_buffer views[MOST_ARRAYS];
    int arrays, failed;
    Scratch held;
} Call;

/* Defines the kernel `name` of least .. most arguments; the body follows, and returns a new reference or NULL. */
#define KERNEL_OF(name, least, most)                                                                                   \
    static PyObject *name##_body(Call *call);                                                                          \
    PyObject *name(PyObject *self, PyObject *const *given, Py_ssize_t count)                                           \
    {                                                                                                                  \
        (void)self;                                                                                                    \
        if (count < least || count > most)                                                                             \
            return PyErr_Format(PyExc_TypeError, #name " takes %d arguments, not %zd", (int)(least), count);           \
        Call call;                                                                                                     \
        call.given = given;                                                                                            \
        call.count = count;                                                                                            \
        call.arrays = call.failed = call.held.count = call.held.failed = 0;                                            \
        PyObject *result = name##_body(&call);                                                                         \
        while (call.arrays > 0)                                                                                        \
            PyBuffer_Release(&call.views[--call.arrays]);                                                              \
        discard(&call.held);                                                                                           \
        return result;                                                                                                 \
    }                                                                                                                  \
    static PyObject *name##_body(Call *call)
#define KERNEL(name, count) KERNEL_OF(name, count, count)

/* Sets a ValueError; NULL. */
static inline void *wrong(Call *call, const char *message)
{
    call->failed = 1;
    PyErr_SetString(PyExc_ValueError, message);
    return NULL;
}

/* None, or NULL after a failure. */
static inline PyObject *done(const Call *call)
{
    return call->failed || call->held.failed ? NULL : Py_NewRef(Py_None);
}

/* Argument i as a buffer; NULL with an exception. */
static inline const Py_buffer *view(Call *call, int i, int flags)
{
    Py_buffer *found = &call->views[call->arrays];
    if (call->failed || PyObject_GetBuffer(call->given[i], found, flags | PyBUF_FORMAT) < 0) {
        call->failed = 1;
        return NULL;
    }
    call->arrays++;
    return found;
}

static inline int is_of(const Py_buffer *view, const char *format)
{
    if (view->format == NULL)
        return 0;
    if (strcmp(format, "l") == 0) /* int64 is a long or a long long, whichever numpy takes first */
        return view->itemsize == 8 && (strcmp(view->format, "l") == 0 || strcmp(view->format, "q") == 0);
    return strcmp(view->format, format) == 0;
}

static inline void *array(Call *call, int i, const char *format, int flags, Py_ssize_t *length)
{
    *length = 0;
    const Py_buffer *found = view(call, i, PyBUF_C_CONTIGUOUS | flags);
    if (found == NULL)
        return NULL;
    if (!is_of(found, format)) {
        PyErr_Format(PyExc_TypeError, "an array of %s is required, not of %s", format, found->format);
        call->failed = 1;
        return NULL;
    }
    *length = found->len / found->itemsize;
    return found->buf;
}

/* Argument i as a C-contiguous array of a format ("d", "f", "l", "h", "H", "B", "?": numpy's letters), and its length. */
static inline const void *input(Call *call, int i, const char *format, Py_ssize_t *length)
{
    return array(call, i, format, 0, length);
}

/* The same of an array that is written. */
static inline void *output(Call *call, int i, const char *format, Py_ssize_t *length)
{
    return array(call, i, format, PyBUF_WRITABLE, length);
}

static inline double number(Call *call, int i)
{
    const double value = call->failed ? 0 : PyFloat_AsDouble(call->given[i]);
    call->failed |= value == -1 && PyErr_Occurred() != NULL;
    return value;
}

static inline Py_ssize_t whole(Call *call, int i)
{
    const Py_ssize_t value = call->failed ? 0 : PyNumber_AsSsize_t(call->given[i], PyExc_OverflowError);
    call->failed |= value == -1 && PyErr_Occurred() != NULL;
    return value;
}

static inline int truth(Call *call, int i)
{
    const int value = call->failed ? 0 : PyObject_IsTrue(call->given[i]);
    call->failed |= value < 0;
    return value;
}

/* Memory until the end of the call, all zero. */
static inline void *room(Call *call, Py_ssize_t count, size_t size)
{
    void *memory = call->failed ? NULL : scratch(&call->held, count, size);
    call->failed |= memory == NULL;
    return memory;
}

/* The module with all kernels; `add_constants` adds SOURCE, the digest of the compiled source that
 * irsim/_native/loading.py compares. */
#define DECLARE(name) PyObject *name(PyObject *self, PyObject *const *given, Py_ssize_t count);
#define METHOD(name) {#name, (PyCFunction)(void (*)(void))name, METH_FASTCALL, NULL},
#define MODULE(name, add_constants)                                                                                    \
    static PyMethodDef methods[] = {FOR_ALL_KERNELS(METHOD){NULL, NULL, 0, NULL}};                                     \
    static PyModuleDef_Slot slots[] = {{Py_mod_exec, (void *)add_constants}, {0, NULL}};                               \
    static PyModuleDef module = {                                                                                      \
        .m_base = PyModuleDef_HEAD_INIT, .m_name = name, .m_methods = methods, .m_slots = slots};                      \
    PyMODINIT_FUNC PyInit__kernels(void)                                                                               \
    {                                                                                                                  \
        return PyModuleDef_Init(&module);                                                                              \
    }

/* A loop marked WIDE is compiled twice, also for AVX2; the loader chooses. That takes the GNU linker and loader. */
#if defined(__x86_64__) && defined(__GNUC__) && defined(__gnu_linux__) && !defined(__clang__)
#define WIDE __attribute__((target_clones("avx2", "default")))
#else
#define WIDE
#endif

#endif
