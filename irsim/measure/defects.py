"""Pixels that do not do what the others do."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from irsim.measure.around import REACH, alone, around
from irsim.measure.given import Values, check_above, check_frames
from irsim.measure.points import FULL
from irsim.measure.shared import MOST_IN_GROUP, following, in_groups, in_steep_groups, unshared
from irsim.measure.two_levels import two_levels
from irsim.types import MEDIAN_TO_SIGMA, Bools, Floats

_FAR = 8.0
"""Robust sigmas beyond which a pixel is bad: a Gaussian one of 10^6 pixels is never there."""
RESTLESS = 3.0
"""Temporal sigma of a blinking pixel over that of those around it, at least."""
_FAINT = 6.0
"""Robust sigmas beyond which a pixel's variance is no chance: of 10^6 Gaussian pixels in 20 frames or more none is."""
_FEW = 0.02
"""Of a region's pixels no more blink; where more change by themselves, it is the scene that does."""
_CALM = 1.5
"""Temporal sigma of a pixel over that of those around it, at most, where no light of what changes beside it falls."""
_WITHIN = 0.3
"""Share of a pixel's variance within two levels, at most, where it has any: noise without has 0.36."""
_STIRRED = 2.0
"""Temporal sigma around a pixel over that of noise, from which the scene hides what the pixel does: shot noise and slow
drift make less."""
_DISTURBED = 0.1
"""Share of the pixels beside a group that are not calm, at most: a point of light, of 0.4 px or more, disturbs those on
all sides."""
_PASSES = 3
"""Frames, at most, for which what passes lights up a pixel that blinks only then; what is slower leaves a track."""
_NEXT_PX = 8.0
"""How far on the next pixel lies, at most, that what passes lights up."""
_SLOWEST = 0.99
"""Share of the pixels that change at least as often as those that chance may freeze: whole counts make some slow."""
LEAST_NOISE = 1 / math.sqrt(12)
"""Counts: rounding alone makes so much."""
ROUNDED = math.hypot(0.3, LEAST_NOISE)
"""Counts, as measured: noise of 0.3 counts with rounding's. Of less, what is measured hangs on where between two counts
a pixel lies: of 0.2 it makes 0.11 to 0.50."""
_TOGGLES = 0.51
"""Temporal sigma, counts, that no pixel has more of which goes to and fro between two neighbouring counts."""
_A_COUNT = 1.0
"""By so much rounding alone sets a pixel off from those around it."""
_BY_CHANCE = 0.1
"""So many pixels of a picture may be frozen by chance where those that never change are called dead."""


@dataclass(frozen=True, eq=False)
class Defects:
    """Masks (rows, columns); no pixel is in two of them.

    dead        does not change, or stands far below those around it all the time
    hot         stands far above those around it all the time
    blinking    changes far more in time than those around it
    faint       blinks by less: it would seem hot or dead, but one of its two levels does not stand out. It is not
                counted, as others that blink by as little are not
    judged      of which pixels it can be told: not where all is full of light
    frozen_from frames from which on one that never changes is called dead: in fewer, good ones may not happen to
                change; None where most pixels never do, as in pictures whose noise is far below one count
    """

    dead: Bools
    hot: Bools
    blinking: Bools
    faint: Bools
    judged: Bools
    frozen_from: int | None

    @property
    def all(self) -> Bools:
        bad: Bools = self.dead | self.hot | self.blinking | self.faint
        return bad

    def off(self, taken: Bools | None) -> Defects:
        """Those that can be told where no target was (rows, columns): one that stands, passes or flickers looks like a
        bad pixel. Everywhere, where targets were in more than half of the picture."""
        return self.where(self.judged if taken is None or 2 * taken.sum() > taken.size else self.judged & ~taken)

    def where(self, told: Bools) -> Defects:
        """Those in a mask (rows, columns), outside of which nothing is told."""
        dead, hot, blinking, faint, judged = (
            mask & told for mask in (self.dead, self.hot, self.blinking, self.faint, self.judged)
        )
        return Defects(dead, hot, blinking, faint, judged, self.frozen_from)


