/* The module irsim._native._kernels; _kernels.pyi documents each kernel. */
#include "kernels.h"

static int add_constants(PyObject *kernels)
{
    return PyModule_AddIntMacro(kernels, MOST_ADDED) < 0 ? -1 : PyModule_AddStringConstant(kernels, "SOURCE", SOURCE);
}

MODULE("irsim._native._kernels", add_constants)
