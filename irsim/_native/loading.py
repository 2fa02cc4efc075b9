"""Loading of the compiled kernels; those compiled from another source than the one beside them are not used."""

from __future__ import annotations

import os
import sys
import warnings
from hashlib import blake2b
from importlib import import_module
from pathlib import Path
from types import ModuleType


def source_digest(*folders: Path) -> str:
    """Hex digest of the C in some folders."""
    digest = blake2b(digest_size=16)
    for path in sorted(path for folder in folders for path in folder.glob("*.[ch]")):
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def load(package: str, *folders: Path) -> ModuleType | None:
    """The compiled module of a package, made of the C in folders; None where there was no compiler, and where
    IRSIM_PLAIN is set. One that was made of other source is warned of and not used."""
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
        _warn(f"{package} was compiled of other source than there is now")
        return None
    return kernels


def _warn(why: str) -> None:
    warnings.warn(f"{why}: slower loops run; install anew (`make install`)", stacklevel=4)
