"""Inner loops in C, `kernels`, where a compiler was at hand when irtrack was installed: then `COMPILED` is true.

Each has a plain twin beside its caller, which says what it does. IRSIM_PLAIN=1 in the environment has the plain ones
used.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from irsim._native import loading

__all__ = ["COMPILED", "kernels"]

if TYPE_CHECKING:
    from irtrack._native import _kernels as kernels
else:
    kernels = loading.load(__name__, Path(__file__).parent, Path(loading.__file__).parent)

COMPILED: bool = kernels is not None
