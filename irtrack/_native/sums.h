/* Sums as numpy takes them, so that results are those of the plain twins to the last bit. */
#ifndef IRTRACK_SUMS_H
#define IRTRACK_SUMS_H

#include "arrays.h"

/* Pairwise over blocks of 128, which eight sums share: what np.sum does with contiguous doubles. */
static inline double block_sum(const double *terms, Py_ssize_t count)
{
    if (count < 8) {
        double sum = 0;
        for (Py_ssize_t i = 0; i < count; i++)
            sum += terms[i];
        return sum;
    }
    double of[8];
    Py_ssize_t i;
    for (int j = 0; j < 8; j++)
        of[j] = terms[j];
    for (i = 8; i < count - count % 8; i += 8)
        for (int j = 0; j < 8; j++)
            of[j] += terms[i + j];
    double sum = ((of[0] + of[1]) + (of[2] + of[3])) + ((of[4] + of[5]) + (of[6] + of[7]));
    for (; i < count; i++)
        sum += terms[i];
    return sum;
}

static double pairwise_sum(const double *terms, Py_ssize_t count)
{
    if (count <= 128)
        return block_sum(terms, count);
    Py_ssize_t half = count / 2;
    half -= half % 8;
    return pairwise_sum(terms, half) + pairwise_sum(terms + half, count - half);
}

#endif
