"""Sprites are drawn ahead only where frames are requested in order, and kept in bounded memory."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import pytest

import irsim
from irsim.geometry.sprite import Sprite
from irsim.render.composite import NamedSprite
from irsim.render.exposure import Prefetch
from irsim.render.frame import Renderer
from irsim.types import Box


def piece(index: int) -> NamedSprite:
    cover = np.full((4, 4), float(index))
    sprite = Sprite(0, 0, cover, cover, cover, (0, 0), (0, 0), Box.from_pixels(0, 0, 4, 4), 1e3, 16.0)
    return NamedSprite("it", sprite, tracked=True)


class Drawer:
    """Drawer of a sprite for each frame, which fails at some frames."""

    def __init__(self, failing: Sequence[int] = ()) -> None:
        self.failing = failing
        self.drawn: list[int] = []

    def __call__(self, index: int) -> Iterator[NamedSprite]:
        if index in self.failing:
            raise ValueError(f"frame {index}")
        self.drawn.append(index)
        yield piece(index)


@pytest.mark.parametrize(
    "order",
    [
        range(3, 100),
        [index for begin in range(0, 100, 16) for index in range(begin, min(begin + 8, 100))],  # every other block
        [7, 3, 50, 49, 48, 2, 4, 6],
    ],
)
def test_each_frame_is_drawn_once_and_no_other(order: Sequence[int]) -> None:
    drawer = Drawer()
    prefetch = Prefetch(drawer, 100)
    assert [prefetch.pieces(index)[0].sprite.alpha[0, 0] for index in order] == list(order)
    assert drawer.drawn == list(order)


def test_an_error_is_raised_in_its_own_frame() -> None:
    prefetch = Prefetch(Drawer(failing=[5]), 100)
    assert [prefetch.pieces(index)[0].sprite.alpha[0, 0] for index in range(5)] == list(range(5))
    with pytest.raises(ValueError, match="frame 5"):
        prefetch.pieces(5)
    assert prefetch.pieces(6)[0].sprite.alpha[0, 0] == 6


def test_frames_in_order_equal_frames_alone() -> None:
    scenario = irsim.load("decoys")
    in_order, shuffled = Renderer(scenario), Renderer(scenario)
    frames = {index: shuffled.frame(index) for index in (7, *np.random.default_rng(1).permutation(range(2, 10)))}
    for index in [*range(2, 10), 5, 5, 6, 7]:
        (frame, truth), (other, expected) = in_order.frame(index), frames[index]
        np.testing.assert_array_equal(frame.image, other.image)
        assert truth == expected
