"""What tests of trackers' compiled loops share: small pictures and windows, and the plain twins in their place."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from hypothesis import strategies as st

from irsim.types import Box, Image
from irtrack.features.quantiser import Quantiser
from irtrack.features.window import Window


@contextmanager
def plain() -> Iterator[None]:
    """The plain twins are used everywhere."""
    modules = [
        module for name, module in sys.modules.items() if name.startswith("irtrack.") and "COMPILED" in vars(module)
    ]
    with pytest.MonkeyPatch.context() as patch:
        for module in modules:
            patch.setattr(module, "COMPILED", False)
        yield


@st.composite
def pictures(draw: st.DrawFn) -> Image:
    """Small ones of either depth, noise or a single level."""
    shape = draw(st.tuples(st.integers(1, 30), st.integers(1, 30)))
    rng = np.random.default_rng(draw(st.integers(0, 99)))
    levels = draw(st.sampled_from([1, 200]))
    image = rng.integers(0, levels, shape)
    return image.astype(np.uint8) if draw(st.booleans()) else (300 * image).astype(np.uint16)


@st.composite
def windows(draw: st.DrawFn) -> Window:
    return Window.of(Box(draw(st.floats(0, 9)), draw(st.floats(0, 9)), draw(st.floats(1, 12)), draw(st.floats(1, 12))))


@st.composite
def quantisers(draw: st.DrawFn) -> Quantiser:
    low = draw(st.floats(-10, 150))
    return Quantiser(low, low + draw(st.sampled_from([3.0, 90.0, 40000.0])), draw(st.integers(2, 40)))


seeds = st.integers(0, 10**6)
