"""C kernels of trackers, `kernels`; `COMPILED` is true where they were built at installation.

Each has a plain twin beside its caller, which documents it. IRSIM_PLAIN=1 in the environment selects the plain twins.
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
