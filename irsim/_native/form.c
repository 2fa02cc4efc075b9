/* Tables of a body at rest, looked through once and kept: what draws it need not ask again whether they agree. */
#include "form.h"

#include "arguments.h"

static const char NAME[] = "irsim.form";

static int rises(const int64_t *first, Py_ssize_t parts, Py_ssize_t end)
{
    for (Py_ssize_t i = 0; i < parts; i++)
        if (first[i] >= first[i + 1])
            return 0;
    return first[0] == 0 && first[parts] == end;
}

static int within(int64_t number, Py_ssize_t end)
{
    return 0 <= number && number < end;
}

/* Do all numbers in the tables mean something? */
static int holds_together(const Form *form)
{
    int holds = rises(form->first_vertex, form->parts, form->vertices_count) &&
                rises(form->first_face, form->parts, form->faces);
    for (Py_ssize_t i = 0; i < form->faces; i++)
        holds &= within(form->corner[i], form->vertices_count);
    for (Py_ssize_t i = 0; i < form->edges_count; i++) {
        const Edge *edge = &form->edges[i];
        holds &= within(edge->tail, form->vertices_count) && within(edge->head, form->vertices_count);
        holds &= within(edge->left, form->faces) && within(edge->right, form->faces) && within(edge->part, form->parts);
    }
    return holds;
}

/* How many joints its parts name. */
static Py_ssize_t joints_of(const int64_t *joint, Py_ssize_t parts)
{
    int64_t most = -1;
    for (Py_ssize_t i = 0; i < parts; i++)
        most = joint[i] > most ? joint[i] : most;
    return (Py_ssize_t)most + 1;
}

#define ARGUMENTS 10
#define THIN 8 /* the one that is a number */

static void let_go(PyObject *capsule)
{
    PyMem_Free(PyCapsule_GetPointer(capsule, NAME));
}

/* A copy of them all, behind the Form that points there. */
static Form *kept(void *const *data, const Py_ssize_t *bytes, double thin)
{
    Py_ssize_t room = sizeof(Form);
    for (int i = 0; i < ARGUMENTS; i++)
        room += bytes[i];
    Form *form = PyMem_Malloc((size_t)room);
    if (form == NULL) {
        PyErr_NoMemory();
        return NULL;
    }
    const void *copies[ARGUMENTS];
    char *next = (char *)(form + 1);
    for (int i = 0; i < ARGUMENTS; i++) {
        copies[i] = next;
        memcpy(next, data[i], (size_t)bytes[i]);
        next += bytes[i];
    }
    const Py_ssize_t parts = bytes[9] / 8;
    *form = (Form){
        .parts = parts,
        .faces = bytes[6] / 8,
        .vertices_count = bytes[4] / 24,
        .edges_count = bytes[2] / 40,
        .joints = joints_of(copies[9], parts),
        .first_vertex = copies[0],
        .first_face = (const int64_t *)copies[0] + parts + 1,
        .corner = copies[1],
        .edges = copies[2],
        .heat = copies[3],
        .vertices = copies[4],
        .normals = copies[5],
        .offsets = copies[6],
        .crossing = copies[7],
        .joint = copies[9],
        .thin = thin,
    };
    return form;
}

PyObject *form(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    (void)self;
    if (count != ARGUMENTS)
        return PyErr_Format(PyExc_TypeError, "form takes %d arguments, not %zd", ARGUMENTS, count);
    static const char *const formats[ARGUMENTS] = {"l", "l", "l", "l", "d", "d", "d", "d", NULL, "l"};
    Arrays arrays = {.count = 0};
    PyObject *capsule = NULL;
    double thin = PyFloat_AsDouble(given[THIN]);
    void *data[ARGUMENTS] = {[THIN] = &thin};
    Py_ssize_t length[ARGUMENTS] = {0}, bytes[ARGUMENTS];
    for (int i = 0; i < ARGUMENTS && !PyErr_Occurred(); i++)
        if (i != THIN)
            data[i] = array(&arrays, given[i], formats[i], 0, &length[i]);
    if (PyErr_Occurred())
        goto done;
    const Py_ssize_t parts = length[9], faces = length[6];
    const Py_ssize_t wanted[ARGUMENTS] = {2 * (parts + 1), faces,  length[2] / 5 * 5, parts, length[4] / 3 * 3,
                                          3 * faces,       faces, parts * faces,     0,     parts};
    int fits = parts > 0;
    for (int i = 0; i < ARGUMENTS; i++) {
        fits &= length[i] == wanted[i];
        bytes[i] = 8 * length[i]; /* all are of 64 bits */
    }
    Form *found = fits ? kept(data, bytes, thin) : NULL;
    if (found != NULL && holds_together(found))
        capsule = PyCapsule_New(found, NAME, let_go);
    else if (!PyErr_Occurred())
        PyErr_SetString(PyExc_ValueError, "form: its arrays do not agree");
    if (capsule == NULL)
        PyMem_Free(found);
done:
    release(&arrays);
    return capsule;
}

const Form *form_of(PyObject *given)
{
    return PyCapsule_GetPointer(given, NAME);
}
