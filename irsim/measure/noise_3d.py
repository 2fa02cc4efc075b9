"""The seven terms of 3-D noise.

J. A. D'Agostino and C. M. Webb, "Three-dimensional analysis framework and measurement methodology for
imaging system noise", Proc. SPIE 1488 (1991). Their directional averages leave a part of each finer
term in the coarser ones; here each is freed of it by the expected mean squares of a three-way layout
with one observation a cell (H. Scheffe, "The Analysis of Variance", 1959, section 7.4): unbiased in
variance. t is time, v vertical (row to row), h horizontal (column to column).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irsim.errors import InputError, counted
from irsim.measure.given import Values, check_frames
from irsim.measure.interval import LEVEL, Measured, root
from irsim.measure.region import LEAST_REGION_SIDE
from irsim.rng import stream
from irsim.types import Floats

TERMS = ("t", "v", "h", "tv", "th", "vh", "tvh")
LEAST_NOISE_FRAMES = 4
_DRAWS = 4000


@dataclass(frozen=True, slots=True)
class Noise3dTerms:
    """Sigmas in the units of the frames, each with its 95 % interval."""

    t: Measured
    v: Measured
    h: Measured
    tv: Measured
    th: Measured
    vh: Measured
    tvh: Measured


def noise_3d(frames: Values, time_freedom: float | None = None, moving: bool = False) -> Noise3dTerms:
    """The terms of frames (T, rows, columns) of a flat scene, in their units.

    time_freedom    degrees of freedom of a series about its mean; T - 1 where noise is white in time
    moving          whether something moves: the finer terms are then not independent, and say nothing of how much of
                    a term is theirs. Each may be anything up to all that differs along its axes; and so, too, where
                    more is taken out of a term than chance lets be in it

    The intervals are those of generalised pivotal quantities (S. Weerahandi, "Generalized Confidence
    Intervals", JASA 88, 1993): mean squares over chi-squares, drawn with a fixed seed. InputError for
    frames that are no array of finite numbers, and for fewer than 4 frames, rows or columns.
    """
    check_frames(frames)
    check_size(frames)
    squares = mean_squares(frames)
    estimates = components(squares, frames.shape)
    times, rows, columns = frames.shape
    sides = {"t": times - 1 if time_freedom is None else time_freedom, "v": rows - 1, "h": columns - 1}
    draws = {}
    for term, square in squares.items():
        freedom = np.prod([sides[axis] for axis in term])
        draws[term] = square * freedom / stream(0, "noise_3d", term).chisquare(freedom, _DRAWS)
    drawn = components(draws, frames.shape)
    ends = ((1 - LEVEL) / 2, (1 + LEVEL) / 2)
    terms = {}
    for term in TERMS:
        low, high = np.quantile(drawn[term], ends)
        if moving or high <= 0:
            others = np.prod([size for axis, size in zip("tvh", frames.shape, strict=True) if axis not in term])
            low, high = 0.0, max(high, estimates[term], np.quantile(draws[term], ends[1]) / others)
        terms[term] = Measured(float(estimates[term]), float(low), float(high)).map(root)
    return Noise3dTerms(**terms)


def check_size(frames: Values) -> None:
    """InputError where frames (T, rows, columns) are too few or too small to say anything."""
    times, rows, columns = frames.shape
    if times < LEAST_NOISE_FRAMES:
        few = f"{counted(times, 'frame')} {'is' if times == 1 else 'are'} too few"
        raise InputError(f"{few} to measure noise; allowed: at least {LEAST_NOISE_FRAMES}")
    if min(rows, columns) < LEAST_REGION_SIDE:
        raise InputError(
            f"a region of {columns}x{rows} px is too small to measure noise; "
            f"allowed: at least {LEAST_REGION_SIDE}x{LEAST_REGION_SIDE}"
        )


def mean_squares(frames: Values) -> dict[str, Floats]:
    """Mean square of each effect of frames (T, rows, columns), in the order of `TERMS`; float64."""
    values = np.asarray(frames, np.float64)
    size = values.shape
    axis = {"t": 0, "v": 1, "h": 2}
    means = {term: values.mean(axis=tuple(axis[a] for a in "tvh" if a not in term), keepdims=True) for term in TERMS}
    level = values.mean(keepdims=True)
    effects: dict[str, Floats] = {}
    found: dict[str, Floats] = {}
    for term in TERMS:
        effect = means[term] - level
        for inner, known in effects.items():
            if set(inner) < set(term):
                effect = effect - known
        effects[term] = effect
        others = np.prod([size[axis[a]] for a in "tvh" if a not in term])
        freedom = np.prod([size[axis[a]] - 1 for a in term])
        found[term] = others * np.square(effect).sum() / freedom
    return found


def components(squares: dict[str, Floats], shape: tuple[int, ...]) -> dict[str, Floats]:
    """Unbiased variances of the terms from mean squares; an estimate may come out below 0.

    E[MS_tvh] = s_tvh, E[MS_tv] = s_tvh + H s_tv, E[MS_t] = s_tvh + H s_tv + V s_th + V H s_t, and so
    on in turn (s the variances, T, V, H the size).
    """
    times, rows, columns = shape
    s = squares
    return {
        "tvh": s["tvh"],
        "tv": (s["tv"] - s["tvh"]) / columns,
        "th": (s["th"] - s["tvh"]) / rows,
        "vh": (s["vh"] - s["tvh"]) / times,
        "t": (s["t"] - s["tv"] - s["th"] + s["tvh"]) / (rows * columns),
        "v": (s["v"] - s["tv"] - s["vh"] + s["tvh"]) / (times * columns),
        "h": (s["h"] - s["th"] - s["vh"] + s["tvh"]) / (times * rows),
    }
