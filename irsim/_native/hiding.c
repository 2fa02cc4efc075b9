/* See irsim/targets/mesh.py, whose `Mesh.hiding_order` does the same for all pairs of parts at once; here only those are
 * looked at that are of unlike heat and whose boxes meet in the picture. */
#include "hiding.h"

/* How a part lies to the faces of another. */
typedef struct {
    int before;   /* wholly before one that the eye is before */
    int beyond;   /* wholly before one that the eye is not before */
    double least; /* how far it reaches behind the face that it reaches behind least */
    int64_t wall; /* that face */
} Relation;

typedef struct {
    uint64_t *hiders; /* (parts, words) bit i of row j: part i hides part j */
    Py_ssize_t words;
} Hiding;

static double crosses(const Form *form, Py_ssize_t part, int64_t face, int moved)
{
    if (!moved)
        return form->crossing[part * form->faces + face];
    double lowest = INFINITY;
    for (int64_t i = form->first_vertex[part]; i < form->first_vertex[part + 1]; i++)
        lowest = lesser(lowest, dot(form->vertices[i], form->normals[face]));
    return form->offsets[face] - lowest;
}

static Relation relation(const Form *form, Py_ssize_t part, Py_ssize_t other, const char *to_eye)
{
    Relation found = {.least = INFINITY, .wall = form->first_face[other]};
    int moved = form->joint[part] != form->joint[other];
    for (int64_t face = form->first_face[other]; face < form->first_face[other + 1]; face++) {
        double crossing = crosses(form, part, face, moved);
        if (crossing <= form->thin) {
            found.before |= to_eye[face];
            found.beyond |= !to_eye[face];
        }
        if (crossing < found.least) {
            found.least = crossing;
            found.wall = face;
        }
    }
    return found;
}

static void note(Hiding *hiding, Py_ssize_t hider, Py_ssize_t hidden)
{
    hiding->hiders[hidden * hiding->words + hider / 64] |= (uint64_t)1 << (hider % 64);
}

static int is_noted(const Hiding *hiding, Py_ssize_t hider, Py_ssize_t hidden)
{
    return hiding->hiders[hidden * hiding->words + hider / 64] >> (hider % 64) & 1;
}

static void compare(const Form *form, const char *to_eye, Py_ssize_t first, Py_ssize_t second, Hiding *hiding)
{
    Relation to_second = relation(form, first, second, to_eye), to_first = relation(form, second, first, to_eye);
    int first_cannot = to_first.before || to_second.beyond, second_cannot = to_second.before || to_first.beyond;
    if (!first_cannot && !second_cannot) {
        int of_second = to_second.least <= to_first.least;
        int nearer = to_eye[of_second ? to_second.wall : to_first.wall] == of_second;
        first_cannot = !nearer;
        second_cannot = nearer;
    }
    if (!first_cannot)
        note(hiding, first, second);
    if (!second_cannot)
        note(hiding, second, first);
}

/* Who hides those that hide a part hides it, too. */
static void close_chains(Hiding *hiding, Py_ssize_t parts)
{
    for (Py_ssize_t through = 0; through < parts; through++)
        for (Py_ssize_t hidden = 0; hidden < parts; hidden++)
            if (is_noted(hiding, through, hidden))
                for (Py_ssize_t word = 0; word < hiding->words; word++)
                    hiding->hiders[hidden * hiding->words + word] |= hiding->hiders[through * hiding->words + word];
}

/* Those that fewer hide come first, of equals the one with the lower number. */
static void rank_by_hiders(const Hiding *hiding, Py_ssize_t parts, int64_t *counts, int64_t *rank)
{
    for (Py_ssize_t part = 0; part < parts; part++) {
        counts[part] = 0;
        for (Py_ssize_t hider = 0; hider < parts; hider++)
            counts[part] += is_noted(hiding, hider, part);
    }
    for (Py_ssize_t part = 0; part < parts; part++) {
        rank[part] = 0;
        for (Py_ssize_t other = 0; other < parts; other++)
            rank[part] += counts[other] < counts[part] || (counts[other] == counts[part] && other < part);
    }
}

int hiding_order(const Form *form, const char *to_eye, const Extent *boxes, int64_t *rank)
{
    Scratch held = {.count = 0};
    Hiding hiding = {.words = (form->parts + 63) / 64};
    hiding.hiders = scratch(&held, form->parts * hiding.words, sizeof(uint64_t));
    int64_t *counts = hiding.hiders ? scratch_as_is(&held, form->parts, sizeof(int64_t)) : NULL;
    if (counts) {
        for (Py_ssize_t first = 0; first < form->parts; first++)
            for (Py_ssize_t second = first + 1; second < form->parts; second++)
                if (form->heat[first] != form->heat[second] && meet(&boxes[first], &boxes[second]))
                    compare(form, to_eye, first, second, &hiding);
        close_chains(&hiding, form->parts);
        rank_by_hiders(&hiding, form->parts, counts, rank);
    }
    discard(&held);
    return counts ? 0 : -1;
}