def defects(frames: Values, top: float = math.inf) -> Defects:
    """Bad pixels of frames (T, rows, columns), each compared with the 5 x 5 px around it.

    Ridges and edges of a scene are not bad pixels, nor are tracks of what moves: a bad one stands out from all on the
    border of those 5 x 5 px, but for others of a small group that does (clusters dense about their highest are missed),
    or blinks in a small group beside which nothing changes, and not only while something passes that lights up one
    pixel after the other. What came through the optics is blurred over neighbours: a pixel that changes as one of those
    does, or whose height most of those beside it share, is the scene's. A still point as sharp as a pixel does look
    like a bad one.

    top     the highest count there can be: where all is full of light nothing is told

    InputError for frames that are no array of finite numbers, and for a `top` that is no number above 0.
    """
    check_frames(frames)
    check_above(top, "top", "the highest count that there can be", math.inf)
    values = np.asarray(frames, np.float32)
    level, restless = _moments(values)
    usual = float(np.median(restless))
    frozen_from = _frozen_from(frames)
    usually = around(level)
    full = _filled(usually, top)
    frozen = (frames == frames[0]).all(axis=0) & (level < FULL * top)
    frozen &= frozen_from is not None and len(frames) >= frozen_from
    restless_around = around(restless)
    calm = np.maximum(restless_around, usual)
    rounded = usual < ROUNDED and whole_counts(frames)
    changing = restless > np.maximum(RESTLESS * calm, _TOGGLES if rounded else 0)
    blinking = changing & (alone(restless, restless_around) | _in_islands(changing, restless < _CALM * calm))
    blinking &= ~full & ~_passed(values, blinking, restless > RESTLESS * usual)
    blinking &= ~following(values, blinking)
    apart = _without_common(level - usually)
    steady = _far_off(apart) & ~changing & ~full & (np.abs(level - usually) > (_A_COUNT if rounded else 0))
    hot = _standing_out(level, usually, steady) & ~frozen
    dead = (_standing_out(-level, -usually, steady) | frozen) & ~hot
    restive = (hot | dead) & ~frozen & (restless > _CALM * calm)
    faint = _to_and_fro(values, restive, level - apart, scatter_around(apart))
    return Defects(dead & ~faint, hot & ~faint, blinking, faint, ~full, frozen_from)


def _moments(values: Values) -> tuple[Floats, Floats]:
    """Mean and sigma of each pixel (rows, columns) over time, summed in float64: in float32 a bright pixel that never
    changes would seem to in a thousand frames."""
    mean = values.mean(axis=0, dtype=np.float64)
    squares = np.zeros_like(mean)
    for frame in values:
        squares += np.square(frame - mean)
    return mean.astype(np.float32), np.sqrt(squares / len(values)).astype(np.float32)


def _standing_out(picture: Floats, usually: Floats, far: Bools) -> Bools:
    """Which of the pixels that lie far off what is `usually` around them stand above it, they or a group of them alone,
    with a height that few beside them share."""
    height = picture - usually
    others = in_steep_groups(far & (height > 0), height)
    return unshared(height, far & alone(picture, usually, np.where(others, usually, picture)))


def whole_counts(frames: Values) -> bool:
    """Whether frames (T, rows, columns) hold whole numbers, all of them (frames less their first begin with zeros):
    rounding is part of what changes in them."""
    return np.issubdtype(frames.dtype, np.integer) or all(bool((frame == np.rint(frame)).all()) for frame in frames)


def stirred(frames: Values, noise: float) -> Bools:
    """Where the scene of frames (T, rows, columns) changes more than `noise` does, in sigmas (rows, columns).

    Pixels that blink are found there only if they change far more than it does: most are missed. What all pixels of a
    frame have in common hides nothing.
    """
    common = float(np.var(frames.mean(axis=(1, 2), dtype=np.float64)))
    change = around(_moments(frames)[1]).astype(np.float64) ** 2 - common
    moved: Bools = change > (_STIRRED * max(noise, LEAST_NOISE)) ** 2
    return moved


class Uneven(NamedTuple):
    """Share of a picture where a still scene hides dead and hot pixels, and the counts by which one has to stand out
    there to be found, in the median (0 for no share)."""

    share: float
    counts: float


def uneven(frames: Values, noise: float) -> Uneven:
    """Where what stands in frames (T, rows, columns) differs from pixel to pixel by more than `noise`, a sigma."""
    level = frames.mean(axis=0, dtype=np.float64)
    usual = scatter_around(without_lines(level))
    hides = usual > _STIRRED * max(noise, LEAST_NOISE)
    return Uneven(float(hides.mean()), float(_FAR * np.median(usual[hides])) if hides.any() else 0.0)


def without_lines(level: Floats) -> Floats:
    """What pixels (rows, columns) lie above those around, without what rows and columns have in common: medians are
    taken off. A camera's own rows hide no bad pixel."""
    return _without_common(level - around(level))


def _without_common(apart: Floats) -> Floats:
    """The same of what pixels lie above those around."""
    rest = apart - np.median(apart, axis=1, keepdims=True)
    return np.asarray(rest - np.median(rest, axis=0, keepdims=True), np.float32)


