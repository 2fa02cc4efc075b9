"""Discriminator of real and rendered patches: how surely a classifier tells them apart.

The figure is the area under the ROC curve (AUC): .5 where the classifier guesses, 1 where it is always right. It is
trained on half of the places and half of the scenes and tested on the others, so that nothing it has seen of a place
helps it there. Extremely randomised trees: P. Geurts, D. Ernst, L. Wehenkel, Machine Learning 63, 2006.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from irsim.calibration.statistics import Estimate
from irsim.errors import InputError
from irsim.rng import stream
from irsim.types import Floats, Indices

TREES = 60
HALVINGS = 5
_DRAWS = 400
"""Bootstrap samples of an interval."""


def check_learning() -> None:
    """Raise InputError where scikit-learn is not installed."""
    try:
        import sklearn.ensemble  # noqa: F401
    except ImportError:
        raise InputError("a comparison with real clips needs scikit-learn: pip install 'irtrack[learn]'") from None


@dataclass(eq=False)
class _Pairs:
    """Pairs of a patch of group g (real) and one of group h (rendered) that were tested together.

    won    (groups, groups) pairs in which the rendered patch has the higher score, and half of the ties
    count  (groups, groups) pairs
    """

    won: Floats
    count: Floats

    def add(self, g: int, h: int, real: Floats, rendered: Floats) -> None:
        ordered = np.sort(real)
        below, upto = (np.searchsorted(ordered, rendered, side=side).sum() for side in ("left", "right"))
        self.won[g, h] += (below + upto) / 2
        self.count[g, h] += len(real) * len(rendered)

    def auc(self, weights: Floats) -> float:
        """Return the AUC for weights of the groups, (groups,); nan without pairs."""
        count = weights @ self.count @ weights
        return float(weights @ self.won @ weights / count) if count else np.nan


def discriminate(real: Sequence[Floats], rendered: Sequence[Floats], name: str, halvings: int = HALVINGS) -> Estimate:
    """Return the AUC between features (n, f) of real places and of rendered scenes, with its 95 % interval.

    `name` addresses the random halvings. At least two places and two scenes are needed.
    """
    groups, count, turns = [*real, *rendered], len(real), []
    for turn in range(halvings):
        generator = stream(0, "realism", "halves", name, turn)
        first, second = (generator.permutation(len(each)) for each in (real, rendered))
        turns.append(_test_halves(groups, first, second + count, generator))
    return _interval(turns, [np.arange(count), np.arange(count, len(groups))], f"{name} interval")


def floor(real: Sequence[Floats], name: str, halvings: int = HALVINGS) -> Estimate:
    """Return the AUC between halves of the real places, drawn at random: the least that can be reached.

    At least four places are needed.
    """
    turns = []
    for turn in range(halvings):
        generator = stream(0, "realism", "floor", name, turn)
        order = generator.permutation(len(real))
        turns.append(_test_halves(real, order[::2], order[1::2], generator))
    return _interval(turns, [np.arange(len(real))], f"{name} floor interval")


def _test_halves(
    groups: Sequence[Floats],
    first: Indices,
    second: Indices,
    generator: np.random.Generator,
) -> _Pairs:
    """Train on one half of either list of groups and test on the other, both ways; return the tested pairs."""
    from sklearn import config_context
    from sklearn.ensemble import ExtraTreesClassifier

    pairs = _Pairs(np.zeros((len(groups), len(groups))), np.zeros((len(groups), len(groups))))
    for half in range(2):
        trained, tested = ([each[start::2] for each in (first, second)] for start in (half, 1 - half))
        values = np.concatenate([groups[k] for each in trained for k in each])
        labels = np.repeat([0, 1], [sum(len(groups[k]) for k in each) for each in trained])
        trees = ExtraTreesClassifier(
            TREES, min_samples_leaf=2, class_weight="balanced", random_state=int(generator.integers(2**31)), n_jobs=1
        )
        every = [int(k) for each in tested for k in each]
        with config_context(assume_finite=True, skip_parameter_validation=True):  # checks cost more than a tree
            trees.fit(values, labels)
            scored = trees.predict_proba(np.concatenate([groups[k] for k in every]))[:, 1]
        ends = np.cumsum([len(groups[k]) for k in every])[:-1]
        scores = dict(zip(every, np.split(scored, ends), strict=True))
        for g in map(int, tested[0]):
            for h in map(int, tested[1]):
                pairs.add(g, h, scores[g], scores[h])
    return pairs


def _interval(turns: Sequence[_Pairs], kinds: Sequence[Indices], name: str) -> Estimate:
    """Return the AUC over all halvings, with a percentile bootstrap over the groups of each kind.

    A sample takes one halving at random: classifiers trained on other places differ, which a bootstrap of tested groups
    alone would leave out.
    """
    size, generator = sum(map(len, kinds)), stream(0, "realism", "bootstrap", name)
    drawn = []
    for _ in range(_DRAWS):
        chosen = np.concatenate([generator.choice(kind, len(kind)) for kind in kinds])
        weights = np.bincount(chosen, minlength=size).astype(np.float64)
        drawn.append(turns[int(generator.integers(len(turns)))].auc(weights))
    low, high = np.nanquantile(drawn, [0.025, 0.975])
    total = _Pairs(np.sum([each.won for each in turns], axis=0), np.sum([each.count for each in turns], axis=0))
    value = total.auc(np.ones(size))
    return Estimate(value, min(float(low), value), max(float(high), value))


def nearest_distance(real: Sequence[Floats], rendered: Sequence[Floats]) -> float:
    """Return the distance of rendered scenes to the nearest real place; 1 is as near as real places are to each other.

    Distances are between means of features, in standard deviations over real patches, root mean square over features.
    Of the scenes, and of the real places to their own nearest, the median is taken.
    """
    scale = np.concatenate(real).std(axis=0) + 1e-6
    places, scenes = (np.stack([each.mean(axis=0) for each in groups]) / scale for groups in (real, rendered))
    between = np.sqrt(np.square(scenes[:, np.newaxis] - places).mean(axis=-1))
    own = np.sqrt(np.square(places[:, np.newaxis] - places).mean(axis=-1))
    np.fill_diagonal(own, np.inf)
    return float(np.median(between.min(axis=1)) / np.median(own.min(axis=1)))
