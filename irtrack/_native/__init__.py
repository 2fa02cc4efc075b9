"""C kernels of trackers, in `kernels`; `COMPILED` is true where they were built at installation.

Each kernel has an equivalent in Python beside its caller, whose docstring documents both. IRSIM_PLAIN=1 in the
environment selects the Python equivalents.
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
