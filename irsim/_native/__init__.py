"""Inner loops in C, `kernels`, where a compiler was at hand when irsim was installed: then `COMPILED` is true.

Each has an equivalent in Python beside its caller, whose docstring documents both. IRSIM_PLAIN=1 in the environment
selects the equivalents.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from irsim._native.loading import load

__all__ = ["COMPILED", "kernels"]

if TYPE_CHECKING:
    from irsim._native import _kernels as kernels
else:
    kernels = load(__name__, Path(__file__).parent)

COMPILED: bool = kernels is not None
