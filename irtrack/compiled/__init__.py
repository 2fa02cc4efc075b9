"""Inner loops in C, `kernels`, where a compiler was at hand when irtrack was installed: then `COMPILED` is true.

Each has a plain twin beside its caller, which says what it does. IRSIM_PLAIN=1 in the environment has the plain ones
used.
"""

from __future__ import annotations

import os

COMPILED = False

try:
    if os.environ.get("IRSIM_PLAIN"):
        raise ImportError("the plain ones are wanted")
    from irtrack.compiled import _kernels as kernels

    COMPILED = True
except ImportError:  # or there was no compiler
    kernels = None  # type: ignore[assignment]
