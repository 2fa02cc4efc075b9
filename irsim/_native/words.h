/* Pictures of 16-bit words, eight or sixteen at a time: compilers make loops of half the speed of what is both narrow
 * and wide. */
#ifndef IRSIM_WORDS_H
#define IRSIM_WORDS_H

#include <stdint.h>

#include "fused.h"

#if defined(__x86_64__) && defined(__GNUC__)
#define SIXTEENS
#include <immintrin.h>

FUSING INLINED __m256i eight_whole(const int16_t *words)
{
    return _mm256_cvtepi16_epi32(_mm_loadu_si128((const __m128i *)words));
}

FUSING INLINED __m256 eight(const int16_t *words)
{
    return _mm256_cvtepi32_ps(eight_whole(words));
}

/* Rounded to the nearest (halves to even); what is beyond the least or the greatest word, within 2^31, is that one. */
FUSING INLINED void store_words(int16_t *out, __m256 first, __m256 second)
{
    const __m256i both = _mm256_packs_epi32(_mm256_cvtps_epi32(first), _mm256_cvtps_epi32(second));
    _mm256_storeu_si256((__m256i *)out, _mm256_permute4x64_epi64(both, 0xd8));
}

/* `past` the caches: where whoever reads them comes much later, they would only take the place of what is used
 * before. */
FUSING INLINED void store_counts(uint16_t *out, __m256 first, __m256 second, int past)
{
    const __m256i both = _mm256_packus_epi32(_mm256_cvtps_epi32(first), _mm256_cvtps_epi32(second));
    const __m256i counts = _mm256_permute4x64_epi64(both, 0xd8);
    if (past) {
        _mm_stream_si128((__m128i *)out, _mm256_castsi256_si128(counts));
        _mm_stream_si128((__m128i *)(out + 8), _mm256_extracti128_si256(counts, 1));
    } else {
        _mm256_storeu_si256((__m256i *)out, counts);
    }
}
#endif

#endif
