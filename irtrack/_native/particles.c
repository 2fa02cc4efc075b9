/* Weights of particles, resampling and motion; see irtrack/filters/particle.py, resampling.py, motion.py. */
#include "kernels.h"

KERNEL(scaled_log_weights, 4)
{
    Py_ssize_t length, logs, space;
    const double *prior = input(call, 0, "d", &length), *lw = input(call, 1, "d", &logs);
    double scale = number(call, 2), *weights = output(call, 3, "d", &space), best = -INFINITY;
    if (call->failed)
        return NULL;
    if (logs != length || space != length)
        return wrong(call, "scaled_log_weights: lengths do not agree");
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
    double *weights = output(call, 0, "d", &length);
    const double *prior = input(call, 1, "d", &priors);
    if (call->failed)
        return NULL;
    if (priors != length)
        return wrong(call, "normalise_product: lengths do not agree");
    for (Py_ssize_t i = 0; i < length; i++)
        weights[i] *= prior[i];
    double total = pairwise_sum(weights, length);
    for (Py_ssize_t i = 0; i < length; i++)
        weights[i] /= total;
    return done(call);
}

KERNEL(sorted_uniforms, 1)
{
    Py_ssize_t length;
    double *sums = output(call, 0, "d", &length);
    if (call->failed)
        return NULL;
    for (Py_ssize_t i = 1; i < length; i++)
        sums[i] += sums[i - 1];
    for (Py_ssize_t i = 0; i < length; i++)
        sums[i] /= sums[length - 1];
    return done(call);
}

KERNEL(pick, 3)
{
    Py_ssize_t length, drawn, space, at = 0;
    const double *weights = input(call, 0, "d", &length), *points = input(call, 1, "d", &drawn);
    Py_ssize_t *picked = output(call, 2, INTP, &space);
    if (call->failed)
        return NULL;
    if (length < 1 || space != drawn)
        return wrong(call, "pick: lengths do not agree");
    double total = weights[0], cumulative = weights[0];
    for (Py_ssize_t i = 1; i < length; i++)
        total += weights[i];
    for (Py_ssize_t i = 0; i < drawn; i++) {
        double mark = points[i] * total;
        while (at < length - 1 && !(cumulative > mark))
            cumulative += weights[++at];
        picked[i] = at;
    }
    return done(call);
}

KERNEL(ar2, 8)
{
    Py_ssize_t held, earlier, drawn, deviating, random, space, left;
    const double *positions = input(call, 0, "d", &held), *previous = input(call, 1, "d", &earlier);
    const Py_ssize_t *ancestors = input(call, 2, INTP, &drawn);
    double damping = number(call, 3);
    const double *deviations = input(call, 4, "d", &deviating), *normals = input(call, 5, "d", &random);
    double *moved = output(call, 6, "d", &space), *origins = output(call, 7, "d", &left);
    if (call->failed)
        return NULL;
    if (earlier != held || deviating != drawn || random != 2 * drawn || space != 2 * drawn || left != 2 * drawn)
        return wrong(call, "ar2: lengths do not agree");
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
    return done(call);
}
