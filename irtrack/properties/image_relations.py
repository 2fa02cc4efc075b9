"""Metamorphic relations: a known change of the images must change the estimates in a known way."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from hypothesis import strategies as st

from irsim.types import Floats, Image
from irtrack.properties.case import BACKGROUND_GREY, Case, Clip, expect_near

SAME_PX = 0.5
"""Tolerance of equal positions, px, since grey levels are rounded."""
MIRRORED_PX = 1.1
"""Tolerance of mirrored positions, px: a window of whole pixels may lie half a pixel to either side of the target."""


def shift(case: Case) -> None:
    """A shift of the picture by whole pixels shifts the estimates with it."""
    clip = case.clip()
    right, down = case.draw("right", st.integers(-12, 12)), case.draw("down", st.integers(-10, 10))
    moved = clip.with_images(lambda images: np.roll(images, (down, right), (1, 2)))
    moved = moved.with_centers(lambda places: places + np.array([right, down]))
    _compare(case, clip, moved, lambda places: places - np.array([right, down]), SAME_PX, f"moved by ({right}, {down})")


def flip(case: Case) -> None:
    """A mirrored picture mirrors the estimates."""
    clip = case.clip()
    axis = case.draw("axis", st.sampled_from([0, 1]))
    edge = clip.size[axis] - 1

    def mirror(places: Floats) -> Floats:
        mirrored = places.copy()
        mirrored[..., axis] = edge - mirrored[..., axis]
        return mirrored

    mirrored = clip.with_images(lambda images: np.flip(images, 2 - axis)).with_centers(mirror)
    _compare(case, clip, mirrored, mirror, MIRRORED_PX, f"mirrored in {'xy'[axis]}")


def transpose(case: Case) -> None:
    """A transposed picture exchanges x and y of the estimates."""
    clip = case.clip()

    def turn(places: Floats) -> Floats:
        return places[..., ::-1].copy()

    turned = clip.with_images(lambda images: images.transpose(0, 2, 1)).with_centers(turn, turned=True)
    _compare(case, clip, turned, turn, MIRRORED_PX, "transposed")


def offset(case: Case) -> None:
    """A uniform change of brightness does not change the estimates."""
    by = case.draw("by", st.integers(-20, 40))
    _regrey(case, lambda images: np.clip(images.astype(np.int16) + by, 0, 255).astype(np.uint8), f"{by:+} grey")


def gain(case: Case) -> None:
    """A change of contrast does not change the estimates."""
    by = case.draw("quarters", st.integers(2, 6)) / 4

    def stretch(images: Image) -> Image:
        grey = BACKGROUND_GREY + by * (images.astype(np.float32) - BACKGROUND_GREY)
        stretched: Image = np.clip(np.rint(grey), 0, 255).astype(np.uint8)
        return stretched

    _regrey(case, stretch, f"contrast times {by:g}")


def polarity(case: Case) -> None:
    """The negative picture gives the same estimates: hot and cold targets are equal."""
    _regrey(case, lambda images: 255 - images, "negative")


def depth(case: Case) -> None:
    """Counts of 14 bits with the same content as 8 bits give the same estimates."""
    clip = case.clip()
    deep = clip.with_images(lambda images: images.astype(np.uint16) * 64, bits=14)
    _compare(case, clip, deep, lambda places: places, SAME_PX, "as 14 bits")


def distractor(case: Case) -> None:
    """A copy of the target in a far corner of the picture has no effect."""
    clip = case.clip(speed=(1, 2))
    right, down = case.draw("side", st.sampled_from([(1, 1), (1, -1), (-1, 1), (-1, -1)]))
    shape = clip.images.shape[1:]
    box, reach = clip.box, 4
    top, left = (max(round(c - s / 2) - reach, 0) for c, s in ((box.cy, box.h), (box.cx, box.w)))
    patch = clip.images[0, top : top + round(box.h) + 2 * reach, left : left + round(box.w) + 2 * reach]
    row = 1 if down < 0 else shape[0] - 1 - patch.shape[0]
    column = 1 if right < 0 else shape[1] - 1 - patch.shape[1]

    def beside(images: Image) -> Image:
        changed = images.copy()
        changed[:, row : row + patch.shape[0], column : column + patch.shape[1]] = patch
        return changed

    _compare(case, clip, clip.with_images(beside), lambda places: places, SAME_PX, "a copy in a corner")


def _regrey(case: Case, change: Callable[[Image], Image], how: str) -> None:
    clip = case.clip()
    _compare(case, clip, clip.with_images(change), lambda places: places, SAME_PX, how)


def _compare(
    case: Case, clip: Clip, changed: Clip, back: Callable[[Floats], Floats], tolerance: float, how: str
) -> None:
    """Raise Broken where the estimates of the changed clip, transformed back, are not those of the clip."""
    expect_near(back(case.centers(changed)), case.centers(clip), tolerance, how)
