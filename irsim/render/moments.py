"""What a frame is made of, exactly: its mean, each target's part in it, and each pixel's noise.

For bounds on what any tracker could reach (Cramér-Rao), for fits, and to rerun a scene with a cause
taken away.
"""

from __future__ import annotations

import reprlib
from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from irsim.config.names import no_such
from irsim.errors import InputError, as_whole, frame_number
from irsim.render.frame import Renderer
from irsim.render.levels import Levels, Region, slices
from irsim.scenario.model import Scenario, expect_scenario, given_names

Exact = npt.NDArray[np.float64]


class Moments:
    """Mean and variance of a scenario's frames, and what each target adds. Of a region they cost as much as what is
    drawn there, and a contribution as what its target touches; but for the background of a frame that is asked for
    anew, `variance`, and all of a camera that blooms or a background that is recorded.

    All are arrays (rows, columns) of float64 in counts (squared counts), of the whole frame or of a
    `region` (first column, first row, columns, rows). Means are before counts are rounded and clipped,
    and follow a target's place smoothly.

    `index` counts the frames that arrive, as those of `irsim.frames` and of a recording: where the camera's faults
    drop or double some, it is not that of the scenario. IndexError where no frame of that index arrives, InputError
    where it is no whole number.
    """

    def __init__(self, scenario: Scenario, without: Iterable[str] = ()) -> None:
        """without   names of parts that are switched off beside those of the scenario; InputError for others."""
        expect_scenario("Moments", scenario)
        off = given_names(without)
        known = [name for name, _ in scenario.names()]
        for name in off:
            if name not in known:
                raise InputError(f"without: {no_such(name, known)}")
        self.scenario = scenario.model_copy(update={"without": tuple(dict.fromkeys([*scenario.without, *off]))})
        self._arrivals = self.scenario.arrivals
        self._renderer = Renderer(self.scenario)
        self._levels = Levels(self._renderer)

    def mean(self, index: int, region: Region | None = None) -> Exact:
        """The noiseless frame, counts. InputError of a recorded background, whose noise is not known."""
        self._refuse_recorded()
        return np.asarray(self._levels.of(self._taken(index), region=self._within(region)), np.float64)

    def contribution(
        self, index: int, target: str, shift: tuple[float, float] = (0.0, 0.0), region: Region | None = None
    ) -> Exact:
        """What a target adds to the mean, counts: the mean with it less the mean without it; to recorded frames,
        whose noise goes on before it, what it adds to their counts before these are rounded and clipped.

        shift   (dx, dy) px by which it is moved in the picture, its aspect the same, in this frame and in
                those that the detector still remembers; it stays behind what hides it

        InputError where there is no such target, or it is switched off, and of a shift that is none.
        """
        if not _is_shift(shift):
            raise InputError(f"shift: {shift} is no shift; allowed: two finite numbers, px to the right and down")
        names = [course.target.id for course in self._renderer.courses]
        if target not in names:
            raise InputError(
                f"target: there is no {target!r}; allowed: {', '.join(names) or 'nothing, there are none'}"
            )
        return np.asarray(self._levels.added(self._taken(index), target, shift, self._within(region)), np.float64)

    def variance(self, index: int, region: Region | None = None, fixed: bool = True) -> Exact:
        """Noise of each pixel about the mean, squared counts, that of rounding with it.

        The mean square over all draws of the seed: an offset of odd and even rows, the same in all draws, counts,
        as the mean does not hold it. Without `fixed`, what changes from frame to frame only. Infinite where a pixel
        says nothing of the light: dead, or saturated. InputError of a recorded background, whose noise is not known.
        """
        if not isinstance(fixed, bool | np.bool_):
            raise InputError(f"fixed {fixed!r}: allowed: True or False")
        self._refuse_recorded()
        taken, within = self._taken(index), self._within(region)
        variance = np.asarray(self._renderer.variance(taken, fixed), dtype=np.float64)
        return variance if within is None else variance[slices(within)]

    def _refuse_recorded(self) -> None:
        if self.scenario.background.has_noise:
            raise InputError(
                "background: the noise of a recording is not known; allowed: contribution(), or a background that is "
                "rendered"
            )

    def _taken(self, index: int) -> int:
        """The scenario's frame behind the one that arrives as `index`."""
        arrivals = self._arrivals
        return arrivals[frame_number(index, len(arrivals), "the scenario")]

    def _within(self, region: Region | None) -> Region | None:
        """The region in whole numbers; None where it is all of the picture."""
        if region is None:
            return None
        try:
            left, top, columns, rows = map(as_whole, region)
        except (TypeError, ValueError):
            raise InputError(
                f"region: {reprlib.repr(region)} is none; allowed: whole numbers (column, row, columns, rows), px; "
                "names of what is switched off are for Moments itself, without=[...]"
            ) from None
        width, height = self.scenario.camera.size
        if not (0 <= left < left + columns <= width and 0 <= top < top + rows <= height):
            raise InputError(f"region: {region} is not within {width}x{height} px; allowed: column, row, columns, rows")
        return None if (columns, rows) == (width, height) else (left, top, columns, rows)


def _is_shift(given: object) -> bool:
    """Is it a pair of finite numbers?"""
    try:
        numbers = np.asarray(given)
    except ValueError:  # of items that are not alike
        return False
    return numbers.shape == (2,) and numbers.dtype.kind in "iuf" and bool(np.isfinite(numbers).all())
