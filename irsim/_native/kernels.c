/* The module irsim._native._kernels: inner loops, each in a file of its own. What they take is said in _kernels.pyi;
 * lengths that must agree are checked before anything is read. */
#include "arguments.h"
#include "body.h"
#include "cloud.h"
#include "clutter.h"
#include "drawing.h"
#include "form.h"
#include "grain.h"
#include "histogram.h"
#include "laying.h"
#include "lookup.h"
#include "mixture.h"
#include "response.h"
#include "spread.h"
#include "sprite.h"
#include "uniforms.h"
#include "veil.h"

static PyMethodDef methods[] = {
    {"normals", (PyCFunction)(void (*)(void))normals, METH_FASTCALL, NULL},
    {"uniforms", (PyCFunction)(void (*)(void))uniforms, METH_FASTCALL, NULL},
    {"lay", (PyCFunction)(void (*)(void))lay, METH_FASTCALL, NULL},
    {"clutter", (PyCFunction)(void (*)(void))clutter, METH_FASTCALL, NULL},
    {"form", (PyCFunction)(void (*)(void))form, METH_FASTCALL, NULL},
    {"spread", (PyCFunction)(void (*)(void))spread, METH_FASTCALL, NULL},
    {"body_light", (PyCFunction)(void (*)(void))body_light, METH_FASTCALL, NULL},
    {"sprite_light", (PyCFunction)(void (*)(void))sprite_light, METH_FASTCALL, NULL},
    {"add_normals", (PyCFunction)(void (*)(void))add_normals, METH_FASTCALL, NULL},
    {"add_shot", (PyCFunction)(void (*)(void))add_shot, METH_FASTCALL, NULL},
    {"signal_of", (PyCFunction)(void (*)(void))signal_of, METH_FASTCALL, NULL},
    {"counts_of", (PyCFunction)(void (*)(void))counts_of, METH_FASTCALL, NULL},
    {"cloud", (PyCFunction)(void (*)(void))cloud, METH_FASTCALL, NULL},
    {"mixed", (PyCFunction)(void (*)(void))mixed, METH_FASTCALL, NULL},
    {"moved", (PyCFunction)(void (*)(void))moved, METH_FASTCALL, NULL},
    {"veil", (PyCFunction)(void (*)(void))veil, METH_FASTCALL, NULL},
    {"histogram", (PyCFunction)(void (*)(void))histogram, METH_FASTCALL, NULL},
    {"lookup", (PyCFunction)(void (*)(void))lookup, METH_FASTCALL, NULL},
    {"bridge", (PyCFunction)(void (*)(void))bridge, METH_FASTCALL, NULL},
    {NULL, NULL, 0, NULL},
};

/* Which source it was made of, for whoever loads it (see irsim/_native/loading.py), and what callers must know. */
static int tell(PyObject *kernels)
{
    if (PyModule_AddIntMacro(kernels, MOST_ADDED) < 0)
        return -1;
    return PyModule_AddStringConstant(kernels, "SOURCE", SOURCE);
}

static PyModuleDef_Slot slots[] = {{Py_mod_exec, (void *)tell}, {0, NULL}};

static PyModuleDef module = {
    .m_base = PyModuleDef_HEAD_INIT,
    .m_name = "irsim._native._kernels",
    .m_methods = methods,
    .m_slots = slots,
};

PyMODINIT_FUNC PyInit__kernels(void)
{
    return PyModuleDef_Init(&module);
}
