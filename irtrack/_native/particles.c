/* Particles drawn and moved; see irtrack/filters/resampling.py, motion.py. */
#include "particles.h"

/* sorted_uniforms(exponentials): running sums over their total, in place. */
PyObject *sorted_uniforms(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    if (count != 1) {
        PyErr_SetString(PyExc_TypeError, "sorted_uniforms takes 1 argument");
        return NULL;
    }
    Py_ssize_t length;
    double *sums = array(&arrays, given[0], "d", 1, &length);
    if (sums == NULL) {
        release(&arrays);
        return NULL;
    }
    for (Py_ssize_t i = 1; i < length; i++)
        sums[i] += sums[i - 1];
    for (Py_ssize_t i = 0; i < length; i++)
        sums[i] /= sums[length - 1];
    release(&arrays);
    return Py_NewRef(Py_None);
}

/* pick(weights, points, picked): for ascending points in [0, 1), the smallest index whose cumulative weight exceeds
 * the point's share of all; the last where none does. */
PyObject *pick(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    if (count != 3) {
        PyErr_SetString(PyExc_TypeError, "pick takes 3 arguments");
        return NULL;
    }
    PyObject *result = NULL;
    Py_ssize_t length, drawn, room;
    const double *weights = array(&arrays, given[0], "d", 0, &length);
    const double *points = weights ? array(&arrays, given[1], "d", 0, &drawn) : NULL;
    Py_ssize_t *picked = points ? array(&arrays, given[2], INTP, 1, &room) : NULL;
    if (picked == NULL)
        goto done;
    if (length < 1 || room != drawn) {
        wrong("pick: lengths do not agree");
        goto done;
    }
    double total = weights[0];
    for (Py_ssize_t i = 1; i < length; i++)
        total += weights[i];
    Py_ssize_t at = 0;
    double cumulative = weights[0];
    for (Py_ssize_t i = 0; i < drawn; i++) {
        double mark = points[i] * total;
        while (at < length - 1 && !(cumulative > mark))
            cumulative += weights[++at];
        picked[i] = at;
    }
    result = Py_NewRef(Py_None);
done:
    release(&arrays);
    return result;
}

/* ar2_drawn(positions, previous, chosen, damping, deviations, normals, moved, origins)
 *
 * For particles `chosen` (n,) of positions and previous ones (N, 2): where they were, `origins` (n, 2), and where
 * they move by damping times their last displacement and noise (n, 2) of their deviations (n,). */
PyObject *ar2_drawn(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    if (count != 8) {
        PyErr_SetString(PyExc_TypeError, "ar2_drawn takes 8 arguments");
        return NULL;
    }
    PyObject *result = NULL;
    Py_ssize_t held, earlier, drawn, deviating, random, room, left;
    const double *positions = array(&arrays, given[0], "d", 0, &held);
    const double *previous = positions ? array(&arrays, given[1], "d", 0, &earlier) : NULL;
    const Py_ssize_t *chosen = previous ? array(&arrays, given[2], INTP, 0, &drawn) : NULL;
    const double *deviations = chosen ? array(&arrays, given[4], "d", 0, &deviating) : NULL;
    const double *normals = deviations ? array(&arrays, given[5], "d", 0, &random) : NULL;
    double *moved = normals ? array(&arrays, given[6], "d", 1, &room) : NULL;
    double *origins = moved ? array(&arrays, given[7], "d", 1, &left) : NULL;
    double damping = origins ? PyFloat_AsDouble(given[3]) : 0;
    if (origins == NULL || PyErr_Occurred())
        goto done;
    if (earlier != held || deviating != drawn || random != 2 * drawn || room != 2 * drawn || left != 2 * drawn) {
        wrong("ar2_drawn: lengths do not agree");
        goto done;
    }
    for (Py_ssize_t i = 0; i < drawn; i++) {
        Py_ssize_t from = chosen[i];
        if (from < 0 || from >= held / 2) {
            PyErr_SetString(PyExc_IndexError, "ar2_drawn: no such particle");
            goto done;
        }
        for (int axis = 0; axis < 2; axis++) {
            double now = positions[2 * from + axis], before = previous[2 * from + axis];
            origins[2 * i + axis] = now;
            moved[2 * i + axis] = now + damping * (now - before) + deviations[i] * normals[2 * i + axis];
        }
    }
    result = Py_NewRef(Py_None);
done:
    release(&arrays);
    return result;
}
