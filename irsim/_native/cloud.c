/* How a cloud looks, pixel by pixel; see irsim/backgrounds/clouds.py. */
#include <math.h>
#include <stdint.h>

#include "cloud.h"
#include "fused.h"

#define ENTRIES (UINT16_MAX + 1)
#define BLOCK 512 /* pixels between passes: what they leave for each other stays in the nearest cache */

/* Thickness above which there is cloud, depth for each unit above it, what full sunlight adds; places of warmth in the
 * table of its glow: warmth times `step`, from `middle` on. */
typedef struct {
    float edge, depth, sunlit, step, middle;
    const float *glow;
} Look;

#define FAINTEST 88.0F /* from here on the power of two is 2^-127, whose bits are those of 0 */

/* e^-x of x from 0 to FAINTEST, where it is 0: within 2e-7 of it, a power of two, and the rest by its series. */
INLINED float faded(float x)
{
    const float power = x * 1.44269504F; /* log2 e */
    const int32_t whole = (int32_t)(power + 0.5F);
    const float y = ((float)whole - power) * 0.693147181F; /* -ln 2 / 2 to ln 2 / 2 */
    const float series =
        1 + y * (1 + y * (1.0F / 2 + y * (1.0F / 6 + y * (1.0F / 24 + y * (1.0F / 120 + y * (1.0F / 720))))));
    const union {
        int32_t bits;
        float value;
    } scale = {(127 - whole) << 23};
    return series * scale.value;
}

INLINED float within(float value, float most)
{
    const float above = value > 0 ? value : 0.0F; /* nan, too, is 0 */
    return above < most ? above : most;
}

INLINED void paint(const Look *look, const float *restrict thickness, const float *restrict warmth,
                   const float *restrict lit, float *restrict passed, float *restrict emitted, Py_ssize_t count,
                   int sunny)
{
    const Look own = *look;
    int32_t places[BLOCK];
    float thick[BLOCK], deep[BLOCK], lit_by[BLOCK]; /* written and read again: else the compiler branches where they are 0 */
    for (Py_ssize_t from = 0; from < count; from += BLOCK) {
        const Py_ssize_t length = count - from < BLOCK ? count - from : BLOCK;
        const float *restrict above = thickness + from, *restrict warm = warmth + from;
        const float *restrict sun = sunny ? lit + from : NULL;
        float *restrict left = passed + from, *restrict light = emitted + from;
        for (Py_ssize_t i = 0; i < length; i++) {
            places[i] = (int32_t)rintf(within(warm[i] * own.step + own.middle, ENTRIES - 1));
            thick[i] = within(above[i] - own.edge, FAINTEST);
            deep[i] = within((above[i] - own.edge) * own.depth, FAINTEST);
            lit_by[i] = sunny ? within(sun[i], 1.0F) : 0.0F;
        }
        for (Py_ssize_t i = 0; i < length; i++)
            light[i] = own.glow[places[i]];
        for (Py_ssize_t i = 0; i < length; i++) {
            const float added = sunny ? own.sunlit * lit_by[i] * faded(thick[i]) : 0.0F;
            left[i] = faded(deep[i]);
            light[i] = (light[i] + added) * (1 - left[i]);
        }
    }
}

/* Both ways are compiled apart: without sun nothing of it is read. */
INLINED void paint_in(const Look *look, const float *thickness, const float *warmth, const float *lit, float *passed,
                      float *emitted, Py_ssize_t count)
{
    if (lit == NULL)
        paint(look, thickness, warmth, NULL, passed, emitted, count, 0);
    else
        paint(look, thickness, warmth, lit, passed, emitted, count, 1);
}

FUSING static void paint_fused(const Look *look, const float *thickness, const float *warmth, const float *lit,
                               float *passed, float *emitted, Py_ssize_t count)
{
    paint_in(look, thickness, warmth, lit, passed, emitted, count);
}

static void paint_twice(const Look *look, const float *thickness, const float *warmth, const float *lit,
                        float *passed, float *emitted, Py_ssize_t count)
{
    paint_in(look, thickness, warmth, lit, passed, emitted, count);
}

/* cloud(thickness, warmth, lit, edge, depth, sunlit, glow, step, middle, passed, emitted): all float32 of one length
 * but the table; lit may be None */
PyObject *cloud(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    if (count != 11)
        return PyErr_Format(PyExc_TypeError, "cloud takes 11 arguments, not %zd", count);
    Look look;
    float *const numbers[] = {&look.edge, &look.depth, &look.sunlit, &look.step, &look.middle};
    const int places[] = {3, 4, 5, 7, 8};
    for (int i = 0; i < 5; i++) {
        *numbers[i] = (float)PyFloat_AsDouble(given[places[i]]);
        if (PyErr_Occurred())
            return NULL;
    }
    Arrays arrays = {.count = 0};
    Py_ssize_t length, warm, sunny, entries, left, light;
    const float *thickness = array(&arrays, given[0], "f", 0, &length);
    const float *warmth = thickness ? array(&arrays, given[1], "f", 0, &warm) : NULL;
    look.glow = warmth ? array(&arrays, given[6], "f", 0, &entries) : NULL;
    float *passed = look.glow ? array(&arrays, given[9], "f", 1, &left) : NULL;
    float *emitted = passed ? array(&arrays, given[10], "f", 1, &light) : NULL;
    const float *lit = emitted && given[2] != Py_None ? array(&arrays, given[2], "f", 0, &sunny) : NULL;
    int done = emitted != NULL && (lit != NULL || given[2] == Py_None);
    if (done && (warm != length || left != length || light != length || (lit != NULL && sunny != length) ||
                 entries != ENTRIES)) {
        PyErr_Format(PyExc_ValueError, "pictures of one size are wanted, and a table of %d", ENTRIES);
        done = 0;
    }
    if (done)
        (fuses() ? paint_fused : paint_twice)(&look, thickness, warmth, lit, passed, emitted, length);
    release(&arrays);
    if (!done)
        return NULL;
    Py_RETURN_NONE;
}
