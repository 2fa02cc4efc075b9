"""`irtrack train identity`: classifiers of the classes of rendered targets."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from irsim.rng import stream
from irsim.types import Floats
from irtrack.features.recognition import recognition_vector
from irtrack.models.classes import ClassModel, fit_classes
from irtrack.models.files import Card
from irtrack.training.frames import SCENARIOS, SEEDS, LabelledFrame, Set, box_of

CLASSES = {
    **dict.fromkeys(("fighter", "airliner", "helicopter"), "aircraft"),
    "quadrotor": "drone",
    "bird": "bird",
    "boat": "boat",
    "pedestrian": "person",
    **dict.fromkeys(("car", "truck", "tank"), "vehicle"),
}
"""Class of each class of the ground truth; targets of other classes are no examples."""
NAMES = tuple(sorted(set(CLASSES.values())))
SIZE_ONLY = 2
"""Number of the first features, the logarithms of the sides, of the classifier by size alone."""
MOST_EACH = 120
"""Largest number of examples of a class."""


def train_identity(frames: Mapping[Set, Sequence[LabelledFrame]], command: str) -> tuple[ClassModel, Card]:
    """Return the model and its card: accuracies of each method, beside those by size alone."""
    sets = {name: _examples(each) for name, each in frames.items()}
    names = tuple(name for k, name in enumerate(NAMES) if all((labels == k).any() for _, labels in sets.values()))
    kept = {key: _renumbered(vectors, labels, names) for key, (vectors, labels) in sets.items()}
    vectors, labels = _balanced(*kept["training"])
    rng = stream(0, "training", "identity")
    model = fit_classes(vectors, labels, *kept["calibration"], names, rng)
    plain = fit_classes(
        vectors[:, :SIZE_ONLY], labels, kept["calibration"][0][:, :SIZE_ONLY], kept["calibration"][1], names, rng
    )
    fresh, truth = kept["scores"]
    scores = {}
    for method in ("svm", "network", "neighbours"):
        for label, each, columns in (("", model, fresh.shape[1]), (" by size alone", plain, SIZE_ONLY)):
            found = each.probabilities(fresh[:, :columns], method).argmax(axis=1)
            rates = [float((found[truth == k] == k).mean()) for k in range(len(names))]
            scores[f"mean accuracy of the classes, {method}{label}"] = round(float(np.mean(rates)), 4)
    card = Card(
        data=SCENARIOS,
        seeds={str(key): list(seeds) for key, seeds in SEEDS.items()},
        examples={name: int((labels == k).sum()) for k, name in enumerate(names)},
        scores=scores,
        command=command,
    )
    return model, card


def _examples(frames: Iterable[LabelledFrame]) -> tuple[Floats, npt.NDArray[np.int64]]:
    """Return vectors (n, d) and classes (n,), places in `NAMES`."""
    rows = [
        (recognition_vector(frame.image, box_of(target)), NAMES.index(CLASSES[target.cls]))
        for frame in frames
        for target in frame.examples()
        if target.cls in CLASSES
    ]
    return np.array([vector for vector, _ in rows]), np.array([label for _, label in rows], np.int64)


def _renumbered(
    vectors: Floats, labels: npt.NDArray[np.int64], names: tuple[str, ...]
) -> tuple[Floats, npt.NDArray[np.int64]]:
    """Return the examples of the classes `names`, with their places in it."""
    places = np.array([names.index(name) if name in names else -1 for name in NAMES])
    found = places[labels]
    return vectors[found >= 0], found[found >= 0]


def _balanced(vectors: Floats, labels: npt.NDArray[np.int64]) -> tuple[Floats, npt.NDArray[np.int64]]:
    """Return at most `MOST_EACH` examples of each class, evenly spread."""
    rows = []
    for k in np.unique(labels):
        own = np.flatnonzero(labels == k)
        rows.append(own[np.linspace(0, len(own) - 1, min(len(own), MOST_EACH)).astype(int)])
    taken = np.concatenate(rows)
    return vectors[taken], labels[taken]
