/* The module irsim._native._kernels. _kernels.pyi documents the arguments; lengths that must agree are checked before
 * anything is read. */
#include "kernels.h"

#define METHOD(name) {#name, (PyCFunction)(void (*)(void))name, METH_FASTCALL, NULL},

static PyMethodDef methods[] = {FOR_ALL_KERNELS(METHOD){NULL, NULL, 0, NULL}};

/* Digest of the compiled source, compared at loading (see irsim/_native/loading.py), and constants of callers. */
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
