"""The blur of a camera that stands, by points that pass: what is behind them is known from other frames."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from irsim.measure.given import Values
from irsim.measure.interval import LEVEL, Measured
from irsim.measure.picked import evenly
from irsim.measure.points import FULL, LEAST_POINT_FRAMES, POINT_REACH, SIGMAS
from irsim.measure.tracks import Track, tracks
from irsim.types import Bools, Floats

_LEAST_TRAVEL = 2.0 * POINT_REACH
"""Px: so that what is behind a point is seen when it is elsewhere."""
_CLEAR = 5.0
"""Px from a point from which on nothing of it is seen."""
_BEHIND = 32
"""Frames, nearest in time, whose median is what is behind a point."""
_LEAST_BEHIND = 6
_WINDOWS = 96
"""Windows of one track that are looked at, at most."""
_INNER = 2.5
"""Px from a point within which what it is not shows in what a Gaussian leaves."""
_OUTER = 3.5
"""Px from it beyond which only noise is left."""
_ROUNDS = 12
_NODES = 9
"""Places along the way of a frame's exposure at which the point is drawn."""
_WIDEST = 0.03
"""Standard error of a sigma, as a share of it, beyond which it tells too little. Treetops, rotors, cars and waves
that were taken for points had 0.03 to 0.3, or less height than the next; points of ten sigmas 0.02 in 40 frames."""
_HEIGHT = 8.0
"""Least height of a point, sigmas of the noise, in the median of its frames."""
_MISFIT, _NO_CHANCE = 0.005, 3.0
"""Rms of what a Gaussian leaves beside noise, as a share of its height, and standard errors of its square, above both
of which a thing is no point: points leave up to 0.003, aircraft of 2 to 4 px 0.005 to 0.04, a boat more beyond its
middle than within."""
_ROUGHLY = 0.005
"""What half an interval has at least, as a share of sigma: gains that differ from pixel to pixel, lag and clouds that
evolve put sigmas of bright points off by up to 0.003 of them, whatever the noise."""
_LONGEST = 1.25
"""Greatest square of the part of a frame's way that is smeared: all of it, and a tenth, for the way is told roughly."""
_STEP = 1e-3
_SIDE = np.arange(-POINT_REACH, POINT_REACH + 1.0)


@dataclass(frozen=True, eq=False)
class Windows:
    """Pictures of one point less what is behind it (K, side, side), which pixels of them count, and its way in a frame
    (K, 2), px across and down."""

    pictures: Floats
    good: Bools
    ways: Floats


def passing_blurs(frames: Values, bad: Bools, top: float = math.inf) -> list[Measured]:
    """Sigmas, px, of points that pass before a scene that stands, in frames (T, rows, columns), each with its interval.

    Of each point, what is behind it is taken off: the median of the frames nearest in time in which it is elsewhere. To
    all that is left, one Gaussian integrated over the pixels is fitted, smeared along the point's way by an unknown
    part of it, which is the exposure's; where it is in each frame, how bright, and a plane beneath are free. What comes
    near `top`, the highest count there can be, is cut off there: its width says nothing.
    """
    found: list[Measured] = []
    if len(frames) < LEAST_POINT_FRAMES:
        return found
    moving = tracks(frames, bad, LEAST_POINT_FRAMES, _LEAST_TRAVEL)
    for track in moving:
        seen = _windows(frames, bad, track, [other for other in moving if other is not track], top)
        if seen is not None and (blur := _fitted(seen)) is not None:
            found.append(blur)
    return found


