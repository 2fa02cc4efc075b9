/* Several convex polyhedra as they lie, and which of them hides which. */
#ifndef IRSIM_HIDING_H
#define IRSIM_HIDING_H

#include "form.h"
#include "points.h"
#include "scratch.h"

/* rank (parts) of each part as seen from an eye whose side faces are `to_eye` of, the parts filling boxes in the
 * picture. -1 with an exception where memory runs out. */
int hiding_order(const Form *form, const char *to_eye, const Extent *boxes, int64_t *rank);

#endif
