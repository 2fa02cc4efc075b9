/* Velocities from last places; see irtrack/features/trajectory.py. */
#include "kernels.h"

/* Velocity along the principal axis of k places, k - 1 old ones and the last. */
static void pca_velocity(const double *old, const double last[2], Py_ssize_t k, int root, double velocity[2])
{
    double mean_x = 0, mean_y = 0, xx = 0, xy = 0, yy = 0;
    for (Py_ssize_t i = 0; i < k; i++) {
        const double *place = i < k - 1 ? old + 2 * i : last;
        mean_x += place[0];
        mean_y += place[1];
    }
    mean_x /= (double)k;
    mean_y /= (double)k;
    for (Py_ssize_t i = 0; i < k; i++) {
        const double *place = i < k - 1 ? old + 2 * i : last;
        double x = place[0] - mean_x, y = place[1] - mean_y;
        xx += x * x;
        xy += x * y;
        yy += y * y;
    }
    xx /= (double)k;
    xy /= (double)k;
    yy /= (double)k;
    double half = (xx - yy) / 2, largest = (xx + yy) / 2 + hypot(half, xy), angle = atan2(xy, half) / 2;
    double axis[2] = {cos(angle), sin(angle)}, length = root ? sqrt(largest) : largest;
    if (!((last[0] - old[0]) * axis[0] + (last[1] - old[1]) * axis[1] >= 0))
        length = -length;
    velocity[0] = length * axis[0];
    velocity[1] = length * axis[1];
}

KERNEL(trajectory_similarity, 4)
{
    Py_ssize_t known, length, space;
    const double *trajectory = input(call, 0, "d", &known), *places = input(call, 1, "d", &length);
    double *similarity = output(call, 3, "d", &space), model[2], own[2];
    const int root = truth(call, 2);
    if (call->failed)
        return NULL;
    Py_ssize_t k = known / 2;
    if (k < 2 || known != 2 * k || length != 2 * space)
        return wrong(call, "trajectory_similarity: lengths do not agree");
    pca_velocity(trajectory, trajectory + 2 * (k - 1), k, root, model);
    double pace = hypot(model[0], model[1]);
    for (Py_ssize_t i = 0; i < space; i++) {
        pca_velocity(trajectory + 2, places + 2 * i, k, root, own);
        double speed = hypot(own[0], own[1]), larger = speed > pace || isnan(speed) ? speed : pace;
        /* min / max . cosine = dot / max^2, which needs no division by a speed of 0; two at rest have 1. */
        double dot = own[0] * model[0] + own[1] * model[1];
        double ratio = larger > 0 ? dot / (larger * larger) : isnan(larger) ? larger : 1;
        similarity[i] = ratio < 0 ? 0 : ratio > 1 ? 1 : ratio;
    }
    return done(call);
}

KERNEL(line_fit, 3)
{
    Py_ssize_t known, two, too;
    const double *places = input(call, 0, "d", &known);
    double *ahead = output(call, 1, "d", &two), *velocity = output(call, 2, "d", &too);
    if (call->failed)
        return NULL;
    Py_ssize_t k = known / 2;
    if (k < 1 || known != 2 * k || two != 2 || too != 2)
        return wrong(call, "line_fit: lengths do not agree");
    double n = (double)k;
    for (int axis = 0; axis < 2; axis++) {
        double sum = 0, slope = 0;
        for (Py_ssize_t i = 0; i < k; i++) {
            sum += places[2 * i + axis];
            slope += ((double)i - (n - 1) / 2) * places[2 * i + axis];
        }
        velocity[axis] = k == 1 ? 0 : 12 / (n * (n * n - 1)) * slope;
        ahead[axis] = sum / n + (n + 1) / 2 * velocity[axis];
    }
    return done(call);
}
