/* The module irtrack._native._kernels: inner loops, each family in a file of its own. What they take is said in
 * _kernels.pyi. */
#include "cues.h"
#include "highpass.h"
#include "likeness.h"
#include "mean_shift.h"
#include "particles.h"
#include "velocity.h"
#include "windows.h"

#define FUNCTION(name) {#name, (PyCFunction)(void (*)(void))name, METH_FASTCALL, NULL}

static PyMethodDef methods[] = {
    FUNCTION(distinct_windows),
    FUNCTION(window_masses),
    FUNCTION(surround_histograms),
    FUNCTION(window_gradients),
    FUNCTION(window_cues),
    FUNCTION(high_pass),
    FUNCTION(bhattacharyya),
    FUNCTION(below_best),
    FUNCTION(weighted),
    FUNCTION(sorted_uniforms),
    FUNCTION(pick),
    FUNCTION(ar2_drawn),
    FUNCTION(velocity_likeness),
    FUNCTION(line),
    FUNCTION(mean_shift),
    {NULL, NULL, 0, NULL},
};

/* Which source it was made of, for whoever loads it: see irsim/_native/loading.py. */
static int tell_source(PyObject *kernels)
{
    return PyModule_AddStringConstant(kernels, "SOURCE", SOURCE);
}

static PyModuleDef_Slot slots[] = {{Py_mod_exec, (void *)tell_source}, {0, NULL}};

static PyModuleDef module = {
    .m_base = PyModuleDef_HEAD_INIT,
    .m_name = "irtrack._native._kernels",
    .m_methods = methods,
    .m_slots = slots,
};

PyMODINIT_FUNC PyInit__kernels(void)
{
    return PyModuleDef_Init(&module);
}