def _windows(frames: Values, bad: Bools, track: Track, others: list[Track], top: float) -> Windows | None:
    """Of a track, where nothing else is near; None where these are too few."""
    times, places = np.array(track.frames), np.array(track.places)
    every = np.arange(len(frames))
    way = np.stack([np.interp(every, times, places[:, axis]) for axis in (0, 1)], axis=1)
    smooth = _smoothed(times, places)
    pictures, good, ways = [], [], []
    for place in evenly(len(times), _WINDOWS):
        k, (row, column) = int(times[place]), (round(each) for each in places[place].tolist())
        rows, columns = (slice(at - POINT_REACH, at + POINT_REACH + 1) for at in (row, column))
        inside = all(POINT_REACH <= at < side - POINT_REACH for at, side in zip((row, column), bad.shape, strict=True))
        if not inside or bad[row - 1 : row + 2, column - 1 : column + 2].any() or _crowded(k, row, column, others):
            continue
        behind = _behind(frames[:, rows, columns], k, way - (row, column))
        seen = frames[k, rows, columns]
        if behind is None or seen.max() >= FULL * top:
            continue
        pictures.append(seen - behind)
        good.append(~bad[rows, columns])
        ways.append(smooth[place][::-1])
    if len(pictures) < LEAST_POINT_FRAMES:
        return None
    return Windows(np.stack(pictures), np.stack(good), np.stack(ways))


def _crowded(frame: int, row: int, column: int, others: list[Track]) -> bool:
    """Whether another track is near in this frame."""
    near = 2 * POINT_REACH
    for other in others:
        if frame in other.frames:
            there = other.places[other.frames.index(frame)]
            if max(abs(there[0] - row), abs(there[1] - column)) <= near:
                return True
    return False


def _behind(window: Values, frame: int, way: Floats) -> Floats | None:
    """What is in a window (T, side, side) without the point, by the frames nearest in time to one in which it is
    elsewhere; `way` (T, 2) is where it is from the window's middle, rows and columns. None where it never is."""
    down, across = _SIDE[None, :, None] - way[:, 0, None, None], _SIDE[None, None, :] - way[:, 1, None, None]
    clear = np.hypot(down, across) > _CLEAR
    order = np.argsort(np.abs(np.arange(len(window)) - frame), kind="stable")
    clear = clear[order]
    clear &= clear.cumsum(axis=0) <= _BEHIND
    if clear.sum(axis=0).min() < _LEAST_BEHIND:
        return None
    used = clear.any(axis=(1, 2))
    return np.asarray(np.nanmedian(np.where(clear[used], window[order][used].astype(np.float64), np.nan), axis=0))


def _smoothed(times: Floats, places: Floats) -> Floats:
    """Speeds (K, 2), px a frame, of a way, each by a straight line over the three detections before and after."""
    speeds = np.empty(places.shape)
    for k in range(len(times)):
        near = slice(max(k - 3, 0), k + 4)
        speeds[k] = np.polyfit(times[near], places[near], 1)[0]
    return speeds


