"""Cramér-Rao bounds on the position of targets, frame by frame, and the deflection of the ideal matched filter.

The parameters are x, y and the amplitude; shape, attitude and all else in the scene are known. D holds the derivatives
of the composite noiseless mean: central differences of the region rendered again with the target displaced by STEP_PX.
Occluders, other targets, blur, vignetting and saturation act on them as on the frame. V is the temporal noise (see
`irsim.render.fisher`): fixed patterns count as known.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from irsim.config.base import no_such
from irsim.errors import InputError, frame_number, is_number
from irsim.render.detectability import Detectability, whitened
from irsim.render.fisher import FrameNoise, needs_exact, pixel_information, position_covariance
from irsim.render.frame import NO_SHIFTS, Renderer
from irsim.render.interval_error import GATE_PX, LEAST_D, predicted_errors
from irsim.render.moments import Exact, MeanCounts, Region, region_slices
from irsim.render.sequence_bound import DRAWS, with_sequence_bounds
from irsim.scenario.model import Scenario, expect_scenario
from irsim.types import TargetBounds, frame_range

STEP_PX = 0.05
"""Displacement of the target to either side in central differences, px."""
LEAST_VARIANCE = 1e-9
"""Variance of temporal noise, counts², below which a pixel counts as without noise."""
MARGIN_PX = 1
"""Width by which the region of a target is larger than its sprite, px, for its displacements."""


class Derivatives(NamedTuple):
    """Derivatives of the composite mean, (3, rows, cols) counts per px, per px and per unit of amplitude.

    region  of the frame;  mean  (rows, cols) noiseless counts in it
    """

    region: Region
    values: Exact
    mean: Exact


class FrameInformation:
    """Fisher information on the targets of a scenario's frames.

    InputError for a recorded background, whose noise is unknown, and for a camera without temporal noise.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = expect_scenario("bounds", scenario)
        if scenario.background.has_noise:
            raise InputError(
                "background: the noise of a recording is not known; allowed: a background that is rendered"
            )
        self.renderer = Renderer(scenario)
        self._means = MeanCounts(self.renderer)
        self._light = lru_cache(maxsize=1)(self.renderer.light)
        self._variance = lru_cache(maxsize=1)(self._variance_of)
        self._weights = lru_cache(maxsize=1)(self._weights_of)
        self._patterns = lru_cache(maxsize=1)(self.renderer.sensor.fixed_offsets)

    def derivatives(self, frame: int, target: str, whole: bool = False) -> Derivatives | None:
        """Return the derivatives for a target in the scenario's frame `frame`; None where it adds nothing.

        whole   True: over the whole frame, to check that the region holds all
        """
        columns, rows = self.renderer.context.geometry.size
        region: Region | None = (0, 0, columns, rows)
        if not whole:
            region = self._means.touched(frame, target, NO_SHIFTS, (0, 0, columns, rows), MARGIN_PX)
        if region is None:
            return None

        def mean(x: float, y: float) -> Exact:
            shifts = {target: (x, y)} if x or y else NO_SHIFTS
            return np.asarray(self._means.of(frame, shifts, region=region), np.float64)

        own = mean(0, 0)
        added = own - self._means.without(frame, target, region)
        if not added.any():
            return None
        along = (mean(STEP_PX, 0) - mean(-STEP_PX, 0)) / (2 * STEP_PX)
        down = (mean(0, STEP_PX) - mean(0, -STEP_PX)) / (2 * STEP_PX)
        return Derivatives(region, np.stack([along, down, added]), own)

    def of(self, frame: int, derivatives: Derivatives, background: bool = False) -> Exact:
        """Return J (3, 3) of x, y and amplitude; with `background` also of one level of the region, (4, 4).

        Counts in the region have their exact information where noise is below `FINE_LSB` or counts are clipped.
        """
        sensor, (_, _, columns, rows) = self.renderer.sensor, derivatives.region
        shown, part = sensor.shown(frame), region_slices(derivatives.region)
        common = sensor.common_variance(shown)
        noise = FrameNoise(np.zeros((0, 0)), *common)
        if noise.has_common or not sensor.varies_by_signal:
            own = self._variance(shown)[part]
        else:
            own = np.asarray(sensor.temporal_variance(derivatives.mean, shown), np.float64)
        if not (own > 1 / 12 + LEAST_VARIANCE).any():
            raise InputError("camera: has no temporal noise; allowed: noise that changes from frame to frame, as white")
        mean, full = derivatives.mean, sensor.response.full
        if needs_exact(own, mean, full):
            mean = mean + self._patterns(shown, self.renderer.context.geometry.size[::-1])[part]
        weights = pixel_information(own, mean, full)
        region: Region = (0, 0, columns, rows)
        if noise.has_common:
            whole, region = self._weights(shown).copy(), derivatives.region
            whole[part] = weights
            weights = whole
        parts = derivatives.values
        if background:
            parts = np.concatenate([parts, np.ones_like(parts[:1])])
        return replace(noise, weights=weights).information(parts, region)

    def _variance_of(self, shown: int) -> Exact:
        """Return the variance of each pixel's own noise in the whole frame, counts²."""
        sensor = self.renderer.sensor
        variance = sensor.variance(self._light(shown), shown, fixed=False, clipped=False)
        return np.asarray(variance - sum(sensor.common_variance(shown)), np.float64)

    def _weights_of(self, shown: int) -> Exact:
        """Return the information of each pixel of the whole frame on its own mean, 1/counts²; of clipped ones 0."""
        counts = self.renderer.sensor.mean(self._light(shown), shown)
        outside = (counts < 0) | (counts > self.renderer.sensor.response.full)
        return np.where(outside, 0.0, 1 / self._variance(shown))


