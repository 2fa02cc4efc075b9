"""Exact mean and variance of frames, and the contribution of each target, for Cramér-Rao bounds and fits."""

from __future__ import annotations

import reprlib
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from irsim.backgrounds import Layer, crop
from irsim.camera.signal_chain import SignalChain
from irsim.config.base import no_such
from irsim.errors import InputError, as_int, frame_number
from irsim.render.composite import NamedSprite, compose, uncovered
from irsim.render.exposure import Shifts
from irsim.render.frame import NO_SHIFTS, Renderer
from irsim.scenario.model import Scenario, expect_names, expect_scenario
from irsim.types import Floats, Slices

Exact = npt.NDArray[np.float64]

Region = tuple[int, int, int, int]
"""Region of a picture: first column, first row, number of columns, number of rows."""

BLOCK_PX = 16
"""Side, px, of the blocks to which the region changed by a target is rounded. Small shifts change the same blocks,
whose background is cached."""


class Moments:
    """Mean and variance of a scenario's frames, and the contributions of targets.

    All are float64 arrays (rows, columns) in counts (variance: squared counts), of the whole frame or of a `region`
    (first column, first row, columns, rows). Means are taken before counts are rounded and clipped, and are smooth in a
    target's position. `index` counts the frames that arrive, as `irsim.frames` and recordings do. Where the camera
    drops or doubles frames, it differs from the scenario's frame number. IndexError where no frame of that index
    arrives, InputError where it is not a whole number.

    The cost of means and contributions grows with the pixels of the region. The whole picture is still computed for the
    background of a new frame, for `variance`, for a camera that blooms, and for a recorded background.
    """

    def __init__(self, scenario: Scenario, without: Iterable[str] = ()) -> None:
        """Switch off the parts in `without` besides those in the scenario's `without`. InputError for unknown names."""
        expect_scenario("Moments", scenario)
        off = expect_names(without)
        known = [name for name, _ in scenario.names()]
        for name in off:
            if name not in known:
                raise InputError(f"without: {no_such(name, known)}")
        self.scenario = scenario.model_copy(update={"without": tuple(dict.fromkeys([*scenario.without, *off]))})
        self._arrivals = self.scenario.arrivals
        self._renderer = Renderer(self.scenario)
        self._levels = MeanCounts(self._renderer)

    def mean(self, index: int, region: Region | None = None) -> Exact:
        """Return the noiseless frame, counts. InputError for a recorded background, whose noise is unknown."""
        self._refuse_recorded()
        return np.asarray(self._levels.of(self._scenario_frame(index), region=self._within(region)), np.float64)

    def contribution(
        self, index: int, target: str, shift: tuple[float, float] = (0.0, 0.0), region: Region | None = None
    ) -> Exact:
        """Return the mean with a target less the mean without it, counts, before rounding and clipping.

        shift   (dx, dy) px by which the target is displaced in the picture with the same aspect, in this frame and in
                earlier frames within the detector's response time; the target stays behind its occluders

        InputError where there is no such target, or it is switched off, and for a shift that is not two finite numbers.
        """
        if not _is_shift(shift):
            raise InputError(f"shift: {shift} is no shift; allowed: two finite numbers, px to the right and down")
        names = [target.id for target in self._renderer.targets]
        if target not in names:
            allowed = ", ".join(names) or "nothing, there are none"
            raise InputError(f"target: there is no {target!r}; allowed: {allowed}")
        added = self._levels.added(self._scenario_frame(index), target, shift, self._within(region))
        return np.asarray(added, np.float64)

    def variance(self, index: int, region: Region | None = None, fixed: bool = True) -> Exact:
        """Return the noise variance of each pixel about the mean, counts², including that of rounding.

        The variance is the mean square over all seeds. It includes the offset between odd and even rows, which is the
        same for all seeds but is not part of the mean. With `fixed` False only temporal noise counts. Pixels that do
        not respond to light, dead or saturated, have infinite variance. InputError for a recorded background, whose
        noise is unknown.
        """
        if not isinstance(fixed, bool | np.bool_):
            raise InputError(f"fixed {fixed!r}: allowed: True or False")
        self._refuse_recorded()
        taken, within = self._scenario_frame(index), self._within(region)
        variance = np.asarray(self._renderer.variance(taken, fixed), dtype=np.float64)
        return variance if within is None else variance[region_slices(within)]

    def _refuse_recorded(self) -> None:
        if self.scenario.background.has_noise:
            raise InputError(
                "background: the noise of a recording is not known; allowed: contribution(), or a background that is "
                "rendered"
            )

    def _scenario_frame(self, index: int) -> int:
        """Return the scenario's number of the arriving frame `index`."""
        return self._arrivals[frame_number(index, len(self._arrivals), "the scenario")]

    def _within(self, region: Region | None) -> Region | None:
        """Return the region as integers; None where it is the whole picture."""
        if region is None:
            return None
        try:
            left, top, columns, rows = map(as_int, region)
        except (TypeError, ValueError):
            raise InputError(
                f"region: {reprlib.repr(region)} is no region; allowed: whole numbers (column, row, columns, rows), "
                "px; parts to switch off are an argument of Moments itself, without=[...]"
            ) from None
        width, height = self.scenario.camera.size
        if not (0 <= left < left + columns <= width and 0 <= top < top + rows <= height):
            raise InputError(f"region: {region} is not within {width}x{height} px; allowed: column, row, columns, rows")
        return None if (columns, rows) == (width, height) else (left, top, columns, rows)


