/* Likeness of histograms, and the weights that come of it; see irtrack/features/histogram.py, trackers/grey.py. */
#include "likeness.h"

#include <math.h>

#include "irsim/compiled/wide.h"
#include "sums.h"

/* rho[i] = sum_u sqrt(p[i, u]) root[u], at most 1; four sums share the bins. */
WIDE static void coefficients(const double *p, Py_ssize_t held, const double *root, Py_ssize_t bins, double *rho,
                              Py_ssize_t count)
{
    for (Py_ssize_t i = 0; i < count; i++, p += held) {
        double of[4] = {0, 0, 0, 0};
        Py_ssize_t u = 0;
        for (; u + 4 <= bins; u += 4)
            for (int j = 0; j < 4; j++)
                of[j] += sqrt(p[u + j]) * root[u + j];
        double sum = (of[0] + of[1]) + (of[2] + of[3]);
        for (; u < bins; u++)
            sum += sqrt(p[u]) * root[u];
        rho[i] = sum > 1 ? 1 : sum;
    }
}

/* bhattacharyya(p, q, rho): rho (N,) of histograms p (N, bins or more) to one, q (bins,). */
PyObject *bhattacharyya(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    if (count != 3) {
        PyErr_SetString(PyExc_TypeError, "bhattacharyya takes 3 arguments");
        return NULL;
    }
    PyObject *result = NULL;
    double *root = NULL;
    Py_ssize_t size, bins, rows;
    const double *p = array(&arrays, given[0], "d", 0, &size);
    const double *q = p ? array(&arrays, given[1], "d", 0, &bins) : NULL;
    double *rho = q ? array(&arrays, given[2], "d", 1, &rows) : NULL;
    if (rho == NULL)
        goto done;
    Py_ssize_t held = rows > 0 ? size / rows : bins;
    if (held * rows != size || held < bins) {
        wrong("bhattacharyya: a mismatch, fewer bins than the reference");
        goto done;
    }
    root = PyMem_Malloc((size_t)bins * sizeof *root);
    if (root == NULL) {
        PyErr_NoMemory();
        goto done;
    }
    for (Py_ssize_t u = 0; u < bins; u++)
        root[u] = sqrt(q[u]);
    coefficients(p, held, root, bins, rho, rows);
    result = Py_NewRef(Py_None);
done:
    PyMem_Free(root);
    release(&arrays);
    return result;
}

/* below_largest(rho, factor, out): out = factor (rho - max rho). */
PyObject *below_largest(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    if (count != 3) {
        PyErr_SetString(PyExc_TypeError, "below_largest takes 3 arguments");
        return NULL;
    }
    PyObject *result = NULL;
    Py_ssize_t length, room;
    const double *rho = array(&arrays, given[0], "d", 0, &length);
    double *out = rho ? array(&arrays, given[2], "d", 1, &room) : NULL;
    double factor = out ? PyFloat_AsDouble(given[1]) : 0;
    if (out == NULL || PyErr_Occurred())
        goto done;
    if (length < 1 || room != length) {
        wrong("below_largest: lengths do not agree");
        goto done;
    }
    double largest = rho[0];
    for (Py_ssize_t i = 1; i < length; i++)
        largest = rho[i] > largest || isnan(rho[i]) ? rho[i] : largest;
    for (Py_ssize_t i = 0; i < length; i++)
        out[i] = factor * (rho[i] - largest);
    result = Py_NewRef(Py_None);
done:
    release(&arrays);
    return result;
}

/* normalise(weights, visible) -> whether anything is in view: weights of what is not become 0, the others sum to one;
 * of nothing, all are equal. */
PyObject *normalise(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    if (count != 2) {
        PyErr_SetString(PyExc_TypeError, "normalise takes 2 arguments");
        return NULL;
    }
    PyObject *result = NULL;
    Py_ssize_t length, seen;
    double *weights = array(&arrays, given[0], "d", 1, &length);
    const double *visible = weights ? array(&arrays, given[1], "d", 0, &seen) : NULL;
    if (visible == NULL)
        goto done;
    if (seen != length) {
        wrong("normalise: lengths do not agree");
        goto done;
    }
    for (Py_ssize_t i = 0; i < length; i++)
        weights[i] *= visible[i] > 0;
    double total = pairwise_sum(weights, length);
    for (Py_ssize_t i = 0; i < length; i++)
        weights[i] = total == 0 ? 1 / (double)length : weights[i] / total;
    result = Py_NewRef(total == 0 ? Py_False : Py_True);
done:
    release(&arrays);
    return result;
}