class FrameBounds:
    """Bounds of targets in single frames of a scenario; see `bounds`."""

    def __init__(
        self,
        scenario: Scenario,
        targets: Sequence[str] | None = None,
        gate_px: float = GATE_PX,
        clutter: bool = False,
    ) -> None:
        self.information = FrameInformation(scenario)
        names = [target.id for target in self.information.renderer.targets]
        self.targets = names if targets is None else list(targets)
        for name in self.targets:
            if name not in names:
                raise InputError(f"target: {no_such(name, names)}")
        if not (is_number(gate_px) and 0 < gate_px < math.inf):
            raise InputError(f"gate_px {gate_px!r}: allowed: a number above 0, px")
        self._gate_px = gate_px
        self._clutter = ClutterBound(scenario) if clutter else None
        self._arrivals = scenario.arrivals

    def __len__(self) -> int:
        return len(self._arrivals)

    def of(self, index: int) -> list[TargetBounds]:
        """Return the bounds of each target that the arriving frame `index` shows. IndexError without such a frame."""
        frame = self._arrivals[frame_number(index, len(self), "the scenario")]
        rows = (self._row(index, frame, name) for name in self.targets)
        return [row for row in rows if row is not None]

    def _row(self, index: int, frame: int, name: str) -> TargetBounds | None:
        """Return the bounds of a target in one frame; None where its pixels do not determine its place."""
        derivatives = self.information.derivatives(frame, name)
        if derivatives is None:
            return None
        J = self.information.of(frame, derivatives, background=True)
        covariance, level = position_covariance(J[:3, :3]), position_covariance(J)
        if covariance is None:
            return None
        d = math.sqrt(J[2, 2])
        sd_x, sd_y = np.sqrt(np.diag(covariance)).tolist()
        predicted = predicted_errors(covariance, d, self._gate_px) if d < LEAST_D else (None, None)
        background = (None, None) if level is None else np.sqrt(np.diag(level)).tolist()
        in_clutter = (None, None, None) if self._clutter is None else self._clutter.of(index, derivatives)
        return TargetBounds(
            index=index,
            target=name,
            sd_x=sd_x,
            sd_y=sd_y,
            sd_xy=float(covariance[0, 1]),
            d=d,
            sd_x_background=background[0],
            sd_y_background=background[1],
            region=derivatives.region,
            sd_x_clutter=in_clutter[0],
            sd_y_clutter=in_clutter[1],
            d_clutter=in_clutter[2],
            predicted_x=predicted[0],
            predicted_y=predicted[1],
        )


def bounds(
    scenario: Scenario,
    targets: Sequence[str] | None = None,
    start: int = 0,
    stop: int | None = None,
    *,
    gate_px: float = GATE_PX,
    clutter: bool = False,
    start_error_px: float | None = None,
    draws: int = DRAWS,
    progress: Callable[[int], None] | None = None,
) -> list[TargetBounds]:
    """Return the bounds of targets in the arriving frames start .. stop-1, by frame and target.

    A target that adds nothing to a frame, out of view or occluded, has no bounds in it.

    targets         ids; default: all
    gate_px         side of the search gate about the true place for the predicted errors below d = 10, px
    clutter         True: also the bound in clutter as coloured Gaussian noise (see `Detectability`), which takes longer
    start_error_px  standard deviation of the start box's centre on either axis, px: also the sequence bound from frame
                    `start` on, where there is one (see `irsim.render.sequence_bound`)
    draws           number of paths over which the sequence bound takes its mean information
    progress        called with the number of frames done

    InputError for unknown targets, a target out of view in all of the frames, a recorded background, and a camera
    without temporal noise.
    """
    single = FrameBounds(scenario, targets, gate_px, clutter)
    frames = frame_range(start, stop, len(single))
    rows: list[TargetBounds] = []
    for done, index in enumerate(frames, 1):
        rows += single.of(index)
        if progress is not None:
            progress(done)
    seen = {row.target for row in rows}
    unseen = [name for name in single.targets if name not in seen]
    if not single.targets:
        raise InputError("targets: there are none; allowed: a scenario with a target that is on")
    if unseen and (targets is not None or not seen):
        raise InputError(f"target {unseen[0]}: is in view in none of the frames {frames.start}:{frames.stop}")
    if start_error_px is not None:
        rows = with_sequence_bounds(single.information, rows, frames, start_error_px, draws)
    return rows


class ClutterBound:
    """Bound where the clutter around a target counts as coloured Gaussian noise, with the covariance of
    `Detectability`."""

    def __init__(self, scenario: Scenario) -> None:
        self._detectability = Detectability(scenario)
        self._size = scenario.camera.size

    def of(self, index: int, derivatives: Derivatives) -> tuple[float | None, float | None, float | None]:
        """Return the bounds in x and y, px, and d in the arriving frame `index`; None where singular."""
        columns, rows = self._size
        whole = np.zeros((3, rows, columns))
        whole[:, *region_slices(derivatives.region)] = derivatives.values
        clutter = self._detectability.clutter(index, whole[2])
        if clutter is None:
            return None, None, None
        parts = np.where(np.isfinite(clutter.variance), whole[:, *clutter.region], 0.0)
        solved = np.stack([whitened(part, clutter.variance, clutter.spectrum) for part in parts])
        J = np.einsum("iab,jab->ij", parts, solved)
        covariance = position_covariance((J + J.T) / 2)
        if covariance is None:
            return None, None, None
        sd_x, sd_y = np.sqrt(np.diag(covariance)).tolist()
        return sd_x, sd_y, math.sqrt(J[2, 2])
