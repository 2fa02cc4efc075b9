"""`irtrack train adaboost`: boosted stumps on Haar-like features, with hard negatives."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from irsim.rng import stream
from irsim.types import Bools, Floats
from irtrack.features.haar import HaarFeatures, IntegralImage
from irtrack.models.adaboost import Stumps, fit_stumps
from irtrack.models.files import Card
from irtrack.models.haar import HaarModel
from irtrack.training.frames import SCENARIOS, SEEDS, LabelledFrame, Set
from irtrack.training.scores import roc_scores
from irtrack.training.windows import Windows, windows_of

SIDE, STANDARD, STEP = 16, (8, 8), 2
"""Window of 16 x 16 px, with the box of any target in its middle; step of the rectangles' sides and places, px."""
FEATURES = 600
"""Number of features, drawn from all 2137, among which stumps choose."""
STUMPS = (20, 50)
"""Numbers of stumps before and after hard negatives (Viola, Jones 2004: those that pass the stages so far)."""
HARDEST = 4
"""Largest number of hard negatives of a target or background in a round."""
STRIDE = 0.25
"""Grid of windows among which hard negatives are sought: step in sides of the box."""
FALSE_ALARMS = 0.01
"""Share of the calibration's negatives that pass the threshold of a detection."""


def train_adaboost(frames: Mapping[Set, Sequence[LabelledFrame]], command: str) -> tuple[HaarModel, Card]:
    """Return the model and its card."""
    parts = list(windows_of(frames["training"], STANDARD))
    every = HaarFeatures.of(SIDE, STEP)
    every = every.take(np.sort(stream(0, "training", "haar").permutation(len(every))[:FEATURES]))
    model = HaarModel(every, STANDARD, Stumps(*(np.zeros(0, np.int64), *np.zeros((4, 0)))), 0.0)
    values, positive = _stacked(model, parts)
    for count in STUMPS:
        if len(model.stumps.alpha):
            hard = np.concatenate([_hard_negatives(model, each, every) for each in parts])
            values = np.concatenate([values, hard])
            positive = np.concatenate([positive, np.zeros(len(hard), bool)])
        stumps = fit_stumps(values, positive, count)
        model = HaarModel(every.take(stumps.feature), STANDARD, stumps, 0.0)
    wrong = (stumps.decisions(values[:, stumps.feature]) > 0) != positive
    held, held_positive = _stacked(model, windows_of(frames["calibration"], STANDARD))
    threshold = float(np.quantile(stumps.decisions(held)[~held_positive], 1 - FALSE_ALARMS))
    fresh, fresh_positive = _stacked(model, windows_of(frames["scores"], STANDARD))
    card = Card(
        data=SCENARIOS,
        seeds={str(key): list(seeds) for key, seeds in SEEDS.items()},
        examples={"target": int(positive.sum()), "no target": int((~positive).sum())},
        scores={
            **roc_scores(stumps.decisions(fresh), fresh_positive),
            "training error": round(float(wrong.mean()), 4),
            "bound of the training error": round(stumps.bound, 4),
        },
        command=command,
    )
    return replace(model, threshold=threshold), card


def _stacked(model: HaarModel, parts: Iterable[Windows]) -> tuple[Floats, Bools]:
    """Return the values of the model's features of all windows, and whether each is positive.

    Windows have the target's own size; those that then overlap a target, and are not positive, are left out.
    """
    values, classes = [], []
    for part in parts:
        boxes = np.concatenate([part.given[:, :2], np.broadcast_to(part.unit, (len(part.given), 2))], axis=1)
        kept = part.positive | part.negative(boxes)
        values.append(_values(model, part, boxes[kept]))
        classes.append(part.positive[kept])
    return np.concatenate(values), np.concatenate(classes)


def _values(model: HaarModel, part: Windows, boxes: Floats) -> Floats:
    """Return the values (n, F) of the model's features about boxes (n, 4); of cold targets, in the negative picture."""
    pixels = -part.region.pixels if part.cold else part.region.pixels
    return model.features.values(IntegralImage.of(pixels), model.corners(part.region, boxes[:, :2]))


def _hard_negatives(model: HaarModel, part: Windows, every: HaarFeatures) -> Floats:
    """Return the values of all features in the negative windows of the largest decisions above 0."""
    boxes = part.grid(STRIDE, (1.0,))
    boxes = boxes[part.negative(boxes)]
    decisions = model.stumps.decisions(_values(model, part, boxes))
    order = np.argsort(-decisions, kind="stable")[:HARDEST]
    return _values(replace(model, features=every), part, boxes[order[decisions[order] > 0]])
