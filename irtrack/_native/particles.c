/* Weights of particles, resampling and motion; see irtrack/filters/particle.py, resampling.py, motion.py. */
#include "kernels.h"

KERNEL(scaled_log_weights, 4)
{
    Py_ssize_t length, logs, space;
    const double *prior = in(call, 0, "d", &length), *lw = in(call, 1, "d", &logs);
    double scale = number(call, 2), *weights = out(call, 3, "d", &space), best = -INFINITY;
    if (call->failed)
        return NULL;
    if (logs != length || space != length)
        return wrong("scaled_log_weights: lengths do not agree");
    for (Py_ssize_t i = 0; i < length; i++)
        if (prior[i] > 0)
            best = lw[i] > best || isnan(lw[i]) ? lw[i] : best;
    if (best == -INFINITY)
        return Py_NewRef(Py_False);
    for (Py_ssize_t i = 0; i < length; i++) {
        double below = lw[i] - best;
        weights[i] = scale * (below > 0 ? 0 : below);
    }
    return Py_NewRef(Py_True);
}

KERNEL(normalise_product, 2)
{
    Py_ssize_t length, priors;
    double *weights = out(call, 0, "d", &length);
    const double *prior = in(call, 1, "d", &priors);
    if (call->failed)
        return NULL;
    if (priors != length)
        return wrong("normalise_product: lengths do not agree");
    for (Py_ssize_t i = 0; i < length; i++)
        weights[i] *= prior[i];
    double total = pairwise_sum(weights, length);
    for (Py_ssize_t i = 0; i < length; i++)
        weights[i] /= total;
    return Py_NewRef(Py_None);
}

KERNEL(sorted_uniforms, 1)
{
    Py_ssize_t length;
    double *sums = out(call, 0, "d", &length);
    if (call->failed)
        return NULL;
    for (Py_ssize_t i = 1; i < length; i++)
        sums[i] += sums[i - 1];
    for (Py_ssize_t i = 0; i < length; i++)
        sums[i] /= sums[length - 1];
    return Py_NewRef(Py_None);
}

KERNEL(pick, 3)
{
    Py_ssize_t length, drawn, space, at = 0;
    const double *weights = in(call, 0, "d", &length), *points = in(call, 1, "d", &drawn);
    Py_ssize_t *picked = out(call, 2, INTP, &space);
    if (call->failed)
        return NULL;
    if (length < 1 || space != drawn)
        return wrong("pick: lengths do not agree");
    double total = weights[0], cumulative = weights[0];
    for (Py_ssize_t i = 1; i < length; i++)
        total += weights[i];
    for (Py_ssize_t i = 0; i < drawn; i++) {
        double mark = points[i] * total;
        while (at < length - 1 && !(cumulative > mark))
            cumulative += weights[++at];
        picked[i] = at;
    }
    return Py_NewRef(Py_None);
}

KERNEL(ar2, 8)
{
    Py_ssize_t held, earlier, drawn, deviating, random, space, left;
    const double *positions = in(call, 0, "d", &held), *previous = in(call, 1, "d", &earlier);
    const Py_ssize_t *ancestors = in(call, 2, INTP, &drawn);
    double damping = number(call, 3);
    const double *deviations = in(call, 4, "d", &deviating), *normals = in(call, 5, "d", &random);
    double *moved = out(call, 6, "d", &space), *origins = out(call, 7, "d", &left);
    if (call->failed)
        return NULL;
    if (earlier != held || deviating != drawn || random != 2 * drawn || space != 2 * drawn || left != 2 * drawn)
        return wrong("ar2: lengths do not agree");
    for (Py_ssize_t i = 0; i < drawn; i++) {
        Py_ssize_t from = ancestors[i];
        if (from < 0 || from >= held / 2)
            return PyErr_Format(PyExc_IndexError, "ar2: no such particle");
        for (int axis = 0; axis < 2; axis++) {
            double now = positions[2 * from + axis], before = previous[2 * from + axis];
            origins[2 * i + axis] = now;
            moved[2 * i + axis] = now + damping * (now - before) + deviations[i] * normals[2 * i + axis];
        }
    }
    return Py_NewRef(Py_None);
}
