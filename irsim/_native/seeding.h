/* The state that numpy.random.SFC64 begins with, given 256 bits: those of numpy.random.SeedSequence, which is after
 * M. E. O'Neill's seed_seq_fe and as stable as the generator. */
#ifndef IRSIM_SEEDING_H
#define IRSIM_SEEDING_H

#include "sfc64.h"

enum { ENTROPY_WORDS = 8, POOL_WORDS = 4, STATE_HALVES = 6, FIRST_ROUNDS = 12 };

static inline uint32_t hashed(uint32_t value, uint32_t *constant, uint32_t multiplier)
{
    value ^= *constant;
    *constant *= multiplier;
    value *= *constant;
    return value ^ value >> 16;
}

static inline uint32_t mixed(uint32_t x, uint32_t y)
{
    uint32_t sum = 0xca01f9dd * x - 0x4973f715 * y;
    return sum ^ sum >> 16;
}

static inline Sfc64 seeded(const uint32_t *entropy)
{
    const uint32_t into_pool = 0x931e8875, out_of_pool = 0x58f38ded;
    uint32_t constant = 0x43b0d7e5, pool[POOL_WORDS], halves[STATE_HALVES];
    for (int i = 0; i < POOL_WORDS; i++)
        pool[i] = hashed(entropy[i], &constant, into_pool);
    for (int from = 0; from < POOL_WORDS; from++)
        for (int to = 0; to < POOL_WORDS; to++)
            if (from != to)
                pool[to] = mixed(pool[to], hashed(pool[from], &constant, into_pool));
    for (int from = POOL_WORDS; from < ENTROPY_WORDS; from++)
        for (int to = 0; to < POOL_WORDS; to++)
            pool[to] = mixed(pool[to], hashed(entropy[from], &constant, into_pool));
    constant = 0x8b51f9dd;
    for (int i = 0; i < STATE_HALVES; i++)
        halves[i] = hashed(pool[i % POOL_WORDS], &constant, out_of_pool);
    Sfc64 source = {
        .a = halves[0] | (uint64_t)halves[1] << 32,
        .b = halves[2] | (uint64_t)halves[3] << 32,
        .c = halves[4] | (uint64_t)halves[5] << 32,
        .counter = 1,
    };
    for (int i = 0; i < FIRST_ROUNDS; i++)
        next_word(&source);
    return source;
}

#endif