def _fitted(seen: Windows) -> Measured | None:
    """The sigma of the point that was seen; None where it is no point, or tells too little."""
    from scipy.stats import t

    count = len(seen.pictures)
    data = np.where(seen.good, seen.pictures, 0.0).reshape(count, -1)
    centres, sigma, streak = np.zeros((count, 2)), 0.7, 0.0
    low, high = SIGMAS
    for _ in range(_ROUNDS):
        basis, turned, shape = _linear(seen, centres, sigma, streak)
        weights = np.linalg.pinv(basis) @ data[:, :, None]
        heights = weights[:, 0]
        left = data - (basis @ weights)[:, :, 0]
        turned = turned * heights[:, :, None]
        turned = turned - basis @ (np.linalg.pinv(basis) @ turned)
        normal = np.einsum("kni,knj->ij", turned, turned)
        pulls = np.einsum("kni,kn->ki", turned, left)
        step = np.linalg.pinv(normal) @ pulls.sum(axis=0)
        if streak + step[1] <= 0 or streak + step[1] >= _LONGEST:
            bound = float(np.clip(streak + step[1], 0, _LONGEST)) - streak
            step = np.array([(pulls[:, 0].sum() - normal[0, 1] * bound) / normal[0, 0], bound])
        sigma = float(np.clip(sigma + np.clip(step[0], -0.2, 0.2), 0.8 * low, 1.2 * high))
        streak = float(np.clip(streak + np.clip(step[1], -0.3, 0.3), 0, _LONGEST))
        moved = weights[:, 1:3, 0] / np.where(np.abs(heights) > 0, heights, np.inf)
        centres = np.clip(centres + np.clip(moved, -0.5, 0.5), -1.5, 1.5)
    away = np.hypot(_SIDE[:, None], _SIDE[None, :]).ravel()
    free = seen.good.reshape(count, -1) - np.einsum("kni,kin->kn", basis, np.linalg.pinv(basis))
    outer, inner = away > _OUTER, away < _INNER
    noise = np.square(left[:, outer]).sum() / free[:, outer].sum()
    beyond = np.square(left[:, inner]).sum() - noise * free[:, inner].sum()
    peaks = np.abs(heights[:, 0] * shape)
    misfit = math.sqrt(abs(beyond) / (left.shape[1] * np.square(peaks).sum()))
    no_chance = abs(beyond) > _NO_CHANCE * noise * math.sqrt(2 * free[:, inner].sum())
    inverse = np.linalg.pinv(normal)
    scatter = inverse @ (pulls.T @ pulls) @ inverse * count / (count - 2)
    error = math.sqrt(max(scatter[0, 0], noise * inverse[0, 0]))
    faint = error > _WIDEST * sigma or np.median(peaks) < _HEIGHT * math.sqrt(noise)
    if faint or not low < sigma < high or (misfit > _MISFIT and no_chance):
        return None
    reach = math.hypot(float(t.ppf((1 + LEVEL) / 2, count - 2)) * error, _ROUGHLY * sigma)
    return Measured(sigma, sigma - reach, sigma + reach)


def _linear(seen: Windows, centres: Floats, sigma: float, streak: float) -> tuple[Floats, Floats, Floats]:
    """About a guess, how windows (K, pixels) change with a point's light, its two places and a plane (6); with sigma
    and streak (2), for a light of 1; and its highest pixel (K,)."""
    here = _drawn(centres, seen.ways, sigma, streak)
    across, down = (
        (_drawn(centres + shift, seen.ways, sigma, streak) - _drawn(centres - shift, seen.ways, sigma, streak))
        / (2 * _STEP)
        for shift in _STEP * np.eye(2)
    )
    wider = (_drawn(centres, seen.ways, sigma + _STEP, streak) - here) / _STEP
    longer = (_drawn(centres, seen.ways, sigma, streak + 0.02) - here) / 0.02
    y, x = (np.broadcast_to(axis, here.shape) for axis in np.meshgrid(_SIDE, _SIDE, indexing="ij"))
    good = seen.good[..., None]
    basis = np.stack([here, across, down, np.ones(here.shape), x, y], axis=-1) * good
    turned = np.stack([wider, longer], axis=-1) * good
    count = len(here)
    return basis.reshape(count, -1, 6), turned.reshape(count, -1, 2), here.max(axis=(1, 2))


def _drawn(centres: Floats, ways: Floats, sigma: float, streak: float) -> Floats:
    """Points of a light of 1 (K, side, side) at `centres` (K, 2), px across and down from the middle, smeared along
    the square root of `streak` of their ways."""
    from scipy.special import ndtr

    edges = np.arange(-POINT_REACH, POINT_REACH + 2) - 0.5
    total = np.zeros((len(centres), len(_SIDE), len(_SIDE)))
    for node in (np.arange(_NODES) + 0.5) / _NODES - 0.5:
        places = centres + node * math.sqrt(streak) * ways
        x, y = (np.diff(ndtr((edges - places[:, axis, None]) / sigma)) for axis in (0, 1))
        total += y[:, :, None] * x[:, None, :]
    return total / _NODES
