"""Where the fixed pattern of a recording changes, as a correction leaves another one behind."""

from __future__ import annotations

import itertools

import numpy as np

from irsim.measure.given import Values
from irsim.measure.jumps import lively
from irsim.measure.picked import middle
from irsim.types import MEDIAN_TO_SIGMA, Floats, Indices

_WIDTHS = (1, 2, 4, 8, 16, 32)
"""Frames on either side of a step that are averaged: narrow ones place it, wide ones see a weak one."""
_BEYOND_CHANCE = 6.0
"""Standard errors above what is seen beside: among all widths of 10^4 recordings hardly a place is there by chance."""
_CLIP = 3.0
"""Usual changes from frame to frame beyond which a pixel's change counts as that large: blinking ones are few."""
_SHARP = 0.25
"""Correlation of neighbouring pixels in what a step adds, at most: light that moves is blurred, by 0.6 px to 0.5."""
_STEEP = 0.4
"""Of the logarithm that much must be above what is seen half a mean's width before and after: a step of any size has
0.6 and more there but for chance, of what wanders hardly any."""
_LASTING = 0.8
_LASTING_WIDTH = 8
"""Of what a step adds between two frames so much lasts in means of 8. Where frames are lost from noise with
memory, the two beside differ by more than others do, but noise forgets: of a correlation of 0.9 a frame, half stays."""
_NOTHING = 1e-30
"""Stands for no power at all."""
_WIDEST = 128
"""Side of the middle of a region that is looked at, px: more changes nothing but the time that it takes."""

_Pair = tuple[int, int]
"""Two places between which a change is looked at: frames before the first, and from the second on."""


def pattern_steps(frames: Floats, number: Indices) -> list[int]:
    """Where the fixed pattern of frames (T, rows, columns), taken at `number` (T,), changes from pixel to pixel.

    At each place between two frames the mean of m frames after is compared with that of m before. Their mean squared
    difference over n pixels, rows and columns taken out and noisy frames weighed less, is 2 tvh^2 / m where noise is
    white, and P more at a step that changes the pattern by P in variance. It is a step where the logarithm lies above
    that of what is beside, before and after, by `_BEYOND_CHANCE` standard errors: sqrt(4 / n), or as such logarithms
    scatter from frame to frame if that is more. Noise with memory and drift raise all three alike, and do not scatter
    more, since pixels are independent of each other whatever time does. What lies across a gap in time is compared with
    what lies as far apart beside it. What is added must be sharp, as a detector's pattern is and a scene that moves is
    not, and must last: where frames were lost from noise with memory it hardly ever does.

    So over 64 x 64 px a step is seen from P = 0.41 tvh^2 / m on, in the mean; one pattern of sigma s in the place of
    another changes by P = 2 s^2, and is seen from s = 0.45 tvh / sqrt(m) on, where 2 m frames lie on one side of the
    step and m on the other: 0.16 tvh with m = 8, 0.08 tvh with 32, each every other time. Of one that is not seen tvh^2
    holds P / 4 at most. Steps that follow each other in fewer than 16 frames are seen if they are strong. Rows and
    columns that change alone, what is smooth from pixel to pixel, and a pattern of one frame at either end are not
    seen.
    """
    seen = middle(frames, _WIDEST)
    if not lively(seen):
        return []
    return sorted(_steps_in(_Changes(seen, number), 0, len(frames)))


