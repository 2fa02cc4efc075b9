/* What a detector does of a frame but noise, in one pass each; see irsim/detector/response.py, drift.py and sensor.py.
 * Rounded as by OpenCV. */
#include <stdint.h>

#include "fused.h"
#include "response.h"

/* `out` may be the light itself. */
INLINED void answer(const float *light, float *out, Py_ssize_t length, float linear, float root, float zero, int fused)
{
    EACH_ALONE
    for (Py_ssize_t i = 0; i < length; i++) {
        float lit = light[i] < 0.0f ? 0.0f : light[i]; /* below 0 by rounding alone */
        out[i] = plus(plus(zero, sqrtf(lit), root, fused), lit, linear, fused);
    }
}

FUSING static void answer_fused(const float *light, float *out, Py_ssize_t length, float linear, float root, float zero)
{
    answer(light, out, length, linear, root, zero, 1);
}

FUSING_WIDELY static void answer_widely(const float *light, float *out, Py_ssize_t length, float linear, float root,
                                        float zero)
{
    answer(light, out, length, linear, root, zero, 1);
}

static void answer_twice(const float *light, float *out, Py_ssize_t length, float linear, float root, float zero)
{
    answer(light, out, length, linear, root, zero, 0);
}

INLINED void digitise(const float *restrict signal, uint16_t *restrict out, Py_ssize_t length, float scale,
                      float offset, float full, int fused)
{
    for (Py_ssize_t i = 0; i < length; i++) {
        float count = plus(offset, signal[i], scale, fused);
        count = count > 0.0f ? count : 0.0f; /* nan, too */
        count = count < full ? count : full;
        out[i] = (uint16_t)(int32_t)rintf(count);
    }
}

FUSING static void digitise_fused(const float *signal, uint16_t *out, Py_ssize_t length, float scale, float offset,
                                  float full)
{
    digitise(signal, out, length, scale, offset, full, 1);
}

static void digitise_twice(const float *signal, uint16_t *out, Py_ssize_t length, float scale, float offset, float full)
{
    digitise(signal, out, length, scale, offset, full, 0);
}

/* Reads the source, where to, and three numbers: 0, or -1 with an exception. */
static int passed_on(Arrays *arrays, PyObject *const *given, Py_ssize_t count, const char *format, const float **from,
                     void **to, Py_ssize_t *length, float *numbers)
{
    Py_ssize_t wanted;
    if (count != 5) {
        PyErr_Format(PyExc_TypeError, "5 arguments are wanted, not %zd", count);
        return -1;
    }
    if ((*from = array(arrays, given[0], "f", 0, length)) == NULL ||
        (*to = array(arrays, given[1], format, 1, &wanted)) == NULL)
        return -1;
    if (wanted != *length) {
        PyErr_SetString(PyExc_ValueError, "arrays of one length are wanted");
        return -1;
    }
    for (int i = 0; i < 3; i++) {
        numbers[i] = (float)PyFloat_AsDouble(given[2 + i]);
        if (PyErr_Occurred())
            return -1;
    }
    return 0;
}

INLINED void enlarge(float *restrict signal, const float *restrict share, Py_ssize_t length, int fused)
{
    for (Py_ssize_t i = 0; i < length; i++)
        signal[i] = plus(signal[i], signal[i], share[i], fused);
}

FUSING static void enlarge_fused(float *signal, const float *share, Py_ssize_t length)
{
    enlarge(signal, share, length, 1);
}

static void enlarge_twice(float *signal, const float *share, Py_ssize_t length)
{
    enlarge(signal, share, length, 0);
}

/* add_share(signal, share) */
PyObject *add_share(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    Py_ssize_t length, shares;
    if (count != 2)
        return PyErr_Format(PyExc_TypeError, "add_share takes 2 arguments, not %zd", count);
    float *signal = array(&arrays, given[0], "f", 1, &length);
    const float *share = signal ? array(&arrays, given[1], "f", 0, &shares) : NULL;
    int done = share != NULL && shares == length;
    if (done)
        (fuses() ? enlarge_fused : enlarge_twice)(signal, share, length);
    else if (share != NULL)
        PyErr_SetString(PyExc_ValueError, "a share for each pixel is wanted");
    release(&arrays);
    if (!done)
        return NULL;
    Py_RETURN_NONE;
}

/* hold(signal, well) */
PyObject *hold(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    Py_ssize_t length;
    if (count != 2)
        return PyErr_Format(PyExc_TypeError, "hold takes 2 arguments, not %zd", count);
    const float well = (float)PyFloat_AsDouble(given[1]);
    float *signal = PyErr_Occurred() ? NULL : array(&arrays, given[0], "f", 1, &length);
    if (signal != NULL)
        for (Py_ssize_t i = 0; i < length; i++)
            signal[i] = signal[i] > well ? well : signal[i];
    release(&arrays);
    if (signal == NULL)
        return NULL;
    Py_RETURN_NONE;
}

/* signal_of(light, out, linear, root, zero) */
PyObject *signal_of(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    const float *light;
    void *out;
    Py_ssize_t length;
    float numbers[3];
    int done = passed_on(&arrays, given, count, "f", &light, &out, &length, numbers) == 0;
    if (done) {
        void (*const pass)(const float *, float *, Py_ssize_t, float, float, float) =
            fuses_widely() ? answer_widely : fuses() ? answer_fused : answer_twice;
        pass(light, out, length, numbers[0], numbers[1], numbers[2]);
    }
    release(&arrays);
    if (!done)
        return NULL;
    Py_RETURN_NONE;
}

/* counts_of(signal, out, scale, offset, full) */
PyObject *counts_of(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    const float *signal;
    void *out;
    Py_ssize_t length;
    float numbers[3];
    int done = passed_on(&arrays, given, count, "H", &signal, &out, &length, numbers) == 0;
    if (done && !(numbers[2] >= 0.0f && numbers[2] <= UINT16_MAX)) {
        PyErr_SetString(PyExc_ValueError, "counts of 16 bits are made");
        done = 0;
    }
    if (done)
        (fuses() ? digitise_fused : digitise_twice)(signal, out, length, numbers[0], numbers[1], numbers[2]);
    release(&arrays);
    if (!done)
        return NULL;
    Py_RETURN_NONE;
}
