/* What a row of a picture is made from where a layer is laid over it, and its pixels by sixteens. */
#ifndef IRSIM_SIXTEENS_H
#define IRSIM_SIXTEENS_H

#include "fused.h"
#include "states.h"
#include "words.h"

/* What the air before it lets through, and its own light: each as large as the picture. */
typedef struct {
    Plane passed, lit;
} Air;

/* What a row of the picture is made from: the words of both states of both fields, what is seen, and the air. */
typedef struct {
    const int16_t *early, *late, *own_early, *own_late;
    const float *seen, *tau, *lit;
    float *values;
} Row;

INLINED Row row_of(const Field *passed, const Field *emitted, const Plane *under, const Plane *light, const Air *air,
                   Py_ssize_t row)
{
    return (Row){.early = passed->early.data + (row + 1) * passed->early.stride,
                 .late = passed->late.data + (row + 1) * passed->late.stride,
                 .own_early = emitted->early.data + (row + 1) * emitted->early.stride,
                 .own_late = emitted->late.data + (row + 1) * emitted->late.stride,
                 .seen = under->data + row * under->stride,
                 .tau = air == NULL ? NULL : air->passed.data + row * air->passed.stride,
                 .lit = air == NULL ? NULL : air->lit.data + row * air->lit.stride,
                 .values = light->data + row * light->stride};
}

#ifdef SIXTEENS
/* By sixteens of words, products of neighbours summed in one step: 0.32 ns a pixel alone, 0.45 where each word is
 * made a float, 0.66 as the compiler does that (Zen 3). What counts of a word and of the one right of it, eight times
 * each. */
typedef struct {
    __m256i early, late;
    __m256 unit, zero;
} Pairs;

typedef struct {
    __m256 first, second;
} Sixteen;

FUSING INLINED __m256i pair_of(int16_t share, int16_t right)
{
    return _mm256_set1_epi32((int32_t)((uint32_t)(uint16_t)right << 16 | (uint16_t)share));
}

FUSING INLINED Pairs pairs_of(const Field *field)
{
    const Shares of = field->shares;
    return (Pairs){pair_of(of.of_early, of.right_of_early), pair_of(of.of_late, of.right_of_late),
                   _mm256_set1_ps(field->unit), _mm256_set1_ps(field->zero)};
}

/* Every second sum, from the first on. */
FUSING INLINED __m256i every_second(const Pairs *of, const int16_t *early, const int16_t *late)
{
    return _mm256_add_epi32(_mm256_madd_epi16(_mm256_loadu_si256((const __m256i *)early), of->early),
                            _mm256_madd_epi16(_mm256_loadu_si256((const __m256i *)late), of->late));
}

/* See `beside`. */
FUSING INLINED Sixteen sixteen_beside(const Pairs *of, const int16_t *early, const int16_t *late)
{
    const __m256i even = every_second(of, early, late), odd = every_second(of, early + 1, late + 1);
    const __m256i low = _mm256_unpacklo_epi32(even, odd), high = _mm256_unpackhi_epi32(even, odd);
    return (Sixteen){_mm256_cvtepi32_ps(_mm256_permute2x128_si256(low, high, 0x20)),
                     _mm256_cvtepi32_ps(_mm256_permute2x128_si256(low, high, 0x31))};
}

/* See `between`. */
FUSING INLINED __m256 eight_between(const Pairs *of, float *kept, __m256 below, __m256 down)
{
    const __m256 above = _mm256_loadu_ps(kept);
    _mm256_storeu_ps(kept, below);
    return _mm256_fmadd_ps(_mm256_fmadd_ps(_mm256_sub_ps(below, above), down, above), of->unit, of->zero);
}

/* Eight pixels of a row from the i-th on, of what they pass and emit. */
FUSING INLINED void lay_eight(const Row *row, Py_ssize_t i, __m256 left, __m256 added, int airy)
{
    __m256 seen = _mm256_loadu_ps(row->seen + i);
    if (airy) {
        const __m256 lit = _mm256_loadu_ps(row->lit + i);
        added = _mm256_fmadd_ps(added, _mm256_loadu_ps(row->tau + i), lit);
        seen = _mm256_sub_ps(seen, lit);
    }
    _mm256_storeu_ps(row->values + i, _mm256_fmadd_ps(seen, left, added));
}

/* As many pixels of a row as there are by sixteens, as `lay` has them; how many they are. */
FUSING static Py_ssize_t lay_sixteens(const Field *passed, const Field *emitted, float down, const Row *at,
                                      Py_ssize_t columns)
{
    const Pairs through = pairs_of(passed), own = pairs_of(emitted);
    const __m256 share = _mm256_set1_ps(down);
    const Row row = *at;
    float *through_above = passed->above, *own_above = emitted->above;
    const int airy = row.tau != NULL;
    Py_ssize_t i = 0;
    for (; i + 16 <= columns; i += 16) {
        const Sixteen below = sixteen_beside(&through, row.early + i, row.late + i);
        const Sixteen own_below = sixteen_beside(&own, row.own_early + i, row.own_late + i);
        lay_eight(&row, i, eight_between(&through, through_above + i, below.first, share),
                  eight_between(&own, own_above + i, own_below.first, share), airy);
        lay_eight(&row, i + 8, eight_between(&through, through_above + i + 8, below.second, share),
                  eight_between(&own, own_above + i + 8, own_below.second, share), airy);
    }
    return i;
}
#else
#define lay_sixteens(passed, emitted, down, at, columns) 0
#endif

#endif
