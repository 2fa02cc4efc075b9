"""Loading of the compiled kernels; kernels that were compiled from another version of the source are not used."""

from __future__ import annotations

import os
import sys
import warnings
from hashlib import blake2b
from importlib import import_module
from pathlib import Path
from types import ModuleType


def source_digest(*folders: Path) -> str:
    """Return the hex digest of the C files in folders."""
    digest = blake2b(digest_size=16)
    for path in sorted(path for folder in folders for path in folder.glob("*.[ch]")):
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def load(package: str, *folders: Path) -> ModuleType | None:
    """Return the compiled module of a package, built from the C files in folders; None where there was no compiler, and
    where IRSIM_PLAIN is set. A module built from other source is not used, with a warning."""
    if os.environ.get("IRSIM_PLAIN") or sys.maxsize < 2**63 - 1:  # sizes are of 64 bits
        return None
    try:
        kernels = import_module(f"{package}._kernels")
    except ModuleNotFoundError:  # there was no compiler
        return None
    except ImportError as error:
        _warn(f"{package} cannot be loaded here ({error})")
        return None
    if source_digest(*folders) != kernels.SOURCE:
        _warn(f"{package} was compiled from other source than there is now")
        return None
    return kernels


def _warn(why: str) -> None:
    warnings.warn(f"{why}: slower loops run; install anew (`make install`)", stacklevel=4)
