"""How two processes find out which of them does what."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import repeat

import numpy as np
import pytest

import irsim
from irsim import division
from irsim.division import DIVIDED, WHOLE, Trial, Way
from irsim.render import Renderer


def clock(scene: float, detector: float, taken: float, frames: int) -> Iterator[float]:
    """Times of a trial whose first frame takes long, and one other too."""
    now = 0.0
    for frame in range(frames):
        slow = 100.0 if frame in (0, 2) else 1.0
        for step in (scene, detector, taken):
            yield now
            now += slow * step
    yield from repeat(now)


@pytest.mark.parametrize(
    ("scene", "detector", "taken", "way"),
    [
        (1.0, 1.0, 0.0, DIVIDED),
        (1.2, 0.9, 0.05, DIVIDED),
        (1.0, 0.2, 0.0, WHOLE),  # the worker would do nearly all
        (1.0, 0.2, 0.6, DIVIDED),  # what is done with frames counts
        (1.0, 0.9, 1.0, WHOLE),  # and may be too much
        (0.3, 1.0, 0.0, WHOLE),
    ],
)
def test_work_is_divided_where_both_have_about_as_much(
    scene: float, detector: float, taken: float, way: Way, monkeypatch: pytest.MonkeyPatch
) -> None:
    times = clock(scene, detector, taken, 6)
    monkeypatch.setattr(division, "perf_counter", lambda: next(times))
    trial = Trial(Renderer(irsim.load("sky", ["frames=6", "camera.size=[16, 16]"])))
    for index in range(6):
        trial.frame(index)
    assert trial.way() == way


def test_without_frames_tried_whole_ones_are_rendered() -> None:
    assert Trial(Renderer(irsim.load("sky", ["camera.size=[16, 16]"]))).way() == WHOLE


def test_a_frame_tried_is_the_frame() -> None:
    renderer = Renderer(irsim.load("sky", ["frames=3", "camera.size=[16, 16]"]))
    trial = Trial(renderer)
    for index in range(3):
        frame, truth = trial.frame(index)
        expected, expected_truth = renderer.frame(index)
        assert np.array_equal(frame.image, expected.image)
        assert truth == expected_truth


@pytest.mark.parametrize("way", [WHOLE, DIVIDED], ids=["whole", "divided"])
def test_what_is_lent_stays_as_it_is(way: Way) -> None:
    renderer = Renderer(irsim.load("sky", ["frames=3", "camera.size=[16, 16]"]))
    picture, truth = way.begun(renderer, 1)
    before = picture.copy()
    frame = way.ended(renderer, picture, truth, lent=True)
    frame.image[:] += 1
    assert np.array_equal(picture, before)
    assert np.array_equal(frame.image, renderer.frame(1)[0].image + 1)
