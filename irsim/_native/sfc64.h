/* The generator SFC64 (C. Doty-Humphrey, PractRand): the raw words of numpy.random.SFC64 from the same state. */
#ifndef IRSIM_SFC64_H
#define IRSIM_SFC64_H

#include <stdint.h>

/* As numpy keeps it: three words of state and a counter. */
typedef struct {
    uint64_t a, b, c, counter;
} Sfc64;

static inline uint64_t next_word(Sfc64 *source)
{
    uint64_t word = source->a + source->b + source->counter++;
    source->a = source->b ^ (source->b >> 11);
    source->b = source->c + (source->c << 3);
    source->c = ((source->c << 24) | (source->c >> 40)) + word;
    return word;
}

#endif