class MeanCounts:
    """Exact noiseless counts of a scenario's frames before rounding and clipping, (rows, cols) float64.

    A recorded background keeps its own noise. Sprites and layers of the frames within the detector's response time are
    cached.
    """

    def __init__(self, renderer: Renderer) -> None:
        self._renderer = renderer
        frames = len(renderer.response_time.weights)
        self._unshifted = lru_cache(maxsize=frames)(lambda frame: list(renderer.pieces(frame, exactly=True)))
        self._layers = lru_cache(maxsize=2 * frames)(self._cut)
        self.without = lru_cache(maxsize=2)(lambda index, name, region: self.of(index, NO_SHIFTS, name, region))

    def added(self, index: int, target: str, shift: tuple[float, float], region: Region | None = None) -> Floats:
        """Return the counts with a target displaced by (dx, dy) px, less the counts without the target."""
        shifts = {target: shift} if any(shift) else NO_SHIFTS
        left, top, columns, rows = whole = region or (0, 0, *self._renderer.context.geometry.size)
        touched = self.touched(index, target, shifts, whole)
        added = np.zeros((rows, columns))
        if touched is not None:
            part = region_slices((touched[0] - left, touched[1] - top, *touched[2:]))
            added[part] = self.of(index, shifts, region=touched) - self.without(index, target, touched)
        return added

    def touched(self, index: int, target: str, shifts: Shifts, region: Region, margin: int = 0) -> Region | None:
        """Return the part of a region in which a target may change a frame; None if it cannot change any.

        margin   px by which the target's sprite is widened
        """
        renderer = self._renderer
        if self._spreads:
            return region
        shown = renderer.sensor.shown(index)
        frames = {max(shown - back, 0) for back in range(len(renderer.response_time.weights))}
        sprites = [piece.sprite for k in frames for piece in self._pieces(k, shifts, None) if piece.name == target]
        if not sprites:
            return None
        firsts = np.array([(sprite.x0, sprite.y0) for sprite in sprites]) - margin
        lasts = firsts + np.array([sprite.alpha.shape[::-1] for sprite in sprites]) + 2 * margin
        left, top = np.maximum(firsts.min(axis=0) // BLOCK_PX * BLOCK_PX, region[:2]).tolist()
        ends = -(-lasts.max(axis=0) // BLOCK_PX) * BLOCK_PX
        right, bottom = np.minimum(ends, np.add(region[:2], region[2:])).tolist()
        return (left, top, right - left, bottom - top) if left < right and top < bottom else None

    @property
    def _spreads(self) -> bool:
        """True where light at one pixel may change counts at another: with bloom, or in a recorded background."""
        return self._renderer.recorded is not None or self._renderer.sensor.bloom is not None

    def of(
        self, index: int, shifts: Shifts = NO_SHIFTS, absent: str | None = None, region: Region | None = None
    ) -> Floats:
        """Return the counts of a frame, or of a region within it, with targets displaced and target `absent` left out.

        A target with a requested contrast or SCR keeps the radiance that it has in the frame itself.
        """
        renderer, sensor = self._renderer, self._renderer.sensor
        renderer.check(index)
        if region is not None and self._spreads:
            return self.of(index, shifts, absent)[region_slices(region)]
        if renderer.recorded is not None:
            pieces = self._pieces(index, shifts, absent)
            light = self._whole(index, pieces)
            return renderer.recorded.insert_into(light, index, uncovered(pieces, light))
        # A new response time, as it caches the light of these targets.
        response_time = renderer.scenario.camera.response_time(renderer.scenario.is_on)
        shown = sensor.shown(index)

        def light_of(frame: int) -> Floats:
            return self._light(frame, self._pieces(frame, shifts, absent), region)

        return self._signal_chain(region).mean(response_time.light(shown, light_of), shown)

    def _signal_chain(self, region: Region | None) -> SignalChain:
        """Return the signal chain for a region. A signal chain with bloom is not cut."""
        sensor = self._renderer.sensor
        vignetting = sensor.vignetting
        if region is None or vignetting is None:
            return sensor
        return replace(sensor, vignetting=lambda index: vignetting(index)[region_slices(region)])

    def _pieces(self, frame: int, shifts: Shifts, absent: str | None) -> Sequence[NamedSprite]:
        pieces = [piece for piece in self._unshifted(frame) if piece.name != absent]
        if not shifts:
            return pieces
        moved = {piece.name: piece for piece in self._renderer.pieces(frame, shifts, exactly=True, only=list(shifts))}
        return [moved.get(piece.name, piece) for piece in pieces]

    def _light(self, frame: int, pieces: Sequence[NamedSprite], region: Region | None) -> Floats:
        if region is None:
            return self._whole(frame, pieces)
        left, top, columns, rows = region
        near = [piece for piece in pieces if piece.sprite.within((rows, columns), (left, top)) is not None]
        layers = self._layers(frame, region)
        # A requested SCR depends on the ring around the target, which may reach beyond the region.
        if layers is None or any(piece.sprite.requested is not None for piece in near):
            return self._whole(frame, pieces)[region_slices(region)]
        within = [
            piece._replace(sprite=piece.sprite._replace(x0=piece.sprite.x0 - left, y0=piece.sprite.y0 - top))
            for piece in near
        ]
        return self._composed(frame, layers, within, (rows, columns))

    def _whole(self, frame: int, pieces: Sequence[NamedSprite]) -> Floats:
        renderer = self._renderer
        return self._composed(frame, renderer.layers_at(frame), pieces, renderer.context.geometry.size[::-1])

    def _composed(
        self, frame: int, layers: Sequence[Layer], pieces: Sequence[NamedSprite], shape: tuple[int, int]
    ) -> Floats:
        renderer, out = self._renderer, np.empty(shape, np.float64)
        view_direction, noise = renderer.now(frame).view_direction(frame), renderer.noise(frame)
        return compose(layers, pieces, view_direction, renderer.context.band, noise, out, truth=False)[0]

    def _cut(self, frame: int, region: Region) -> Sequence[Layer] | None:
        """Return the layers of a frame, cut to a region; None where one of them can only be computed as a whole."""
        view_direction = self._renderer.now(frame).view_direction(frame)
        parts = [crop(layer, view_direction, region_slices(region)) for layer in self._renderer.layers_at(frame)]
        found = [part for part in parts if part is not None]
        return found if len(found) == len(parts) else None


def region_slices(region: Region) -> Slices:
    """Return the rows and columns of a region."""
    left, top, columns, rows = region
    return slice(top, top + rows), slice(left, left + columns)


def _is_shift(given: object) -> bool:
    """Return True if `given` is a pair of finite numbers."""
    try:
        numbers = np.asarray(given)
    except ValueError:  # the items have different shapes
        return False
    return numbers.shape == (2,) and numbers.dtype.kind in "iuf" and bool(np.isfinite(numbers).all())
