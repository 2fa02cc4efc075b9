"""Clips: short rendered scenes held in memory, and what can be done to their pictures."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

import irsim
from irsim import strategies
from irsim.types import Box, Floats, Frame, Image

SIZE, FRAMES = (128, 96), 30
BACKGROUND_GREY, TARGET_GREY = 51, 176
"""Of the flat sky of 285 K and the patch of 305 K, by the AGC of `CAMERA`: pictures can be made brighter, stretched
and turned to their negative without running into black or white."""
CAMERA: Mapping[str, Any] = {"agc": {"kind": "fixed", "low": 0, "high": 9000}}


@dataclass(frozen=True, eq=False)
class Clip:
    """Frames, where the target is in each, and the box in which it starts.

    images    (n, rows, cols), read-only;  times (n,) s;  bits of the images
    centers   (n, 2) px of the target;  visible (n,) share of it that is seen, 0 where it is absent
    text      the scenario as YAML
    first     index of the first frame
    """

    images: Image
    times: Floats
    centers: Floats
    visible: Floats
    box: Box
    text: str
    bits: int = 8
    first: int = 0

    def __len__(self) -> int:
        return len(self.images)

    def frame(self, k: int) -> Frame:
        return Frame(self.images[k], self.first + k, float(self.times[k]), self.bits)

    @property
    def size(self) -> tuple[int, int]:
        """(columns, rows)."""
        return self.images.shape[2], self.images.shape[1]

    def pictured(self, change: Callable[[Image], Image], bits: int = 8) -> Clip:
        """The clip with other pictures; `change` takes all of them at once."""
        return replace(self, images=_frozen(np.ascontiguousarray(change(self.images))), bits=bits)

    def placed(self, move: Callable[[Floats], Floats], turned: bool = False) -> Clip:
        """The clip with the places of its target moved; turned: width and height change places."""
        (cx, cy), (w, h) = move(np.array([[self.box.cx, self.box.cy]]))[0], (self.box.w, self.box.h)
        return replace(self, centers=move(self.centers), box=Box(cx, cy, *((h, w) if turned else (w, h))))

    def chosen(self, indices: list[int]) -> Clip:
        """The clip of some of its frames, in an order of one's own, at their times."""
        kept = {name: getattr(self, name)[indices] for name in ("times", "centers", "visible")}
        return replace(self, images=_frozen(self.images[indices]), **kept)


def _frozen(images: Any) -> Image:
    images.setflags(write=False)
    frozen: Image = images
    return frozen


def scene(seed: int, noise: int = 2, speed: int = 3, heading: int = 0, **changes: Any) -> dict[str, Any]:
    """A scene as `Case.clip` draws them, by severities: a patch of 14 x 10 px on its straight way."""
    path = strategies.scenes.straight(strategies.scenes.SPEEDS[speed], 45.0 * heading, SIZE, FRAMES)
    camera = {"size": list(SIZE), "ifov_mrad": 0.5, "range_k": [270.0, 330.0], "noise": [{"kind": "white"}]}
    return {
        "seed": seed,
        "frames": FRAMES,
        "camera": {**camera, "netd_mk": strategies.scenes.NETD_MK[noise], **CAMERA},
        "background": {"kind": "sky", "horizon_k": 285.0, "zenith_k": 285.0},
        "targets": [{"id": "target", "shape": dict(strategies.scenes.HOT_SPOT), "path": path}],
        "follow": "target",
    } | changes


def rendered(document: Mapping[str, Any]) -> Clip:
    """The clip of a scenario as YAML has it; the same for the same one, so that it is rendered once."""
    return _rendered(irsim.dumps(irsim.build(irsim.Scenario, document, "scene"), short=True))


@lru_cache(maxsize=256)
def _rendered(text: str) -> Clip:
    pairs = list(irsim.open_source(irsim.loads(text)).pairs(input="display"))
    truths = [None if truth is None else truth.target("target") for _, truth in pairs]
    start = truths[0]
    assert start is not None
    far = np.array([np.nan, np.nan])
    return Clip(
        images=_frozen(np.stack([frame.image for frame, _ in pairs])),
        times=np.array([frame.time for frame, _ in pairs]),
        centers=np.array([far if truth is None else truth.center for truth in truths]),
        visible=np.array([0.0 if truth is None else truth.visible for truth in truths], dtype=np.float64),
        box=start.box,
        text=text,
    )
