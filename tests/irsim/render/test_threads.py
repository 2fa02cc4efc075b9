"""Threads that share one renderer get the frames that it gives alone."""

from __future__ import annotations

import random
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import irsim
from irsim.render.frame import Renderer

CHAIN = str(Path(__file__).parents[2] / "bench" / "full_chain.yaml")
EVOLVING = ["background.clouds.0.evolve_s=0.7", "background.clouds.1.evolve_s=1.2", "camera.time_constant_ms=30"]


@pytest.fixture
def hurried() -> Iterator[None]:
    """Threads switch a hundred times as often."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(before / 100)
    yield
    sys.setswitchinterval(before)


@pytest.mark.usefixtures("hurried")
def test_threads_get_the_frames_of_one_alone() -> None:
    scenario = irsim.load(CHAIN, ["camera.size=[64,48]", *EVOLVING])
    alone, shared = Renderer(scenario), Renderer(scenario)
    wanted = {index: alone.frame(index)[0].image for index in range(0, 20, 4)}
    order = [*wanted, *wanted]
    random.Random(1).shuffle(order)
    with ThreadPoolExecutor(4) as threads:
        for index, image in zip(order, threads.map(lambda index: shared.frame(index)[0].image, order), strict=True):
            np.testing.assert_array_equal(image, wanted[index])
