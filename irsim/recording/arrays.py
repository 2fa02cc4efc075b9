"""Frames of an array that numpy saved."""

from __future__ import annotations

import reprlib
from pathlib import Path
from typing import Any

import numpy as np

from irsim.errors import InputError
from irsim.types import Image

SUFFIXES = (".npy", ".npz")
_PIXELS = (np.dtype(np.uint8), np.dtype(np.uint16))


def read_stack(file: Path) -> Image:
    """(frames, rows, columns) uint8 or uint16, of the byte order that the file has: a .npy as it lies on the disk, of
    which what is looked at is read; the one array of a .npz, whole. InputError for anything else."""
    try:
        found = np.load(file, mmap_mode="r", allow_pickle=False)
        if isinstance(found, np.lib.npyio.NpzFile):
            with found as archive:
                found = archive[_only(file, archive)]
    except InputError:
        raise
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {error.strerror or 'is cut short or damaged'}") from None
    except MemoryError:  # of a whole .npz; or of a head that nobody can take apart
        raise InputError(f"{file}: does not fit in memory, or is damaged") from None
    except Exception:  # numpy's reader of damaged heads and archives has no list of what it may raise
        found = None
    if not isinstance(found, np.ndarray):
        raise InputError(f"{file}: is no array of numbers that numpy saved, or is cut short or damaged")
    return _checked(file, found)


def _only(file: Path, archive: Any) -> str:
    """The name of the one array of an archive, in which other files may lie."""
    arrays = [entry.removesuffix(".npy") for entry in archive.zip.namelist() if entry.endswith(".npy")]
    if len(arrays) != 1:
        raise InputError(f"{file}: holds the arrays {reprlib.repr(arrays)}; allowed: one (numpy.save writes it alone)")
    return str(arrays[0])


def _checked(file: Path, found: Any) -> Image:
    if found.ndim != 3 or 0 in found.shape:
        shape = " x ".join(map(str, found.shape)) or "a single number"
        raise InputError(f"{file}: is an array of {shape}; allowed: frames x rows x columns")
    if found.dtype.newbyteorder("=") not in _PIXELS:
        raise InputError(f"{file}: has pixels of type {found.dtype}; allowed: unsigned, 8 or 16 bit")
    stack: Image = found
    return stack
