"""Things of frames are drawn ahead where frames are asked for in order, and only there."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import pytest

import irsim
from irsim.geometry.sprite import ExposureSamples, Sprite
from irsim.render.composite import Piece
from irsim.render.frame import Renderer
from irsim.render.prefetch import MOST_PX, TOGETHER, Ahead
from irsim.types import Box


def piece(index: int, side: int = 4, instants: int = 0) -> Piece:
    field = np.full((side, side), float(index))
    still = np.zeros((instants, side, side))
    samples = ExposureSamples(still, still, still, whole=True) if instants else None
    box = Box.from_pixels(0, 0, side, side)
    return Piece("it", Sprite(0, 0, field, field, field, (0, 0), (0, 0), box, 1e3, 16.0, samples=samples), tracked=True)


class Drawer:
    """Draws pieces of a side, px, and fails at some frames."""

    def __init__(self, side: int = 4, failing: Sequence[int] = ()) -> None:
        self.side, self.failing = side, failing
        self.drawn: list[int] = []

    def __call__(self, index: int) -> Iterator[Piece]:
        if index in self.failing:
            raise ValueError(f"frame {index}")
        self.drawn.append(index)
        yield piece(index, self.side)


def asked(drawer: Drawer, indices: Sequence[int], count: int = 100) -> list[float]:
    ahead = Ahead(drawer, count)
    return [float(ahead.pieces(index)[0].sprite.alpha[0, 0]) for index in indices]


@pytest.mark.parametrize("begin", [0, 3, 64])
def test_in_order_each_frame_is_drawn_once_and_none_beyond_the_last(begin: int) -> None:
    drawer, order = Drawer(), range(begin, 100)
    assert asked(drawer, order) == list(order)
    assert drawer.drawn == list(order)


@pytest.mark.parametrize("length", [1, 2, 4, 8, 16, 64])
def test_chunks_of_frames_draw_nothing_in_vain(length: int) -> None:
    drawer = Drawer()
    order = [index for begin in range(0, 640, 2 * length) for index in range(begin, begin + length)]
    assert asked(drawer, order, 640) == order
    assert drawer.drawn == order


def test_after_eight_frames_in_order_eight_are_drawn_together() -> None:
    drawer = Drawer()
    ahead = Ahead(drawer, 100)
    for index in range(20, 29):
        ahead.pieces(index)
    assert drawer.drawn == list(range(20, 28 + TOGETHER))


@pytest.mark.parametrize("order", [[7, 3, 50, 49, 48], [0, 2, 4, 6, 8], [5, 5, 5]])
def test_out_of_order_nothing_is_drawn_ahead(order: list[int]) -> None:
    drawer = Drawer()
    assert asked(drawer, order) == order
    assert drawer.drawn == list(dict.fromkeys(order))


@pytest.mark.parametrize(("share", "most"), [(0.22, 4), (0.3, 3), (0.6, 1), (1.2, 1)])
@pytest.mark.parametrize("instants", [0, 7])
def test_no_more_is_kept_than_caches_hold(share: float, most: int, instants: int) -> None:
    """Of the pixels that may be kept each frame has such a share; also where the exposure takes time. A frame that is
    larger by itself is not kept."""
    side = round((share * MOST_PX / (1 + instants)) ** 0.5)
    ahead = Ahead(lambda index: [piece(index, side, instants)], 100)
    kept = []
    for index in range(40):
        assert ahead.pieces(index)[0].sprite.alpha[0, 0] == index
        kept.append(len(ahead._run.kept))
    assert max(kept) == (most if share < 1 else 0)


def test_what_cannot_be_drawn_is_told_when_it_is_asked_for() -> None:
    drawer = Drawer(failing=[5])
    ahead = Ahead(drawer, 100)
    for index in range(5):
        assert ahead.pieces(index)[0].sprite.alpha[0, 0] == index
    with pytest.raises(ValueError, match="frame 5"):
        ahead.pieces(5)
    assert ahead.pieces(6)[0].sprite.alpha[0, 0] == 6


def test_frames_in_order_are_those_asked_for_alone() -> None:
    scenario = irsim.load("hiding")
    in_order, shuffled = Renderer(scenario), Renderer(scenario)
    frames = {
        index: shuffled.frame(index) for index in (57, *np.random.default_rng(1).permutation(range(40, 60)).tolist())
    }
    for index in [*range(40, 60), 51, 51, 52, 53]:
        (frame, truth), (other, expected) = in_order.frame(index), frames[index]
        np.testing.assert_array_equal(frame.image, other.image)
        assert truth == expected
