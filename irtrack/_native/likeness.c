/* Likeness of histograms, and the weights that come of it; see irtrack/features/histogram.py, filters/particles.py. */
#include "likeness.h"

#include <math.h>

#include "irsim/_native/wide.h"
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

/* below_best(prior, score, factor, out) -> whether anything is left: out = factor min(score - best, 0), the best being
 * that of a prior above 0. False, with nothing written, where there is none, or it is -inf. */
PyObject *below_best(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    if (count != 4) {
        PyErr_SetString(PyExc_TypeError, "below_best takes 4 arguments");
        return NULL;
    }
    PyObject *result = NULL;
    Py_ssize_t length, scores, room;
    const double *prior = array(&arrays, given[0], "d", 0, &length);
    const double *score = prior ? array(&arrays, given[1], "d", 0, &scores) : NULL;
    double *out = score ? array(&arrays, given[3], "d", 1, &room) : NULL;
    double factor = out ? PyFloat_AsDouble(given[2]) : 0;
    if (out == NULL || PyErr_Occurred())
        goto done;
    if (scores != length || room != length) {
        wrong("below_best: lengths do not agree");
        goto done;
    }
    double best = -INFINITY;
    for (Py_ssize_t i = 0; i < length; i++)
        if (prior[i] > 0)
            best = score[i] > best || isnan(score[i]) ? score[i] : best;
    if (best == -INFINITY) {
        result = Py_NewRef(Py_False);
        goto done;
    }
    for (Py_ssize_t i = 0; i < length; i++) {
        double below = score[i] - best;
        out[i] = factor * (below > 0 ? 0 : below);
    }
    result = Py_NewRef(Py_True);
done:
    release(&arrays);
    return result;
}

/* weighted(weights, prior): weights times prior, over their sum, in place. */
PyObject *weighted(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    if (count != 2) {
        PyErr_SetString(PyExc_TypeError, "weighted takes 2 arguments");
        return NULL;
    }
    PyObject *result = NULL;
    Py_ssize_t length, priors;
    double *weights = array(&arrays, given[0], "d", 1, &length);
    const double *prior = weights ? array(&arrays, given[1], "d", 0, &priors) : NULL;
    if (prior == NULL)
        goto done;
    if (priors != length) {
        wrong("weighted: lengths do not agree");
        goto done;
    }
    for (Py_ssize_t i = 0; i < length; i++)
        weights[i] *= prior[i];
    double total = pairwise_sum(weights, length);
    for (Py_ssize_t i = 0; i < length; i++)
        weights[i] /= total;
    result = Py_NewRef(Py_None);
done:
    release(&arrays);
    return result;
}
