"""Properties of tracking: the tracker stays on an easy target, also after small disturbances."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import strategies as st

from irsim.types import Box
from irtrack.properties.case import Broken, Case, Clip, NotAsked, expect_near

HELD_PX = 2.0
"""Largest distance from an easy target, px: a fifth of its height."""
NEAR_PX = 5.0
"""Largest distance after a disturbance, px: half of the target's height."""
SETTLED = 20
"""Index of the first frame in which a disturbance must have no effect."""


def follows(case: Case) -> None:
    """The tracker follows a target on a straight path before a uniform sky."""
    clip = case.clip()
    expect_near(case.centers(clip), clip.centers[1:], HELD_PX, "from the target")


def rests(case: Case) -> None:
    """The tracker does not drift off a stationary target."""
    clip = case.clip(speed=(0, 0))
    expect_near(case.centers(clip), clip.centers[1:], HELD_PX, "from the target")


def size(case: Case) -> None:
    """The estimated size of a target of constant size stays constant, within a factor of 1.5."""
    clip = case.clip()
    sizes = np.stack([each.sizes for each in case.walks(clip)])[:, -1]
    ratio = np.median(sizes / np.array([clip.box.w, clip.box.h]), axis=0)
    if (np.abs(np.log(ratio)) > np.log(1.5)).any():
        raise Broken(
            f"at the end ({ratio[0]:.2f}, {ratio[1]:.2f}) times the target's size; allowed: within a factor of 1.5"
        )


def start_place(case: Case) -> None:
    """A start box two pixels off the target does not cause track loss."""
    clip = case.clip()
    right, down = case.draw("right", st.integers(-2, 2)), case.draw("down", st.integers(-2, 2))
    box = Box(clip.box.cx + right, clip.box.cy + down, clip.box.w, clip.box.h)
    _expect_held(case, replace(clip, box=box), NEAR_PX, f"begun ({right}, {down}) px off")


def start_size(case: Case) -> None:
    """A start box a quarter too large or a fifth too small does not cause track loss."""
    clip = case.clip()
    factor = case.draw("factor", st.sampled_from([1.0, 1.25, 0.8]))
    box = Box(clip.box.cx, clip.box.cy, clip.box.w * factor, clip.box.h * factor)
    _expect_held(case, replace(clip, box=box), NEAR_PX, f"begun with a box {factor:g} times as large")


def duplicates(case: Case) -> None:
    """Duplicated frames with equal times do not cause track loss."""
    clip = case.clip()
    twice = case.draw("frames", st.lists(st.integers(3, 15), min_size=1, max_size=4, unique=True))
    _expect_held(case, clip.select(sorted([*range(len(clip)), *twice])), NEAR_PX, "with doubled frames")


def drops(case: Case) -> None:
    """Individual dropped frames do not cause track loss."""
    clip = case.clip(speed=(2, 3))
    lost = case.draw("frames", st.lists(st.sampled_from([3, 6, 9, 12]), min_size=1, max_size=4, unique=True))
    kept = [k for k in range(len(clip)) if k not in lost]
    _expect_held(case, clip.select(kept), NEAR_PX, "with frames lost")


def reacquires(case: Case) -> None:
    """The tracker reacquires a target after an occlusion of four frames."""
    clip = occluded(case.clip(speed=(2, 2)), 8, 12)
    _expect_held(case, clip, NEAR_PX, "after an occlusion of four frames")


def velocity(case: Case) -> None:
    """The estimated velocity is that of the target, within 0.75 px a frame on average."""
    clip = case.clip(speed=(3, 4))
    walks = case.walks(clip)
    if walks[0].estimates[-1].velocity is None:
        raise NotAsked("it gives no velocity")
    estimated = np.array([[each.velocity for each in walk.estimates[SETTLED:]] for walk in walks], dtype=np.float64)
    true = np.diff(clip.centers, axis=0)[SETTLED:]
    off = float(np.hypot(*(estimated - true).mean(axis=(0, 1))))
    if off > 0.75:
        raise Broken(f"{off:.2f} px a frame from the target's velocity on average; allowed: 0.75")


def occluded(clip: Clip, first: int, stop: int) -> Clip:
    """Return the clip with its target covered in frames first .. stop-1 by noisy sky of the same frame."""
    images = clip.images.copy()
    box, margin = clip.box, 4
    rows, columns = round(box.h) + 2 * margin, round(box.w) + 2 * margin
    for k in range(first, stop):
        top, left = (
            round(float(c) - s / 2) - margin for c, s in ((clip.centers[k, 1], box.h), (clip.centers[k, 0], box.w))
        )
        sky = clip.images[k, :rows, :columns]  # the target stays away from the corner
        images[k, top : top + rows, left : left + columns] = sky
    visible = clip.visible.copy()
    visible[first:stop] = 0.0
    return replace(clip.with_images(lambda _: images), visible=visible)


def _expect_held(case: Case, clip: Clip, tolerance: float, how: str) -> None:
    """Raise Broken where the track is farther than `tolerance` px from the target from frame `SETTLED` on."""
    expect_near(case.centers(clip)[:, SETTLED:], clip.centers[SETTLED + 1 :], tolerance, how)
