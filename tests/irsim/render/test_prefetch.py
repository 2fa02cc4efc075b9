"""Sprites are drawn ahead where frames are asked for in order, and only there."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import pytest

import irsim
from irsim.geometry.sprite import ExposureSamples, Sprite
from irsim.render.composite import NamedSprite
from irsim.render.exposure import PREFETCHED_PX, Prefetch
from irsim.render.frame import Renderer
from irsim.types import Box


def piece(index: int, side: int = 4, instants: int = 0) -> NamedSprite:
    cover = np.full((side, side), float(index))
    still = np.zeros((instants, side, side))
    samples = ExposureSamples(still, still, still, whole=True) if instants else None
    box = Box.from_pixels(0, 0, side, side)
    sprite = Sprite(0, 0, cover, cover, cover, (0, 0), (0, 0), box, 1e3, 16.0, samples=samples)
    return NamedSprite("it", sprite, tracked=True)


class Drawer:
    """Draws a sprite for each frame, and fails at some frames."""

    def __init__(self, failing: Sequence[int] = ()) -> None:
        self.failing = failing
        self.drawn: list[int] = []

    def __call__(self, index: int) -> Iterator[NamedSprite]:
        if index in self.failing:
            raise ValueError(f"frame {index}")
        self.drawn.append(index)
        yield piece(index)


def given(drawer: Drawer, indices: Sequence[int], count: int = 100) -> list[float]:
    prefetch = Prefetch(drawer, count)
    return [float(prefetch.pieces(index)[0].sprite.alpha[0, 0]) for index in indices]


@pytest.mark.parametrize(
    "order",
    [
        range(100),
        range(3, 100),
        [index for begin in range(0, 100, 16) for index in range(begin, min(begin + 8, 100))],  # every other block
        [7, 3, 50, 49, 48],
        [0, 2, 4, 6, 8],
    ],
)
def test_each_frame_is_drawn_once_and_no_other(order: Sequence[int]) -> None:
    drawer = Drawer()
    assert given(drawer, order) == list(order)
    assert drawer.drawn == list(order)


@pytest.mark.parametrize(("share", "most"), [(0.3, 3), (1.2, 0)])
@pytest.mark.parametrize("instants", [0, 7])
def test_memory_of_kept_sprites_is_bounded(share: float, most: int, instants: int) -> None:
    """`share` of the bound for each frame, the instants of its exposure included; a larger frame is not kept."""
    side = round((share * PREFETCHED_PX / (1 + instants)) ** 0.5)
    prefetch = Prefetch(lambda index: [piece(index, side, instants)], 100)
    kept = []
    for index in range(40):
        assert prefetch.pieces(index)[0].sprite.alpha[0, 0] == index
        kept.append(len(prefetch._run.kept))
    assert max(kept) == most


def test_an_error_is_raised_in_its_own_frame() -> None:
    drawer = Drawer(failing=[5])
    prefetch = Prefetch(drawer, 100)
    for index in range(5):
        assert prefetch.pieces(index)[0].sprite.alpha[0, 0] == index
    with pytest.raises(ValueError, match="frame 5"):
        prefetch.pieces(5)
    assert prefetch.pieces(6)[0].sprite.alpha[0, 0] == 6


def test_frames_in_order_are_those_asked_for_alone() -> None:
    scenario = irsim.load("hiding")
    in_order, shuffled = Renderer(scenario), Renderer(scenario)
    frames = {index: shuffled.frame(index) for index in (57, *np.random.default_rng(1).permutation(range(45, 60)))}
    for index in [*range(45, 60), 51, 51, 52, 53]:
        (frame, truth), (other, expected) = in_order.frame(index), frames[index]
        np.testing.assert_array_equal(frame.image, other.image)
        assert truth == expected
