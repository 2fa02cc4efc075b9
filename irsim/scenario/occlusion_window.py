"""Window that an occluder must cover to hide a target in given frames, and the occlusion that results."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from irsim.geometry.sprite import Sprite
from irsim.occluders import Occluder, Opaque
from irsim.occluders.base import required
from irsim.scenario.visibility import TargetVisibility
from irsim.types import Box, Floats

MARGIN_PX = 1.0
"""Margin of an occluder around the area that it hides, px, so that it covers the pixels at that area's edge wholly."""
STILL_PX = 0.02
"""Displacement per frame, px, below which a target counts as standing still behind an occluder."""
_NEGLIGIBLE = 1e-3
"""Fraction of a target's area on each side that may lie outside the window: the faint edge of a point's PSF."""
TOLERANCE = 0.02
"""Relative shortfall of the occluded fraction up to which a frame still counts as occluded. Outside of the required
frames an occluded fraction below TOLERANCE counts as 0."""
MAX_LENGTH_RATIO = 2
FEW_FRAMES = 4
"""An occlusion is reported as too long if it lasts longer than MAX_LENGTH_RATIO times the required frames, or than
FEW_FRAMES more than these if that is longer. Frames in which the target passes the margins, or in which smoke grows or
fades, are added to this limit.

A target with thin ends stays almost fully occluded for as long as it takes to move by its own length: a tank of 73 px
at 0.5 px a frame is hidden in 37 frames where 5 are required.
"""
MAX_EXCESS = 0.2
"""An occlusion is reported as too strong if its fraction exceeds the required one by more than this."""


class InfeasibleError(ValueError):
    """Impossible placement or crossing, with the key at fault and the reason."""

    def __init__(self, key: str, reason: str) -> None:
        super().__init__(reason)
        self.key = key


def no_frame(frame: float, frames: int) -> str:
    """Return the message for a frame number after the last frame."""
    return (
        f"there is no frame {frame:g}; allowed: 0 to {frames - 1}, or more frames, of which the first {frames} can be "
        "rendered alone (stop=N)"
    )


def target_and_frames(occluder: Occluder) -> tuple[str, tuple[int, int]]:
    """Return the id of the target to hide, and the first and last frame; ValueError if it is not placed to hide one."""
    return required(occluder.hides), required(occluder.frames)


def occlusion_window(visibility: TargetVisibility, occluder: Occluder) -> Box:
    """Return the box that the occluder must cover, px of the camera at rest, at the occluder's range. Raises
    InfeasibleError where there is no such box."""
    name, (first, last) = target_and_frames(occluder)
    boxes = []
    for frame in range(first, last + 1):
        sprite = visibility.sprite(name, frame)
        if sprite is None:
            raise InfeasibleError("frames", f"{name} does not exist in frame {frame}; allowed: frames in which it does")
        if not visibility.scenario.camera.geometry.inside(*sprite.center):
            raise InfeasibleError(
                "frames", f"{name} is outside the picture in frame {frame}; allowed: frames in which it is inside"
            )
        range_m = visibility.range_from_origin_m(name, frame, sprite)
        if range_m <= occluder.range_m:
            raise InfeasibleError(
                "range_m",
                f"{name} is at {range_m:.0f} m in frame {frame}, nearer than {occluder.range_m:.0f} m; "
                "allowed: less than its range",
            )
        for at in visibility.exposure:
            corners = at.in_first_view(_corners(at.sprite(name, frame) or sprite), occluder.range_m, frame)
            if not np.isfinite(corners).all():
                raise InfeasibleError(
                    "hides",
                    f"the position of {name} in frame {frame} is behind the camera of frame 0; allowed: an occluder at "
                    "a place",
                )
            boxes.append((*corners.min(axis=0), *corners.max(axis=0)))
    edges = np.array(boxes)
    low, high = edges[:, :2].min(axis=0) - MARGIN_PX, edges[:, 2:].max(axis=0) + MARGIN_PX
    return Box.from_edges(float(low[0]), float(low[1]), float(high[0]), float(high[1]))


def moves_vertically(visibility: TargetVisibility, occluder: Occluder) -> bool:
    """Return True if the target moves more vertically than horizontally while it is hidden."""
    name, (first, last) = target_and_frames(occluder)
    around = [max(first - 1, 0), min(last + 1, visibility.scenario.frames - 1)]
    across, down = np.abs(np.diff(visibility.line_of_sight_px(name, occluder.range_m)[around], axis=0)[0])
    return bool(down > across)


def target_speed_px(visibility: TargetVisibility, occluder: Occluder) -> float:
    """Return the target's median speed, px a frame, in the frames to hide it, projected to the occluder's range."""
    name, (first, last) = target_and_frames(occluder)
    pixels = visibility.line_of_sight_px(name, occluder.range_m)
    steps = np.hypot(*np.diff(pixels, axis=0).T) if len(pixels) > 1 else np.zeros(1)
    return float(np.median(steps[max(first - 1, 0) : last + 1]))


