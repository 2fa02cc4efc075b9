/* A sprite laid over a picture; see irsim/compose.py. */
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

/* lay(light, columns, alpha, emission, wide, x, y, cover, left): light (float32, of so many columns) <- light
 * (1 - alpha) + emission, a patch of `wide` columns whose top left is (x, y); left <- cover, 0 outside the picture.
 * Returned are the sums of alpha, emission, and alpha * light as it was, within the picture. */
PyObject *lay(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    if (count != 9) {
        PyErr_SetString(PyExc_TypeError, "lay takes 9 arguments");
        return NULL;
    }
    Arrays arrays = {.count = 0};
    PyObject *result = NULL;
    Py_ssize_t pixels, size, lengths[3];
    float *light = array(&arrays, given[0], "f", 1, &pixels);
    const double *alpha = light ? array(&arrays, given[2], "d", 0, &size) : NULL;
    const double *emission = alpha ? array(&arrays, given[3], "d", 0, &lengths[0]) : NULL;
    const double *cover = emission ? array(&arrays, given[7], "d", 0, &lengths[1]) : NULL;
    double *left = cover ? array(&arrays, given[8], "d", 1, &lengths[2]) : NULL;
    Py_ssize_t columns = left ? PyLong_AsSsize_t(given[1]) : 0, wide = left ? PyLong_AsSsize_t(given[4]) : 0;
    Py_ssize_t x = left ? PyLong_AsSsize_t(given[5]) : 0, y = left ? PyLong_AsSsize_t(given[6]) : 0;
    if (left == NULL || PyErr_Occurred())
        goto done;
    const Py_ssize_t far = PY_SSIZE_T_MAX / 4;
    if (columns < 1 || wide < 1 || pixels % columns || size % wide || lengths[0] != size || lengths[1] != size ||
        lengths[2] != size || x < -far || x > far || y < -far || y > far) {
        PyErr_SetString(PyExc_ValueError, "lay: its arrays do not agree");
        goto done;
    }
    Range across = within(x, wide, columns), down = within(y, size / wide, pixels / columns);
    if (across.first == across.stop)
        down = (Range){0, 0};
    Sums sums = {0.0, 0.0, 0.0};
    memset(left, 0, (size_t)size * sizeof(double));
    for (Py_ssize_t row = down.first; row < down.stop; row++) {
        Py_ssize_t place = row * wide + across.first, length = across.stop - across.first;
        lay_row(light + (y + row) * columns + x + across.first, alpha + place, emission + place, length, &sums);
        memcpy(left + place, cover + place, (size_t)length * sizeof(double));
    }
    result = Py_BuildValue("(ddd)", sums.alpha, sums.emission, sums.behind);
done:
    release(&arrays);
    return result;
}
