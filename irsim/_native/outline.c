/* See irsim/targets/part_outlines.py, which does the same with arrays. */
#include "outline.h"

#include <string.h>

#include "hiding.h"

static Place turned(const double *turn, Place place)
{
    return (Place){
        turn[0] * place.x + turn[1] * place.y + turn[2] * place.z,
        turn[3] * place.x + turn[4] * place.y + turn[5] * place.z,
        turn[6] * place.x + turn[7] * place.y + turn[8] * place.z,
    };
}

/* Vertices, normals and offsets of a body's parts, those on joints moved. */
static int move_parts(Form *form, const Pose *pose, Scratch *held)
{
    Place *vertices = scratch_as_is(held, form->vertices_count, sizeof(Place));
    Place *normals = vertices ? scratch_as_is(held, form->faces, sizeof(Place)) : NULL;
    double *offsets = normals ? scratch_as_is(held, form->faces, sizeof(double)) : NULL;
    if (offsets == NULL)
        return -1;
    memcpy(vertices, form->vertices, (size_t)form->vertices_count * sizeof(Place));
    memcpy(normals, form->normals, (size_t)form->faces * sizeof(Place));
    memcpy(offsets, form->offsets, (size_t)form->faces * sizeof(double));
    for (Py_ssize_t part = 0; part < form->parts; part++) {
        if (form->joint[part] < 0)
            continue;
        const double *turn = pose->motions + 12 * form->joint[part], *shift = turn + 9;
        for (int64_t i = form->first_vertex[part]; i < form->first_vertex[part + 1]; i++) {
            Place place = turned(turn, vertices[i]);
            vertices[i] = (Place){place.x + shift[0] * pose->scale, place.y + shift[1] * pose->scale,
                                  place.z + shift[2] * pose->scale};
        }
        for (int64_t face = form->first_face[part]; face < form->first_face[part + 1]; face++) {
            normals[face] = turned(turn, normals[face]);
            offsets[face] = dot(normals[face], vertices[form->corner[face]]);
        }
    }
    form->vertices = vertices;
    form->normals = normals;
    form->offsets = offsets;
    return 0;
}

/* Where vertices are in the picture, px from the body's middle, and the boxes of parts; 0 where one is behind the
 * camera. As differences, which lose no digits: the edges of a small body, far from the picture's corner, keep
 * theirs. */
static int project(const Form *form, const Pose *pose, Point *pixels, Extent *boxes, Extent *box)
{
    const Place middle = pose->position;
    *box = NOTHING;
    if (middle.z <= 0)
        return 0;
    const double across = middle.x / middle.z, down = middle.y / middle.z;
    for (Py_ssize_t part = 0; part < form->parts; part++) {
        boxes[part] = NOTHING;
        for (int64_t i = form->first_vertex[part]; i < form->first_vertex[part + 1]; i++) {
            Place place = turned(pose->attitude, form->vertices[i]);
            double depth = place.z + middle.z;
            if (depth <= 0)
                return 0;
            double scale = 1 / (depth * pose->ifov);
            pixels[i] = (Point){(place.x - across * place.z) * scale, (place.y - down * place.z) * scale};
            boxes[part] = with_point(boxes[part], pixels[i]);
        }
        *box = with_point(with_point(*box, boxes[part].low), boxes[part].high);
    }
    return 1;
}

static void look(const Form *form, const Pose *pose, char *to_eye)
{
    const double *a = pose->attitude;
    const Place p = pose->position;
    Place eye = {-p.x * a[0] + -p.y * a[3] + -p.z * a[6], -p.x * a[1] + -p.y * a[4] + -p.z * a[7],
                 -p.x * a[2] + -p.y * a[5] + -p.z * a[8]};
    for (Py_ssize_t face = 0; face < form->faces; face++)
        to_eye[face] = dot(form->normals[face], eye) > form->offsets[face];
}

/* The edges on the rims of parts, those of each layer together. */
static void sort_rims(const Form *form, const char *to_eye, const Point *pixels, Py_ssize_t *next, Rims *rims)
{
    for (Py_ssize_t i = 0; i < form->edges_count; i++)
        if (to_eye[form->edges[i].left] != to_eye[form->edges[i].right])
            next[rims->rank[form->edges[i].part]]++;
    rims->count = 0;
    for (Py_ssize_t i = 0; i < form->parts; i++) {
        Py_ssize_t begin = rims->count;
        rims->count += next[i];
        next[i] = begin;
    }
    for (Py_ssize_t i = 0; i < form->edges_count; i++) {
        const Edge *edge = &form->edges[i];
        int left = to_eye[edge->left];
        if (left == to_eye[edge->right])
            continue;
        /* A face seen from outside runs clockwise in x right, y down where its edges are read backwards. */
        Py_ssize_t place = next[rims->rank[edge->part]]++;
        rims->start[place] = pixels[left ? edge->head : edge->tail];
        rims->stop[place] = pixels[left ? edge->tail : edge->head];
        rims->layer[place] = rims->rank[edge->part];
    }
}

int outline(const Form *form, const Pose *pose, Scratch *held, Rims *rims)
{
    Form posed = *form;
    Point *pixels = scratch_as_is(held, form->vertices_count, sizeof(Point));
    Extent *boxes = pixels ? scratch_as_is(held, form->parts, sizeof(Extent)) : NULL;
    char *to_eye = boxes ? scratch_as_is(held, form->faces, 1) : NULL;
    Py_ssize_t *next = to_eye ? scratch(held, form->parts, sizeof(Py_ssize_t)) : NULL;
    rims->rank = next ? scratch_as_is(held, form->parts, sizeof(int64_t)) : NULL;
    rims->start = rims->rank ? scratch_as_is(held, form->edges_count, sizeof(Point)) : NULL;
    rims->stop = rims->start ? scratch_as_is(held, form->edges_count, sizeof(Point)) : NULL;
    rims->layer = rims->stop ? scratch_as_is(held, form->edges_count, sizeof(int64_t)) : NULL;
    if (rims->layer == NULL || (form->joints > 0 && move_parts(&posed, pose, held) < 0))
        return -1;
    if (!project(&posed, pose, pixels, boxes, &rims->box))
        return 0;
    look(&posed, pose, to_eye);
    if (hiding_order(&posed, to_eye, boxes, rims->rank) < 0)
        return -1;
    sort_rims(&posed, to_eye, pixels, next, rims);
    return 1;
}
