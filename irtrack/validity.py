"""Checks of the outputs of trackers and detectors: shapes, finite numbers, sizes above 0, allowed words."""

from __future__ import annotations

from typing import get_args

import numpy as np

from irsim.errors import counted
from irsim.types import Floats
from irtrack.tracks import STATUSES, TrackFrame
from irtrack.types import FARTHEST_PX, Detections, Estimate, Status

_SHAPES: dict[str, tuple[int | None, ...]] = {
    "center": (2,),
    "size": (2,),
    "score": (),
    "velocity": (2,),
    "covariance": (2, 2),
    "neff": (),
    "particles": (None, None),
    "weights": (None,),
}
"""Shapes of the fields of an Estimate; None: any number of elements."""


def fault(estimate: object) -> str | None:
    """Describe the error in an output of a tracker, with the allowed values; None where it is a valid `Estimate`."""
    if not isinstance(estimate, Estimate):
        return f"step gave (state, {type(estimate).__name__}); allowed: (state, Estimate)"
    if estimate.status not in get_args(Status):
        return f"the status {estimate.status!r}; allowed: {', '.join(get_args(Status))}"
    for name, shape in _SHAPES.items():
        value = getattr(estimate, name)
        if value is None and name not in ("center", "size"):
            continue
        try:
            numbers = np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError):
            return f"the {name} {' '.join(repr(value).split())}; allowed: numbers"
        if len(numbers.shape) != len(shape) or any(
            n not in (None, m) for n, m in zip(shape, numbers.shape, strict=True)
        ):
            wanted = ", ".join("any" if n is None else str(n) for n in shape)
            return f"the {name} has the shape {numbers.shape}; allowed: ({wanted})"
        if not np.isfinite(numbers).all():
            return f"the {name} {' '.join(str(value).split())}; allowed: finite numbers"
        if name in ("center", "size") and np.abs(numbers).max() > FARTHEST_PX:
            return f"the {name} {' '.join(str(value).split())}; allowed: within {FARTHEST_PX:g} px"
    if min(estimate.size) <= 0:
        return f"the size {estimate.size}; allowed: above 0"
    if estimate.covariance is not None and min(np.diagonal(estimate.covariance)) < 0:
        return f"the covariance {np.asarray(estimate.covariance).tolist()}; allowed: variances of 0 or more"
    if estimate.weights is not None:
        return _fault_of_weights(estimate.weights, estimate.particles)
    return None


def _fault_of_weights(weights: Floats, particles: Floats | None) -> str | None:
    if particles is None or len(particles) != len(weights):
        there = "no particles" if particles is None else counted(len(particles), "particle")
        return f"{counted(len(weights), 'weight')} for {there}; allowed: one for each"
    if np.min(weights) < 0 or abs(np.sum(weights) - 1) > 1e-6:
        return f"the weights sum to {np.sum(weights):g}, the least is {np.min(weights):g}; allowed: 0 or more, sum 1"
    return None


def fault_of_detections(found: object) -> str | None:
    """Return the error of an output of a detector, with the allowed values; None where it is valid."""
    if not isinstance(found, Detections):
        return f"detect gave {type(found).__name__}; allowed: Detections"
    count = len(found.scores) if np.ndim(found.scores) == 1 else 0
    for name, shape in (("centers", (count, 2)), ("sizes", (count, 2)), ("scores", (count,))):
        values = np.asarray(getattr(found, name))
        if values.shape != shape or values.dtype.kind not in "fiu":
            return f"the {name} are {values.dtype} of shape {values.shape}; allowed: numbers of shape {shape}"
        if not np.isfinite(values).all():
            return f"the {name} of detection {int(np.argwhere(~np.isfinite(values))[0][0])} are not finite"
    if count and (found.sizes.min() <= 0 or max(np.abs(found.centers).max(), found.sizes.max()) > FARTHEST_PX):
        return f"a size of 0 or less, or a box beyond {FARTHEST_PX:g} px; allowed: sizes above 0, inside that range"
    if found.classes is not None and len(found.classes) != count:
        return f"{len(found.classes)} classes for {counted(count, 'detection')}; allowed: one each"
    if found.covariances is not None:
        if np.shape(found.covariances) != (count, 2, 2):
            return f"the covariances have the shape {np.shape(found.covariances)}; allowed: ({count}, 2, 2)"
        if count and not (np.isfinite(found.covariances).all() and found.covariances[:, (0, 1), (0, 1)].min() >= 0):
            return "a covariance is not finite or has a variance below 0"
    return None


def fault_of_tracks(found: object) -> str | None:
    """Return the error of an output of a tracker of many, with the allowed values; None where it is valid."""
    if not isinstance(found, TrackFrame):
        return f"step gave (state, {type(found).__name__}); allowed: (state, TrackFrame)"
    if np.ndim(found.ids) != 1 or np.asarray(found.ids).dtype.kind not in "iu":
        return f"the ids are {np.asarray(found.ids).dtype} of shape {np.shape(found.ids)}; allowed: whole numbers (n,)"
    count = len(found.ids)
    if len(np.unique(found.ids)) < count:
        values, numbers = np.unique(found.ids, return_counts=True)
        return f"two tracks have the id {int(values[numbers > 1][0])}; allowed: each id once a frame"
    for name, shape in (("centers", (count, 2)), ("sizes", (count, 2)), ("scores", (count,)), ("confirmed", (count,))):
        if np.shape(getattr(found, name)) != shape:
            return f"the {name} have the shape {np.shape(getattr(found, name))}; allowed: {shape}"
    for name in ("statuses", "classes", "velocities", "covariances"):
        values = getattr(found, name)
        if values is not None and len(values) != count:
            return f"{len(values)} {name} for {counted(count, 'track')}; allowed: one each"
    unknown = sorted(set(found.statuses) - set(STATUSES))
    if unknown:
        return f"the status {unknown[0]!r}; allowed: {', '.join(STATUSES)}"
    for name in ("centers", "sizes", "velocities", "covariances"):
        values = getattr(found, name)
        if values is not None and not np.isfinite(values).all():
            row = int(np.argwhere(~np.isfinite(np.asarray(values).reshape(count, -1)).all(axis=1))[0][0])
            return f"the {name} of track {int(found.ids[row])} are not finite"
    if np.isinf(found.scores).any():
        return f"the score of track {int(found.ids[np.isinf(found.scores)][0])} is infinite; allowed: a number, or nan"
    if count and (found.sizes.min() <= 0 or max(np.abs(found.centers).max(), found.sizes.max()) > FARTHEST_PX):
        return f"a size of 0 or less, or a box beyond {FARTHEST_PX:g} px; allowed: sizes above 0, inside that range"
    return None