class _Changes:
    """Changes between means of frames, and their mean squares over the pixels."""

    def __init__(self, frames: Values, number: Indices) -> None:
        centred = frames - np.median(frames, axis=0)
        for axis in (1, 2):  # medians: the lines of a pixel that jumps shall not follow it
            centred -= np.median(centred, axis=axis, keepdims=True)
        changes = np.square(np.diff(centred, axis=0)).mean(axis=(1, 2))
        own = np.minimum(np.append(changes, np.inf), np.insert(changes, 0, np.inf))  # of a frame, beside both others
        loud = np.sqrt(np.maximum(own / max(float(np.median(own)), _NOTHING), 1))
        centred /= loud[:, None, None]  # a noisy frame shall not look like two steps
        self.sums = np.concatenate([np.zeros((1, *frames.shape[1:])), np.cumsum(centred, axis=0)])
        self.lost = np.concatenate([[0], np.diff(number) - 1])
        self._powers: dict[tuple[_Pair, int, int], float] = {}
        self._most = {0: np.inf}
        for clip, width in itertools.pairwise((0, *(width for width in _WIDTHS if 2 * width <= len(frames)))):
            places = range(width, len(frames) - width + 1)
            self._most[width] = _CLIP**2 * float(np.median([self.power((k, k), width, min(clip, 1)) for k in places]))
        powers = np.log([max(self.power((k, k), 1, 1), _NOTHING) for k in range(1, len(frames))])
        scatter = MEDIAN_TO_SIGMA * float(np.median(np.abs(np.diff(powers))))
        self.chance = max(2 / float(np.sqrt(frames[0].size)), scatter)

    def between(self, pair: _Pair, width: int) -> Floats:
        """(rows, columns) mean of `width` frames from the second place on less that of as many before the first."""
        end, start = pair
        sums = self.sums
        found: Floats = (sums[start + width] - sums[start] - sums[end] + sums[end - width]) / width
        return found

    def power(self, pair: _Pair, width: int, clip: int) -> float:
        """Its mean square; no pixel's more than `_CLIP` times what is usual between means of `clip` frames."""
        key = pair, width, clip
        if key not in self._powers:
            square = np.square(self.between(pair, width))
            self._powers[key] = float(np.minimum(square, self._most[clip]).mean())
        return self._powers[key]

    def beside(self, place: int, width: int, first: int, last: int) -> list[_Pair]:
        """Pairs within frames first .. last-1 that do not reach over a place, and are as far apart in time as it is.

        The nearest before and after; where there is but one of these, all.
        """
        gap = int(self.lost[place])
        before, after = (place - width - gap, place - width), (place + width, place + width + gap)
        if before[0] - width >= first and after[1] + width <= last:
            return [before, after]
        pairs = ((end, end + gap) for end in range(first + width, last - gap - width + 1))
        return [pair for pair in pairs if pair[1] + width <= place or pair[0] - width >= place]

    def holds_gap(self, place: int, width: int) -> bool:
        """Whether time is lost within the frames on either side of a place."""
        return bool(self.lost[place - width + 1 : place].any() or self.lost[place + 1 : place + width].any())


def _steps_in(changes: _Changes, first: int, last: int) -> list[int]:
    """Steps among frames first .. last-1: the clearest that the narrowest mean shows, and those beside it."""
    for width in _WIDTHS:
        clear = {}
        for place in range(first + width, last - width + 1):
            beside = changes.beside(place, width, first, last)
            if beside and not changes.holds_gap(place, width):
                ratio = _log_ratio(changes, place, beside, width)
                if ratio > _BEYOND_CHANCE * changes.chance and _is_steep(changes, place, width, ratio, first, last):
                    clear[place] = ratio
        for place in sorted(clear, key=lambda place: -clear[place]):
            if _is_sharp(changes, place, width, first, last) and _lasts(changes, place, width, first, last):
                return [*_steps_in(changes, first, place), place, *_steps_in(changes, place, last)]
    return []


def _log_ratio(changes: _Changes, place: int, beside: list[_Pair], width: int) -> float:
    here = changes.power((place, place), width, width)
    there = max(changes.power(pair, width, width) for pair in beside)
    return float(np.log(max(here, _NOTHING) / max(there, _NOTHING)))


def _is_steep(changes: _Changes, place: int, width: int, ratio: float, first: int, last: int) -> bool:
    """Whether little of the `ratio` is left half a mean's width before and after, as far as these are between steps."""
    half = width // 2
    near = [(k, k) for k in (place - half, place + half) if half and first + width <= k <= last - width]
    return not near or _log_ratio(changes, place, near, width) > _STEEP * ratio


def _is_sharp(changes: _Changes, place: int, width: int, first: int, last: int) -> bool:
    """Whether neighbouring pixels are nearly independent in what a step adds."""
    here = changes.between((place, place), width)
    there = [changes.between(pair, width) for pair in changes.beside(place, width, first, last)]
    power = float(np.square(here).mean()) - max(float(np.square(change).mean()) for change in there)
    together = _together(here) - np.mean([_together(change) for change in there], axis=0)
    return power > 0 and float(together.max()) < _SHARP * power


def _together(change: Floats) -> Floats:
    """(2,) mean products of pixels that lie side by side, and above each other."""
    return np.array([(change[:, 1:] * change[:, :-1]).mean(), (change[1:] * change[:-1]).mean()])


def _lasts(changes: _Changes, place: int, width: int, first: int, last: int) -> bool:
    """Whether what a step adds is there in the means of more frames, too, as far as these are between steps."""
    wider = (wide for wide in range(_LASTING_WIDTH, width, -1) if first + wide <= place <= last - wide)
    for wide in wider:
        if changes.beside(place, wide, first, last):
            return _added(changes, place, wide, first, last) > _LASTING * _added(changes, place, width, first, last)
    return width > 1  # one frame of another pattern is not told from an odd one


def _added(changes: _Changes, place: int, width: int, first: int, last: int) -> float:
    """Power at a place above the greatest beside it; all widths under the same clip."""
    beside = max(changes.power(pair, width, 1) for pair in changes.beside(place, width, first, last))
    return changes.power((place, place), width, 1) - beside
