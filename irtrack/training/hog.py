"""`irtrack train hog`: the linear SVM on oriented gradients, with hard negatives, and its probabilities."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from irsim.types import Bools, Floats
from irtrack.features.hog import HOG
from irtrack.models.files import Card
from irtrack.models.hog import HOGModel
from irtrack.models.svm import LinearSVM, fit_platt, fit_svm
from irtrack.training.frames import SCENARIOS, SEEDS, LabelledFrame, Set
from irtrack.training.scores import roc_scores
from irtrack.training.windows import Windows, windows_of

LAYOUT, STANDARD = HOG(20, 20, 4), (10, 10)
"""Window of 5 x 5 cells, with the box of any target in its middle: half the window is surroundings."""
COST = 0.1
"""C of the SVM."""
ROUNDS = 2
"""Rounds of hard negatives (Dalal, Triggs 2005: one)."""
HARDEST = 8
"""Largest number of hard negatives of a target or background in a round."""
STRIDE, SCALES = 0.25, (0.8, 1.25)
"""Grid of windows among which hard negatives are sought: step in sides of the box, and sizes."""


def train_hog(frames: Mapping[Set, Sequence[LabelledFrame]], command: str) -> tuple[HOGModel, Card]:
    """Return the model and its card."""
    parts = list(windows_of(frames["training"], STANDARD))
    model = HOGModel(LAYOUT, STANDARD, LinearSVM(np.zeros(LAYOUT.length), 0.0))
    vectors, positive = _stacked(model, parts)
    for number in range(ROUNDS + 1):
        if number:
            hard = np.concatenate([_hard_negatives(model, part) for part in parts])
            vectors = np.concatenate([vectors, hard])
            positive = np.concatenate([positive, np.zeros(len(hard), bool)])
        model = HOGModel(LAYOUT, STANDARD, fit_svm(vectors, positive, COST))
    held, held_positive = _held_out(model, windows_of(frames["calibration"], STANDARD))
    a, c = fit_platt(held, held_positive)
    model = HOGModel(LAYOUT, STANDARD, LinearSVM(model.svm.w, model.svm.b, a, c))
    fresh, fresh_positive = _stacked(model, windows_of(frames["scores"], STANDARD))
    card = Card(
        data=SCENARIOS,
        seeds={str(key): list(seeds) for key, seeds in SEEDS.items()},
        examples={"target": int(positive.sum()), "no target": int((~positive).sum())},
        scores=roc_scores(model.svm.margins(fresh), fresh_positive),
        command=command,
    )
    return model, card


def _stacked(model: HOGModel, parts: Iterable[Windows]) -> tuple[Floats, Bools]:
    """Return the vectors of all windows, and whether each is positive."""
    pairs = [(model.vectors(each.region, each.given), each.positive) for each in parts]
    return np.concatenate([v for v, _ in pairs]), np.concatenate([p for _, p in pairs])


def _held_out(model: HOGModel, parts: Iterable[Windows]) -> tuple[Floats, Bools]:
    """Return the margins of the positive windows and of all negative ones on a grid, as in a detection."""
    margins, classes = [], []
    for part in parts:
        grid = part.grid(STRIDE, (1.0,))
        boxes = np.concatenate([part.given[part.positive], grid[part.negative(grid)]])
        margins.append(model.margins(part.region, boxes))
        classes.append(np.arange(len(boxes)) < int(part.positive.sum()))
    return np.concatenate(margins), np.concatenate(classes)


def _hard_negatives(model: HOGModel, part: Windows) -> Floats:
    """Return the vectors of the negative windows of the largest margins above -1."""
    boxes = part.grid(STRIDE, SCALES)
    boxes = boxes[part.negative(boxes)]
    vectors = model.vectors(part.region, boxes)
    margins = model.svm.margins(vectors)
    order = np.argsort(-margins, kind="stable")[:HARDEST]
    return vectors[order[margins[order] > -1]]
