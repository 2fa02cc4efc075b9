"""Properties of detectors: known points are detected, and a known change of the picture changes the detections in the
same way."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from hypothesis import strategies as st

from irsim.types import Box, Floats
from irtrack.metrics.masks import CENTROID_PX
from irtrack.properties.case import SCR, Broken, Case, Clip, NotAsked, walk

SAME_PX = 0.5
"""Tolerance of equal places, px: noise and a registration change with the picture."""
WARM_UP = 6
"""Frames that a detector with a memory may take before its first detections."""
FEW = 0.1
"""Share of the points, over frames, that may be found in one of two pictures only, or be missed."""
PAIRS = ((44.0, 40.0), (51.0, 44.0), (104.0, 82.0), (110.0, 76.0))
"""Places of two pairs of points in frame 0, px, 8 px from each other."""


def finds(case: Case) -> None:
    """Points far above the noise are detected."""
    missed = np.isnan(_offsets(case, case.points())).any(axis=-1).mean()
    if missed > FEW:
        raise Broken(f"{missed:.0%} of the points of an SCR of {SCR:g} or more are missed; allowed: {FEW:.0%}")


def shift(case: Case) -> None:
    """A shift of the picture by whole pixels shifts the detections with it."""
    clip = case.points()
    right, down = case.draw("right", st.integers(-8, 8)), case.draw("down", st.integers(-8, 8))
    moved = clip.with_images(lambda images: np.roll(images, (down, right), (1, 2)), clip.bits)
    moved = moved.with_centers(lambda places: places + np.array([right, down]))
    _compare(case, clip, moved, lambda offsets: offsets, f"moved by ({right}, {down})")


def flip(case: Case) -> None:
    """A mirrored picture mirrors the detections."""
    clip = case.points()
    axis = case.draw("axis", st.sampled_from([0, 1]))
    signs = np.array([-1.0, 1.0]) if axis == 0 else np.array([1.0, -1.0])
    edge = np.where(signs < 0, np.array(clip.size) - 1.0, 0.0)
    mirrored = clip.with_images(lambda images: np.flip(images, 2 - axis), clip.bits)
    mirrored = mirrored.with_centers(lambda places: signs * places + edge)
    _compare(case, clip, mirrored, lambda offsets: signs * offsets, f"mirrored in {'xy'[axis]}")


def order(case: Case) -> None:
    """Turned by 180 degrees, a picture gives the same detections of points close together."""
    clip = case.points(PAIRS, SCR)
    edge = np.array(clip.size) - 1.0
    turned = clip.with_images(lambda images: images[:, ::-1, ::-1], clip.bits)
    turned = turned.with_centers(lambda places: edge - places)
    _compare(case, clip, turned, lambda offsets: -offsets, "turned by 180 degrees")


def gain(case: Case) -> None:
    """Counts times a factor give the same detections."""
    if not case.tracker.scale_invariant:  # type: ignore[attr-defined]  # a `DetectorSubject`
        raise NotAsked("it does not declare scale_invariant = True")
    clip = case.points()
    by = case.draw("by", st.integers(2, 3))
    brighter = clip.with_images(lambda images: (images * by).astype(np.uint16), 16)
    _compare(case, clip, brighter, lambda offsets: offsets, f"counts times {by}")


def empty(case: Case) -> None:
    """Frames of one grey level have no detection."""
    level = case.draw("level", st.integers(0, 2**14 - 1))
    images = np.full((8, 96, 128), level, np.uint16)
    clip = Clip(images, np.arange(8) / 30, np.zeros((8, 1, 2)), np.zeros(8), Box(64, 48, 5, 5), "", 14)
    for k, found in enumerate(walk(case.tracker, clip).estimates, 1):
        if len(found):
            raise Broken(f"{len(found)} detections in frame {k}, of {level} counts everywhere")


def _offsets(case: Case, clip: Clip) -> Floats:
    """Return the offsets (n, m, 2) px of the nearest detection from each point; nan where none is within 3 px."""
    offsets = np.full(clip.centers[WARM_UP:].shape, np.nan)
    for k, found in enumerate(walk(case.tracker, clip).estimates[WARM_UP - 1 :]):
        for m, place in enumerate(clip.centers[WARM_UP + k]):
            apart = found.centers - place
            distance = np.hypot(apart[:, 0], apart[:, 1])
            if len(found) and distance.min() <= CENTROID_PX:
                offsets[k, m] = apart[distance.argmin()]
    return offsets


def _compare(case: Case, clip: Clip, changed: Clip, back: Callable[[Floats], Floats], how: str) -> None:
    """Raise Broken unless the detections of points in the changed clip, transformed back, are those in the clip."""
    one, other = _offsets(case, clip), back(_offsets(case, changed))
    differ = (np.isnan(one) != np.isnan(other)).any(axis=-1).mean()
    if differ > FEW:
        raise Broken(f"{how}: {differ:.0%} of the points are detected in one of the two only; allowed: {FEW:.0%}")
    both = ~np.isnan(one + other).any(axis=-1)
    off = np.hypot(*(one - other)[both].T)
    if len(off) and np.mean(off > SAME_PX) > FEW:
        raise Broken(f"{how}: detections are off by {np.median(off):.2g} px (median); allowed: {SAME_PX:g}")
