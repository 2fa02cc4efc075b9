/* A sprite laid over a picture; see irsim/render/composite.py. */
#include "laying.h"

/* The part of 0 .. length - 1 that lies within 0 .. end - 1 when shifted by `origin`. */
typedef struct {
    Py_ssize_t first, stop;
} Range;

static Range within(Py_ssize_t origin, Py_ssize_t length, Py_ssize_t end)
{
    Range found = {origin < 0 ? -origin : 0, origin < end - length ? length : end - origin};
    return found.first < found.stop ? found : (Range){0, 0};
}

/* What the light of a patch and that of the picture behind it sum up to, where both are. */
typedef struct {
    double alpha, emission, behind;
} Sums;

static void lay_row(float *light, const double *alpha, const double *emission, Py_ssize_t count, Sums *sums)
{
    for (Py_ssize_t i = 0; i < count; i++) {
        double behind = alpha[i] * (double)light[i];
        sums->alpha += alpha[i];
        sums->emission += emission[i];
        sums->behind += behind;
        light[i] = (float)((double)light[i] + (emission[i] - behind));
    }
}

/* lay(light, columns, alpha, emission, wide, x, y): light (float32, of so many columns) <- light (1 - alpha) + emission,
 * a patch of `wide` columns whose top left is (x, y). Returned are the sums of alpha, emission, and alpha * light as it
 * was, within the picture. */
PyObject *lay(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    if (count != 7) {
        PyErr_SetString(PyExc_TypeError, "lay takes 7 arguments");
        return NULL;
    }
    Arrays arrays = {.count = 0};
    PyObject *result = NULL;
    Py_ssize_t pixels, size, lit;
    float *light = array(&arrays, given[0], "f", 1, &pixels);
    const double *alpha = light ? array(&arrays, given[2], "d", 0, &size) : NULL;
    const double *emission = alpha ? array(&arrays, given[3], "d", 0, &lit) : NULL;
    Py_ssize_t columns = emission ? PyLong_AsSsize_t(given[1]) : 0, wide = emission ? PyLong_AsSsize_t(given[4]) : 0;
    Py_ssize_t x = emission ? PyLong_AsSsize_t(given[5]) : 0, y = emission ? PyLong_AsSsize_t(given[6]) : 0;
    if (emission == NULL || PyErr_Occurred())
        goto done;
    const Py_ssize_t far = PY_SSIZE_T_MAX / 4;
    if (columns < 1 || wide < 1 || pixels % columns || size % wide || lit != size || x < -far || x > far || y < -far ||
        y > far) {
        PyErr_SetString(PyExc_ValueError, "lay: its arrays do not agree");
        goto done;
    }
    Range across = within(x, wide, columns), down = within(y, size / wide, pixels / columns);
    if (across.first == across.stop)
        down = (Range){0, 0};
    Sums sums = {0.0, 0.0, 0.0};
    for (Py_ssize_t row = down.first; row < down.stop; row++) {
        Py_ssize_t place = row * wide + across.first, length = across.stop - across.first;
        lay_row(light + (y + row) * columns + x + across.first, alpha + place, emission + place, length, &sums);
    }
    result = Py_BuildValue("(ddd)", sums.alpha, sums.emission, sums.behind);
done:
    release(&arrays);
    return result;
}
