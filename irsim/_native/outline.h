/* The outlines of a body's parts in the picture, by layers; see irsim/targets/part_outlines.py. */
#ifndef IRSIM_OUTLINE_H
#define IRSIM_OUTLINE_H

#include "form.h"
#include "points.h"
#include "scratch.h"

/* How a body is moved and seen. */
typedef struct {
    const double *motions; /* (joints, 12) turn (3, 3) and shift of each */
    double scale;          /* of shifts */
    Place position;
    const double *attitude; /* (3, 3) */
    double ifov;
} Pose;

/* Edges of what is seen of parts, from the body's place in the picture, px; those of each layer together, the nearest
 * first. */
typedef struct {
    Point *start, *stop;
    int64_t *layer;
    Py_ssize_t count;
    int64_t *rank; /* (parts) the layer of each */
    Extent box;    /* around all of it */
} Rims;

/* 1 with the rims of a body, in memory of `held`; 0 where any of it is behind the camera; -1 with an exception. */
int outline(const Form *form, const Pose *pose, Scratch *held, Rims *rims);

#endif
