/* Velocities out of last places; see irtrack/features/velocity.py. */
#include "velocity.h"

#include <math.h>

/* Velocity along the principal axis of `k` places: of `k` - 1 old ones and a last one. */
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

/* velocity_likeness(trajectory, places, root, out): likeness (N,) of the velocity that each of the places (N, 2) would
 * give the trajectory (k, 2) in the next frame, to the one that it has. */
PyObject *velocity_likeness(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    if (count != 4) {
        PyErr_SetString(PyExc_TypeError, "velocity_likeness takes 4 arguments");
        return NULL;
    }
    PyObject *result = NULL;
    Py_ssize_t known, length, room;
    const double *trajectory = array(&arrays, given[0], "d", 0, &known);
    const double *places = trajectory ? array(&arrays, given[1], "d", 0, &length) : NULL;
    double *out = places ? array(&arrays, given[3], "d", 1, &room) : NULL;
    int root = out ? PyObject_IsTrue(given[2]) : -1;
    if (root < 0)
        goto done;
    Py_ssize_t k = known / 2;
    if (k < 2 || known != 2 * k || length != 2 * room) {
        wrong("velocity_likeness: lengths do not agree");
        goto done;
    }
    double model[2], own[2];
    pca_velocity(trajectory, trajectory + 2 * (k - 1), k, root, model);
    double pace = hypot(model[0], model[1]);
    for (Py_ssize_t i = 0; i < room; i++) {
        pca_velocity(trajectory + 2, places + 2 * i, k, root, own);
        double speed = hypot(own[0], own[1]), larger = speed > pace || isnan(speed) ? speed : pace;
        /* min / max . cosine = dot / max^2, which needs no division by a speed of 0: two at rest are alike. */
        double alike = larger > 0 ? (own[0] * model[0] + own[1] * model[1]) / (larger * larger) : isnan(larger) ? larger : 1;
        out[i] = alike < 0 ? 0 : alike > 1 ? 1 : alike;
    }
    result = Py_NewRef(Py_None);
done:
    release(&arrays);
    return result;
}

/* line(places, ahead, velocity): the straight line through places (k, 2), one frame on, and its velocity, (2,). */
PyObject *line(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    Arrays arrays = {.count = 0};
    if (count != 3) {
        PyErr_SetString(PyExc_TypeError, "line takes 3 arguments");
        return NULL;
    }
    PyObject *result = NULL;
    Py_ssize_t known, two, too;
    const double *places = array(&arrays, given[0], "d", 0, &known);
    double *ahead = places ? array(&arrays, given[1], "d", 1, &two) : NULL;
    double *velocity = ahead ? array(&arrays, given[2], "d", 1, &too) : NULL;
    if (velocity == NULL)
        goto done;
    Py_ssize_t k = known / 2;
    if (k < 1 || known != 2 * k || two != 2 || too != 2) {
        wrong("line: lengths do not agree");
        goto done;
    }
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
    result = Py_NewRef(Py_None);
done:
    release(&arrays);
    return result;
}
