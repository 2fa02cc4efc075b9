/* Module irtrack._native._kernels; _kernels.pyi documents each kernel. */
#include "kernels.h"

static int add_constants(PyObject *kernels)
{
    return PyModule_AddStringConstant(kernels, "SOURCE", SOURCE);
}

MODULE("irtrack._native._kernels", add_constants)
