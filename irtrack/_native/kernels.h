/* Images, sums in numpy's order, and the list of kernels. */
#ifndef IRTRACK_KERNELS_H
#define IRTRACK_KERNELS_H

#include <float.h>

#include "irsim/_native/arguments.h"

/* numpy's letter for intp, an int64 on all supported platforms. */
#define INTP "l"
/* Pixel of a place outside the image. */
#define OUTSIDE (-1)
/* Largest side of an image or a window: products of two do not overflow. */
#define MOST_PIXELS ((Py_ssize_t)1 << 24)

/* Buffer of the array that was read last. */
static inline const Py_buffer *last(const Call *call)
{
    return &call->views[call->arrays - 1];
}

/* Image of one or two bytes a pixel, row after row; `table` gives the bin of each level. */
typedef struct {
    const void *levels;
    Py_ssize_t rows, columns, bytes;
    const uint16_t *table;
} Picture;

/* Argument i as an image (rows, columns) of uint8 or uint16. */
static inline Picture image(Call *call, int i)
{
    const Py_buffer *found = view(call, i, PyBUF_C_CONTIGUOUS);
    if (found && (found->ndim != 2 || !(is_of(found, "B") || is_of(found, "H"))))
        found = wrong(call, "a picture of uint8 or uint16 is required");
    return found ? (Picture){found->buf, found->shape[0], found->shape[1], found->itemsize, NULL} : (Picture){.bytes = 1};
}

/* Arguments i and i + 1 as an image and the table of its bins, uint16. */
static inline Picture binned_image(Call *call, int i)
{
    Py_ssize_t bins;
    Picture picture = image(call, i);
    picture.table = input(call, i + 1, "H", &bins);
    if (!call->failed && bins < (Py_ssize_t)1 << (8 * picture.bytes))
        wrong(call, "a bin for each level is required");
    return picture;
}

static inline uint16_t level_at(const Picture *picture, Py_ssize_t at)
{
    return picture->bytes == 1 ? ((const uint8_t *)picture->levels)[at] : ((const uint16_t *)picture->levels)[at];
}

static inline uint16_t bin_at(const Picture *picture, Py_ssize_t row, Py_ssize_t column)
{
    return picture->table[level_at(picture, row * picture->columns + column)];
}

/* Sum of a block of at most 128 doubles in the order of np.sum: eight partial sums. */
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

/* Sum of contiguous doubles, pairwise as in np.sum. */
static inline double pairwise_sum(const double *terms, Py_ssize_t count)
{
    if (count <= 128)
        return block_sum(terms, count);
    Py_ssize_t half = count / 2;
    half -= half % 8;
    return pairwise_sum(terms, half) + pairwise_sum(terms + half, count - half);
}

/* Divides a histogram by its sum, and returns the sum; an empty one stays zero. */
static inline double normalise(double *mass, Py_ssize_t bins)
{
    double sum = pairwise_sum(mass, bins), divisor = sum > DBL_MIN ? sum : DBL_MIN;
    for (Py_ssize_t u = 0; u < bins; u++)
        mass[u] /= divisor;
    return sum;
}

#define FOR_ALL_KERNELS(X)                                                                                             \
    X(distinct_windows) X(window_histograms) X(bhattacharyya) X(window_gradients) X(window_cues) X(high_pass) X(pick)  \
    X(scaled_log_weights) X(normalise_product) X(sorted_uniforms) X(ar2) X(trajectory_similarity) X(line_fit) X(mean_shift)  \
    X(patch_contrast) X(local_contrast) X(highest) X(merge_places) X(vertices) X(peak_sizes) X(line_medians) X(hog_windows)
FOR_ALL_KERNELS(DECLARE)
#endif
