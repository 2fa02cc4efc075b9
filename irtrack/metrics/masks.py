"""Figures of detection masks by the rules of the publications on small-target detection.

A prediction is a map (rows, cols) of 0..1, positive above .5; a truth is a map of bool. Targets are its 8-connected
components. The sums of several images add up; the shares are taken at the end.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields

import cv2
import numpy as np
import numpy.typing as npt

from irsim.types import Floats
from irtrack.errors import InputError

Mask = npt.NDArray[np.bool_]

THRESHOLD = 0.5
"""Value above which a prediction is positive."""
CENTROID_PX = 3.0
"""Distance of centroids, px, below which a component belongs to a target (DNANet, BasicIRSTD: metrics.py)."""
HIT_PX, FALSE_PX = 1, 4
"""Distances from a target's pixels, px: a positive pixel is a hit up to the first, false beyond the second (DTUM)."""


@dataclass(frozen=True, slots=True)
class MaskSums:
    """Sums over images; `+` adds those of other images.

    targets, detected, false_pixels   by centroids;  hits, stray_pixels   by the shooting rule
    both, either    pixels of prediction and truth, and of one of them
    iou_sum         sum over images of both / either; an image with neither adds 0
    """

    images: int = 0
    pixels: int = 0
    targets: int = 0
    detected: int = 0
    false_pixels: int = 0
    hits: int = 0
    stray_pixels: int = 0
    both: int = 0
    either: int = 0
    iou_sum: float = 0.0

    def __add__(self, other: MaskSums) -> MaskSums:
        return MaskSums(*(getattr(self, each.name) + getattr(other, each.name) for each in fields(self)))

    @property
    def pd(self) -> float:
        """Share of targets with a component whose centroid is within 3 px; each target takes the first such
        component."""
        return self.detected / self.targets if self.targets else np.nan

    @property
    def fa(self) -> float:
        """Share of all pixels that lie in components without a target."""
        return self.false_pixels / self.pixels if self.pixels else np.nan

    @property
    def shooting_pd(self) -> float:
        """Share of targets with a positive pixel within 1 px."""
        return self.hits / self.targets if self.targets else np.nan

    @property
    def shooting_fa(self) -> float:
        """Share of all pixels that are positive and farther than 4 px from all targets."""
        return self.stray_pixels / self.pixels if self.pixels else np.nan

    @property
    def iou(self) -> float:
        """Intersection over union of all pixels."""
        return self.both / self.either if self.either else np.nan

    @property
    def niou(self) -> float:
        """Mean over images of the intersection over union."""
        return self.iou_sum / self.images if self.images else np.nan


def mask_sums(predictions: Iterable[Floats], truths: Iterable[Mask]) -> MaskSums:
    """Return the sums over predictions and truths, image by image; InputError where shapes or values differ."""
    total = MaskSums()
    for prediction, truth in zip(predictions, truths, strict=True):
        if prediction.shape != truth.shape or prediction.ndim != 2 or truth.dtype != bool:
            shapes = f"prediction {prediction.shape}, truth {truth.shape} {truth.dtype}"
            raise InputError(f"{shapes}: allowed: maps of one shape, truth of bool")
        if float(prediction.min()) < 0 or float(prediction.max()) > 1:
            raise InputError("prediction: allowed: values from 0 to 1")
        total = total + _of_image(prediction > THRESHOLD, truth)
    return total


def _of_image(positive: Mask, truth: Mask) -> MaskSums:
    places, _ = components(truth)
    found, areas = components(positive)
    apart = np.hypot(*(places[:, None] - found[None]).transpose(2, 0, 1)) < CENTROID_PX
    taken = np.zeros(len(found), bool)
    for row in apart:
        free = np.flatnonzero(row & ~taken)
        taken[free[:1]] = True
    labels = _labelled(truth)
    near = cv2.dilate(positive.astype(np.uint8), np.ones((2 * HIT_PX + 1,) * 2, np.uint8)) > 0
    around = cv2.dilate(truth.astype(np.uint8), np.ones((2 * FALSE_PX + 1,) * 2, np.uint8)) > 0
    both, either = int((positive & truth).sum()), int((positive | truth).sum())
    return MaskSums(
        images=1,
        pixels=truth.size,
        targets=len(places),
        detected=int(taken.sum()),
        false_pixels=int(areas[~taken].sum()),
        hits=len(np.unique(labels[near & truth])),
        stray_pixels=int((positive & ~around).sum()),
        both=both,
        either=either,
        iou_sum=both / either if either else 0.0,
    )


def _labelled(mask: Mask) -> npt.NDArray[np.int32]:
    _, labels = cv2.connectedComponents(mask.astype(np.uint8), connectivity=8)
    return np.asarray(labels, dtype=np.int32)


def components(mask: Mask) -> tuple[Floats, npt.NDArray[np.int64]]:
    """Return centroids (n, 2) as (row, col) and areas (n,) of 8-connected components, in order of their first pixel."""
    labels = _labelled(mask)
    numbers, first = np.unique(labels, return_index=True)
    order = numbers[np.argsort(first)]
    order = order[order > 0]
    rows, columns = np.nonzero(mask)
    own = labels[rows, columns]
    areas = np.bincount(own, minlength=int(numbers.max(initial=0)) + 1)
    sums = [np.bincount(own, each, len(areas)) for each in (rows, columns)]
    centroids = np.stack([each[order] / np.maximum(areas[order], 1) for each in sums], axis=1)
    return centroids, areas[order].astype(np.int64)
