"""Inner loops in C, `kernels`, where a compiler was at hand when irtrack was installed: then `COMPILED` is true.

Each has a plain twin beside its caller, which says what it does. IRSIM_PLAIN=1 in the environment has the plain ones
used.
"""

from __future__ import annotations

import os

COMPILED = False

if not os.environ.get("IRSIM_PLAIN"):
    try:
        from irtrack.compiled import _kernels as kernels  # noqa: F401

        COMPILED = True
    except ImportError:  # there was no compiler
        pass
