"""Three-dimensional noise: seven variance terms of frames of a flat scene, along time (t), rows (v) and columns (h).

J. A. D'Agostino and C. M. Webb, "Three-dimensional analysis framework and measurement methodology for imaging system
noise", Proc. SPIE 1488 (1991). Their directional averages leave a part of each finer term in the coarser ones. The
expected mean squares of a three-way layout with one observation per cell remove it (H. Scheffe, "The Analysis of
Variance", 1959, section 7.4), so that variances are unbiased.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irsim.calibration.statistics import LEVEL, Estimate, Values, check_frames, check_size, root
from irsim.rng import stream
from irsim.types import Floats

TERMS = ("t", "v", "h", "tv", "th", "vh", "tvh")
_DRAWS = 4000


@dataclass(frozen=True, slots=True)
class Noise3dTerms:
    """Sigma of each noise term, in the units of the frames."""

    t: Estimate
    v: Estimate
    h: Estimate
    tv: Estimate
    th: Estimate
    vh: Estimate
    tvh: Estimate


def noise_3d(frames: Values, time_freedom: float | None = None, moving: bool = False) -> Noise3dTerms:
    """Return the noise terms of frames (T, rows, columns) of a flat scene, in their units.

    time_freedom    degrees of freedom of a series about its mean; T - 1 for noise that is white in time
    moving          True with motion: each term is bounded by the whole variation along its axes

    Intervals are those of generalised pivotal quantities (S. Weerahandi, JASA 88, 1993): mean squares over chi-squares,
    drawn with a fixed seed. Raises InputError for other arrays, and for fewer than 4 frames, rows or columns.
    """
    check_frames(frames)
    check_size(frames)
    squares = _mean_squares(frames)
    estimates = _components(squares, frames.shape)
    times, rows, columns = frames.shape
    sides = {"t": times - 1 if time_freedom is None else time_freedom, "v": rows - 1, "h": columns - 1}
    draws = {}
    for term, mean_square in squares.items():
        freedom = np.prod([sides[axis] for axis in term])
        draws[term] = mean_square * freedom / stream(0, "noise_3d", term).chisquare(freedom, _DRAWS)
    drawn = _components(draws, frames.shape)
    terms = {}
    for term in TERMS:
        low, high = np.quantile(drawn[term], ((1 - LEVEL) / 2, (1 + LEVEL) / 2))
        if moving or high <= 0:
            others = np.prod([size for axis, size in zip("tvh", frames.shape, strict=True) if axis not in term])
            low, high = 0.0, max(high, estimates[term], np.quantile(draws[term], (1 + LEVEL) / 2) / others)
        terms[term] = Estimate(float(estimates[term]), float(low), float(high)).map(root)
    return Noise3dTerms(**terms)


def _mean_squares(frames: Values) -> dict[str, Floats]:
    """Return the mean square of each effect of frames (T, rows, columns), in the order of `TERMS`."""
    values = np.asarray(frames, np.float64)
    size, axis = values.shape, {"t": 0, "v": 1, "h": 2}
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


def _components(squares: dict[str, Floats], shape: tuple[int, ...]) -> dict[str, Floats]:
    """Return the unbiased variances of the terms from their mean squares; an estimate may be negative.

    E[MS_tvh] = s_tvh, E[MS_tv] = s_tvh + H s_tv, E[MS_t] = s_tvh + H s_tv + V s_th + V H s_t, and likewise for the
    other terms (s are the variances; T, V and H the numbers of frames, rows and columns).
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
