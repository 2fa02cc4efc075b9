"""A spectral band as recordings keep it: its name, or its limits in words that people read in viewers."""

from __future__ import annotations

import re
from typing import get_args

from irsim.types import Band, BandName

_NAMED: dict[str, Band] = {name: name for name in get_args(BandName)}
_LIMITS = re.compile(r"(\d+(?:\.\d+)?) to (\d+(?:\.\d+)?) um")


def words_of(band: Band) -> str:
    """'lwir', or '3.4 to 4.9 um': every digit of the limits, so that `band_of` gives the same band."""
    return band if isinstance(band, str) else "{} to {} um".format(*band)


def band_of(words: str) -> Band | None:
    """The band that was worded; None where the words say none that is known."""
    limits = _LIMITS.fullmatch(words)
    return _NAMED.get(words) if limits is None else (float(limits[1]), float(limits[2]))