def _corners(sprite: Sprite) -> Floats:
    """Return the corners, px, (4, 2), of the box around a sprite, except the faint edge of its PSF."""
    ends = []
    for axis, origin in ((0, sprite.x0), (1, sprite.y0)):
        sums = np.cumsum(sprite.cover.sum(axis=axis))
        inside = np.flatnonzero(
            (sums > _NEGLIGIBLE * sums[-1]) & (sums - np.diff(sums, prepend=0.0) < (1 - _NEGLIGIBLE) * sums[-1])
        )
        ends.append((origin + inside[0] - 0.5, origin + inside[-1] + 0.5))
    (left, right), (top, bottom) = ends
    return np.array([[left, top], [right, top], [right, bottom], [left, bottom]])


@dataclass(frozen=True, eq=False)
class Occlusion:
    """Occlusion of a target by one placed occluder in every frame, as if there were no other occluder.

    screen    the placed occluder
    occluder  the occluder as the scenario writes it, with target, frames and fraction
    known     (frames,) occluded fractions if they are already computed, which takes long
    """

    visibility: TargetVisibility
    screen: Occluder
    occluder: Occluder
    known: Floats | None = None

    @cached_property
    def fractions(self) -> Floats:
        """Occluded fraction of the target in each frame, (frames,)."""
        if self.known is not None:
            return self.known
        name, _ = target_and_frames(self.occluder)
        frames = range(self.visibility.scenario.frames)
        return np.array([self.visibility.occluded([self.screen], name, frame) for frame in frames])

    @property
    def max_fraction(self) -> float:
        """Largest occluded fraction in the required frames."""
        _, (first, last) = target_and_frames(self.occluder)
        return float(self.fractions[first : last + 1].max())

    @property
    def enough(self) -> float:
        """Least occluded fraction that counts as the required one."""
        return self.occluder.fraction * (1 - TOLERANCE)

    def lasts_too_long(self) -> bool:
        """Return True if the occlusion recurs or lasts well beyond the required frames."""
        return self.recurs() is not None or self.too_long() is not None

    def recurs(self) -> str | None:
        """Return the error of an occluder that hides its target again, well outside the required frames, or None."""
        name, (first, last) = target_and_frames(self.occluder)
        slack = self._slack_frames()
        for frame in [*range(first - slack - 1, -1, -1), *range(last + slack + 1, self.visibility.scenario.frames)]:
            if self.fractions[frame] > TOLERANCE:
                return (
                    f"an occluder of {name} in frames {first} to {last} also hides {self.fractions[frame]:.2f} of it "
                    f"in frame {frame}; allowed: frames at whose ends the target enters and leaves, or smoke, or a "
                    "place"
                )
        return None

    def too_long(self) -> str | None:
        """Return the text of the warning about an occlusion longer than MAX_LENGTH_RATIO allows, or None."""
        name, (first, last) = target_and_frames(self.occluder)
        held = np.flatnonzero(self.fractions >= self.enough)
        wanted, speed = last - first + 1, target_speed_px(self.visibility, self.occluder)
        margins = 2 * MARGIN_PX / speed if speed > STILL_PX else 0.0
        allowed = max(MAX_LENGTH_RATIO * wanted, wanted + FEW_FRAMES) + math.ceil(margins)
        if len(held) <= allowed:
            return None
        return (
            f"it hides {self.enough:.2f} or more of {name} in {len(held)} frames, {held[0]} to {held[-1]}, instead of "
            f"{wanted}: {self._shorter(speed)}"
        )

    def too_much(self) -> str | None:
        """Return the text of the warning about an occluded fraction more than MAX_EXCESS above the required one, or
        None."""
        name, (first, last) = target_and_frames(self.occluder)
        fraction, fractions = self.occluder.fraction, self.fractions[first : last + 1]
        over = first + np.flatnonzero(fractions > fraction + MAX_EXCESS)
        if len(over) == 0:
            return None
        other = "" if self.occluder.translucent else ", or smoke"
        return (
            f"it hides up to {self.max_fraction:.2f} of {name} in frames {over[0]} to {over[-1]} instead of "
            f"{fraction:g}: try fewer frames{other}"
        )

    def _shorter(self, speed: float) -> str:
        """Return the proposed change for an occlusion that lasts too long."""
        kind = self.occluder.kind
        if "foot_px" in self.occluder.placement_keys and moves_vertically(self.visibility, self.occluder):
            return f"a {kind} stands on the ground; try a bar, or smoke"
        if self.occluder.translucent:
            return "try a shorter time to grow and to fade"
        other = "" if isinstance(self.occluder, Opaque) else ", a pole, which has straight sides"
        return f"it passes at {speed:.2g} px a frame; try a faster target, one farther away{other}, or a place"

    def _slack_frames(self) -> int:
        """Return the number of frames before and after the required ones in which the target may be partly occluded."""
        name, (first, _) = target_and_frames(self.occluder)
        speed, sprite = target_speed_px(self.visibility, self.occluder), self.visibility.sprite(name, first)
        window = occlusion_window(self.visibility, self.occluder)
        drawn = self.screen.draw(self.visibility.pose(first))
        excess = 0.0 if drawn is None else max(drawn.box.w - window.w, drawn.box.h - window.h, 0.0)
        size = 0.0 if sprite is None else sprite.box.diagonal
        offsets = [at.offset for at in self.visibility.exposure]
        exposure = max(offsets) - min(offsets)
        slack = math.ceil((size + excess + 6) / speed + exposure) if speed > STILL_PX else 0
        fades = (getattr(self.screen, key, 0.0) for key in ("grow_frames", "fade_frames"))
        return slack + math.ceil(max(fades))
