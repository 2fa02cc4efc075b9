/* Arguments of the C kernels, sums in numpy's order, and the list of kernels. */
#ifndef IRTRACK_KERNELS_H
#define IRTRACK_KERNELS_H

#include <float.h>
#include <math.h>
#include <stdint.h>

#include "irsim/_native/arguments.h"

/* numpy's letter for intp, an int64 on all supported platforms. */
#define INTP "l"
/* Pixel of a place outside the image. */
#define OUTSIDE (-1)
/* Largest side of an image or a window: products of two do not overflow. */
#define MOST_PIXELS ((Py_ssize_t)1 << 24)
#define MOST_ROOMS 4

/* One call of a kernel: its arguments, the arrays and the memory to be released at its end. */
typedef struct {
    Arrays arrays;
    PyObject *const *given;
    void *rooms[MOST_ROOMS];
    int held, failed;
} Call;

/* Defines the function `name` of `number` arguments; the body follows, and returns a new reference or NULL. */
#define KERNEL(name, number)                                                                                           \
    static PyObject *name##_body(Call *call);                                                                          \
    PyObject *name(PyObject *self, PyObject *const *given, Py_ssize_t count)                                           \
    {                                                                                                                  \
        (void)self;                                                                                                    \
        if (count != number)                                                                                           \
            return PyErr_Format(PyExc_TypeError, #name " takes " #number " arguments");                                \
        Call call;                                                                                                     \
        call.arrays.count = call.held = call.failed = 0;                                                               \
        call.given = given;                                                                                            \
        PyObject *result = name##_body(&call);                                                                         \
        release(&call.arrays);                                                                                         \
        while (call.held > 0)                                                                                          \
            PyMem_Free(call.rooms[--call.held]);                                                                       \
        return result;                                                                                                 \
    }                                                                                                                  \
    static PyObject *name##_body(Call *call)

/* Sets a ValueError; NULL. */
static inline void *wrong(const char *message)
{
    PyErr_SetString(PyExc_ValueError, message);
    return NULL;
}

static inline void *taken(Call *call, int i, const char *format, int writable, Py_ssize_t *length)
{
    *length = 0;
    void *data = call->failed ? NULL : array(&call->arrays, call->given[i], format, writable, length);
    call->failed |= data == NULL;
    return data;
}

/* Argument i as an array of a format and its length; NULL with an exception, and call->failed, where it is none. */
static inline const void *in(Call *call, int i, const char *format, Py_ssize_t *length)
{
    return taken(call, i, format, 0, length);
}

/* The same of an array that is written. */
static inline void *out(Call *call, int i, const char *format, Py_ssize_t *length)
{
    return taken(call, i, format, 1, length);
}

/* Argument i as a number. */
static inline double number(Call *call, int i)
{
    double value = call->failed ? 0 : PyFloat_AsDouble(call->given[i]);
    call->failed |= value == -1 && PyErr_Occurred() != NULL;
    return value;
}

static inline Py_ssize_t whole(Call *call, int i)
{
    Py_ssize_t value = call->failed ? 0 : PyNumber_AsSsize_t(call->given[i], NULL);
    call->failed |= value == -1 && PyErr_Occurred() != NULL;
    return value;
}

/* View of the array that was taken last. */
static inline const Py_buffer *last(const Call *call)
{
    return &call->arrays.of[call->arrays.count - 1];
}

/* Memory until the end of the call; NULL with an exception, and call->failed, where there is none. */
static inline void *room(Call *call, Py_ssize_t count, size_t size)
{
    void *memory = call->failed ? NULL : PyMem_Calloc((size_t)count, size);
    if (memory == NULL) {
        call->failed = 1;
        return PyErr_Occurred() ? NULL : PyErr_NoMemory();
    }
    return call->rooms[call->held++] = memory;
}

/* Image of one or two bytes a pixel, row after row; `table` gives the bin of each level. */
typedef struct {
    const void *levels;
    Py_ssize_t rows, columns, bytes;
    const uint16_t *table;
} Picture;

/* Argument i as an image (rows, columns) of uint8 or uint16. */
static inline Picture image(Call *call, int i)
{
    Picture picture = {NULL, 0, 0, 1, NULL};
    Py_buffer *view = &call->arrays.of[call->arrays.count];
    if (call->failed || PyObject_GetBuffer(call->given[i], view, PyBUF_C_CONTIGUOUS | PyBUF_FORMAT) < 0) {
        call->failed = 1;
        return picture;
    }
    call->arrays.count++;
    if (view->ndim != 2 || view->format == NULL || (strcmp(view->format, "B") != 0 && strcmp(view->format, "H") != 0)) {
        call->failed = 1;
        wrong("a picture of uint8 or uint16 is required");
        return picture;
    }
    Picture taken_ = {view->buf, view->shape[0], view->shape[1], view->itemsize, NULL};
    return taken_;
}

/* Arguments i and i + 1 as an image and the table of its bins, uint16. */
static inline Picture binned_image(Call *call, int i)
{
    Py_ssize_t bins;
    Picture picture = image(call, i);
    picture.table = in(call, i + 1, "H", &bins);
    if (!call->failed && bins < (Py_ssize_t)1 << (8 * picture.bytes)) {
        call->failed = 1;
        wrong("a bin for each level is required");
    }
    return picture;
}

static inline uint16_t level_at(const Picture *picture, Py_ssize_t at)
{
    return picture->bytes == 1 ? ((const uint8_t *)picture->levels)[at] : ((const uint16_t *)picture->levels)[at];
}

static inline uint16_t bin_at(const Picture *picture, Py_ssize_t row, Py_ssize_t column)
{
    return picture->table[level_at(picture, row * picture->columns + column)];
}

/* Sum of a block of at most 128 doubles in the order of np.sum: eight partial sums. */
static inline double block_sum(const double *terms, Py_ssize_t count)
{
    if (count < 8) {
        double sum = 0;
        for (Py_ssize_t i = 0; i < count; i++)
            sum += terms[i];
        return sum;
    }
    double of[8];
    Py_ssize_t i;
    for (int j = 0; j < 8; j++)
        of[j] = terms[j];
    for (i = 8; i < count - count % 8; i += 8)
        for (int j = 0; j < 8; j++)
            of[j] += terms[i + j];
    double sum = ((of[0] + of[1]) + (of[2] + of[3])) + ((of[4] + of[5]) + (of[6] + of[7]));
    for (; i < count; i++)
        sum += terms[i];
    return sum;
}

/* Sum of contiguous doubles, pairwise as in np.sum. */
static inline double pairwise_sum(const double *terms, Py_ssize_t count)
{
    if (count <= 128)
        return block_sum(terms, count);
    Py_ssize_t half = count / 2;
    half -= half % 8;
    return pairwise_sum(terms, half) + pairwise_sum(terms + half, count - half);
}

/* Divides a histogram by its sum, and returns the sum; an empty one stays zero. */
static inline double normalise(double *mass, Py_ssize_t bins)
{
    double sum = pairwise_sum(mass, bins), divisor = sum > DBL_MIN ? sum : DBL_MIN;
    for (Py_ssize_t u = 0; u < bins; u++)
        mass[u] /= divisor;
    return sum;
}

#define FOR_ALL_KERNELS(X)                                                                                             \
    X(distinct_windows) X(window_histograms) X(bhattacharyya) X(window_gradients) X(window_cues) X(high_pass) X(pick)  \
    X(scaled_log_weights) X(normalise_product) X(sorted_uniforms) X(ar2) X(trajectory_similarity) X(line_fit) X(mean_shift)  \
    X(patch_contrast) X(local_contrast)
#define DECLARE(name) PyObject *name(PyObject *self, PyObject *const *given, Py_ssize_t count);
FOR_ALL_KERNELS(DECLARE)
#endif
