/* Two states of a layer, mixed and moved by parts of a pixel. */
#ifndef IRSIM_STATES_H
#define IRSIM_STATES_H

#include <stdint.h>

#include "fused.h"
#include "plane.h"

#define WHOLE 32768  /* what the shares of words sum to */
#define LEAST -32768 /* the word that stands for 0 */

/* What counts of a word and of the one right of it, in either state: below 0, so that a word holds all of one, too.
 * Sums of words so weighted fit 32 bits, and are exact. */
typedef struct {
    int16_t of_early, right_of_early, of_late, right_of_late;
} Shares;

/* Two states, a row and a column larger than the picture; the value of a sum of weighted words is it * unit + zero. */
typedef struct {
    Words early, late;
    Shares shares;
    float unit, zero;
    float *above; /* room for a row between its pixels: sums */
} Field;

/* The sum at a place between two columns, of both states. */
INLINED float beside(const Shares *of, const int16_t *early, const int16_t *late, Py_ssize_t i)
{
    return (float)(early[i] * of->of_early + early[i + 1] * of->right_of_early + late[i] * of->of_late +
                   late[i + 1] * of->right_of_late);
}

INLINED void begin(const Field *field, Py_ssize_t columns)
{
    const Field own = *field;
    float *restrict above = own.above;
    for (Py_ssize_t i = 0; i < columns; i++)
        above[i] = beside(&own.shares, own.early.data, own.late.data, i);
}

/* The value of a pixel whose upper edge is kept, and its lower edge, which is kept as the next row's upper one. */
INLINED float between(const Field *field, float *kept, float below, float down, int fused)
{
    const float above = *kept;
    *kept = below;
    return plus(field->zero, plus(above, below - above, down, fused), field->unit, fused);
}

#endif