def faint_blinkers(flat: Values) -> Bools:
    """Pixels (rows, columns) of a flat region (T, rows, columns) that change more than by chance, if they are few.

    They blink by too little to be told from changes of a scene, but where there is none they are no noise:
    their variance lies above the median by `_FAINT` robust sigmas of the logarithms of all. Noise of Gaussian pixels
    never does, so that nothing is cut off from it.
    """
    variances = np.log(np.maximum(np.var(flat, axis=0, dtype=np.float64), np.finfo(np.float32).tiny))
    apart = variances - np.median(variances)
    found: Bools = apart > _FAINT * MEDIAN_TO_SIGMA * max(float(np.median(np.abs(apart))), 1 / math.sqrt(len(flat)))
    if whole_counts(flat):
        found &= variances > 2 * math.log(_TOGGLES)
    return found if found.mean() <= _FEW else np.zeros_like(found)


def _frozen_from(frames: Values) -> int | None:
    """Frames from which on hardly a good pixel of a picture stays the same by chance; see `Defects`.

    A pixel that takes count k with probability p_k stays from one frame to the next in the share q, the sum of
    p_k^2, and over T frames in that of p_k^T, which is at most q^(T/2); noise with memory stays so in about
    q^(T - 1), which is less.
    """
    if len(frames) < 2:
        return None
    stays = np.mean(frames[1:] == frames[:-1], axis=0)
    live = stays[stays < 1]
    if 2 * live.size <= stays.size:
        return None
    share = float(np.quantile(live, _SLOWEST))
    return 2 if share == 0 else math.ceil(2 * math.log(_BY_CHANCE / stays.size) / math.log(share))


def without_specks(picture: Floats) -> Floats:
    """A picture in which what lies far off the 5 x 5 px around it has their median; found or not, alone or not."""
    usual = around(picture)
    return np.where(_far_off((picture - usual).astype(np.float32)), usual, picture)


def _far_off(apart: Floats) -> Bools:
    """Whether a difference to what is around is far beyond those of the place: texture and edges make them large."""
    far: Bools = np.abs(apart) > _FAR * np.maximum(scatter_around(apart), np.finfo(np.float32).tiny)
    return far


def scatter_around(apart: Floats) -> Floats:
    """Robust sigma of the differences of the place, or of the whole picture where that is more."""
    return np.maximum(around(np.abs(apart)), float(np.median(np.abs(apart)))) * MEDIAN_TO_SIGMA


def _in_islands(changing: Bools, calm: Bools) -> Bools:
    """Which of the pixels that change lie in small groups (rows, columns) beside which nearly all are calm.

    Those up to 3 px apart are one group: neighbours that blink do not hide each other. Light that moves or flickers is
    blurred into the pixels beside it; along a track or an edge the groups are long.
    """
    groups, count = in_groups(changing)
    members, beside, disturbed = (
        np.bincount(groups[mask], minlength=count + 1) for mask in (changing, ~changing, ~changing & ~calm)
    )
    small = (members <= MOST_IN_GROUP) & (disturbed <= _DISTURBED * beside)
    island: Bools = changing & small[groups]
    return island


def _to_and_fro(values: Floats, asked: Bools, around_it: Floats, usual: Floats) -> Bools:
    """Which of the pixels asked for have two levels in time (T, rows, columns), of which one does not lie far off what
    is around (rows, columns), in the sigmas that are usual there."""
    series = two_levels(values[:, asked].astype(np.float64))
    nearer = np.minimum(*(np.abs(mean - around_it[asked]) for mean in (series.upper, series.lower)))
    found = np.zeros_like(asked)
    found[asked] = (series.within < _WITHIN) & (nearer <= _FAR * usual[asked])
    return found


def _filled(usually: Floats, top: float) -> Bools:
    """Where most pixels around, whose median `usually` is, are full of light all the time, and 2 px beside that."""
    full = (usually >= FULL * top).astype(np.uint8)
    return cv2.dilate(full, np.ones((2 * REACH + 1,) * 2, np.uint8)).astype(bool)


def _passed(values: Floats, doubtful: Bools, changing: Bools) -> Bools:
    """Which of some pixels, among all that change (rows, columns), were lit up once by what did so with another
    one just before or after: a point too fast to leave a track."""
    from scipy.spatial import cKDTree

    reach = 2 * int(_NEXT_PX) + 1
    near = changing & (cv2.dilate(doubtful.astype(np.uint8), np.ones((reach, reach), np.uint8)) > 0)
    places, series = np.argwhere(near), values[:, near]
    far = np.abs(series - np.median(series, axis=0))
    lit = far > far.max(axis=0, initial=0) / 2
    first, last = lit.argmax(axis=0), len(lit) - 1 - lit[::-1].argmax(axis=0)
    short = last - first < _PASSES
    passed = np.zeros_like(doubtful)
    asked = np.flatnonzero(doubtful[near] & short)
    if asked.size:
        for one, others in zip(asked, cKDTree(places).query_ball_point(places[asked], _NEXT_PX), strict=True):
            apart = np.abs(first[others] - first[one])[short[others]]
            passed[tuple(places[one])] = bool(((apart > 0) & (apart <= _PASSES)).any())
    return passed
