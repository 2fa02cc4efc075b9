"""Inner loops in C, `kernels`, where a compiler was at hand when irtrack was installed: then `COMPILED` is true.

Each has a plain twin beside its caller, which says what it does. IRSIM_PLAIN=1 in the environment has the plain ones
used.
"""

from __future__ import annotations

import os
from contextlib import suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from irtrack.compiled import _kernels as kernels
else:
    kernels = None
    if not os.environ.get("IRSIM_PLAIN"):
        with suppress(ImportError):  # there was no compiler
            from irtrack.compiled import _kernels as kernels

COMPILED: bool = kernels is not None
