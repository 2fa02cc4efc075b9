"""Bounds of targets in recordings without a scenario: from measured noise and a Gaussian spot fitted to the pixels.

They are estimates, not the exact bounds of `irsim.bounds`: the noise is taken as white, of the temporal sigma that
`measure_noise` finds in the flattest window, and each target as an upright Gaussian, integrated over pixels, of one
width in all frames, centred at its truth but for one common offset. Amplitude and level are fitted in each frame.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from irsim.calibration.noise import measure_noise
from irsim.calibration.selection import read_frames, target_mask
from irsim.config.base import no_such
from irsim.errors import InputError
from irsim.render.fisher import position_covariance
from irsim.render.interval_error import GATE_PX, LEAST_D, predicted_errors
from irsim.types import Floats, Source, TargetBounds, frame_range

NOISE_FRAMES = 100
"""Largest number of frames in which the noise is measured, the first ones."""
FITTED = 40
"""Largest number of frames, evenly spread, to which the width of a target is fitted."""
REACH_PX = 4
"""Distance from a target's box to the edge of its region, px."""
LARGEST_PX = 32
"""Largest side of a box that a Gaussian spot stands for, px."""


class _Patch(NamedTuple):
    """Region of a target in a frame: its first column and row, counts (rows, cols), and the true centre in it, px."""

    frame: int
    x0: int
    y0: int
    counts: Floats
    center: tuple[float, float]


def measured_bounds(
    source: Source,
    targets: Sequence[str] | None = None,
    start: int = 0,
    stop: int | None = None,
    gate_px: float = GATE_PX,
) -> tuple[list[TargetBounds], float]:
    """Return the bounds of targets in frames start .. stop-1, by frame and target, and the measured sigma, counts.

    Frames in which a target is hidden, out of view or larger than `LARGEST_PX` have none. InputError without truth, for
    unknown targets, for targets without such a frame, and where no noise can be measured.
    """
    if not source.has_truth:
        raise InputError(f"{source.name}: holds no scenario and no truth; allowed: a recording with one of them")
    frames = frame_range(start, stop, len(source))
    noisy = range(frames.start, min(frames.stop, frames.start + NOISE_FRAMES))
    counts, times = read_frames(source, noisy)
    taken = target_mask(source, noisy.start, noisy.stop)
    report = measure_noise(counts, source.rate_hz, None, 2.0**source.bits - 1, taken, times, noisy.start)
    sigma = report.temporal.pair.value
    if not sigma > 0:
        raise InputError(f"{source.name}: no temporal noise is measured; allowed: a recording of a noisy detector")
    patches = _patches(source, frames)
    names = list(patches) if targets is None else list(targets)
    known = list(dict.fromkeys(target.id for truth in source.truths() for target in truth.targets))
    rows: list[TargetBounds] = []
    for name in names:
        if name not in known:
            raise InputError(f"target: {no_such(name, known)}")
        if name not in patches:
            raise InputError(f"target {name}: is small and in view in none of the frames {frames.start}:{frames.stop}")
        rows += _bounds_of(name, patches[name], sigma, gate_px)
    return sorted(rows, key=lambda row: row.index), sigma


def _patches(source: Source, frames: range) -> dict[str, list[_Patch]]:
    """Return the regions of each target in which it is visible and whole."""
    columns, rows = source.size
    found: dict[str, list[_Patch]] = {}
    for frame, truth in source.pairs(frames.start, frames.stop):
        if truth is None:
            continue
        for target in truth.targets:
            box, (cx, cy) = target.box, target.center
            half = math.ceil(max(box.w, box.h) / 2) + REACH_PX
            x0, y0 = round(cx) - half, round(cy) - half
            x1, y1 = x0 + 2 * half + 1, y0 + 2 * half + 1
            inside = x0 >= 0 and y0 >= 0 and x1 <= columns and y1 <= rows
            if inside and not target.hidden and max(box.w, box.h) <= LARGEST_PX:
                counts = np.asarray(frame.image[y0:y1, x0:x1], np.float64)
                found.setdefault(target.id, []).append(_Patch(truth.index, x0, y0, counts, (cx - x0, cy - y0)))
    return found


def _bounds_of(name: str, patches: Sequence[_Patch], sigma: float, gate_px: float) -> list[TargetBounds]:
    theta = _fitted(patches)
    rows = []
    for patch in patches:
        spot, along, down = _spot(patch, theta)
        amplitude = _weights(spot, patch.counts)[0]
        parts = np.stack([amplitude * along, amplitude * down, amplitude * spot, np.ones_like(spot)]).reshape(4, -1)
        J = parts @ parts.T / sigma**2
        covariance, level = position_covariance(J[:3, :3]), position_covariance(J)
        if covariance is None:
            continue
        d = math.sqrt(J[2, 2])
        sd_x, sd_y = np.sqrt(np.diag(covariance)).tolist()
        predicted = predicted_errors(covariance, d, gate_px) if d < LEAST_D else (None, None)
        background = (None, None) if level is None else np.sqrt(np.diag(level)).tolist()
        rows.append(
            TargetBounds(
                index=patch.frame,
                target=name,
                sd_x=sd_x,
                sd_y=sd_y,
                sd_xy=float(covariance[0, 1]),
                d=d,
                sd_x_background=background[0],
                sd_y_background=background[1],
                region=(patch.x0, patch.y0, *patch.counts.shape[::-1]),
                predicted_x=predicted[0],
                predicted_y=predicted[1],
            )
        )
    return rows


def _fitted(patches: Sequence[_Patch]) -> Floats:
    """Return the widths and the offset (sigma x, sigma y, x, y), px, of least squares over frames."""
    from scipy.optimize import least_squares

    step = -(-len(patches) // FITTED)
    used = patches[::step]

    def residual(theta: Floats) -> Floats:
        return np.concatenate([_residual(patch, theta) for patch in used])

    side = used[0].counts.shape[0] / 4
    starts = ([width, width, 0.0, 0.0] for width in (0.6, 0.5 * side))
    limits = ([0.25, 0.25, -2.0, -2.0], [side + 0.5, side + 0.5, 2.0, 2.0])
    found = [least_squares(residual, np.clip(each, *limits), bounds=limits) for each in starts]
    return np.asarray(min(found, key=lambda each: float(each.cost)).x)


def _residual(patch: _Patch, theta: Floats) -> Floats:
    spot, _, _ = _spot(patch, theta)
    amplitude, level = _weights(spot, patch.counts)
    return (patch.counts - amplitude * spot - level).ravel()


def _weights(spot: Floats, counts: Floats) -> tuple[float, float]:
    """Return amplitude and level of least squares."""
    centred = spot - spot.mean()
    amplitude = float((centred * counts).sum() / max(float((centred**2).sum()), 1e-12))
    return amplitude, float(counts.mean() - amplitude * spot.mean())


def _spot(patch: _Patch, theta: Floats) -> tuple[Floats, Floats, Floats]:
    """Return a Gaussian of volume 1, integrated over pixels, and its derivatives by its centre x, y, (rows, cols)."""
    from scipy.special import ndtr

    sides = []
    for count, at, sigma in zip(patch.counts.shape[::-1], np.add(patch.center, theta[2:]), theta[:2], strict=True):
        edges = (np.arange(count + 1) - 0.5 - at) / sigma
        sides.append((np.diff(ndtr(edges)), -np.diff(np.exp(-(edges**2) / 2)) / (sigma * math.sqrt(2 * math.pi))))
    (across, by_x), (upright, by_y) = sides
    return np.outer(upright, across), np.outer(upright, by_x), np.outer(by_y, across)
