"""Track splitting: hypotheses of one target's path, beside a GNN of the other objects about it.

Each hypothesis splits into one without a detection and one for each detection in its gate; the most probable few stay
(P. Smith, G. Buechler, "A branching algorithm for discriminating and tracking multiple objects", IEEE TAC 20(1),
1975). Log-likelihood ratios of "detection j is of the target" against "j is false, the target is missed":

    L = ln(v P_D) + ln N(z; z_i, S_i) + ln p1(q) / p0(q) - ln(clutter) - conflict,    missed: ln(1 - v P_D)

v is the probability that the target is visible, a two-state Markov chain (D. Musicki, R. Evans, S. Stankovic, IEEE
Trans. Automatic Control 39(6), 1994, Markov chain two). q is the detection's score. The conflict is the loss of the
other object that explains the detection, too, as in the joint assignment of both; objects that appeared after the
target was last seen cause no conflict, since they may be the target.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import log, pi, sqrt

import numpy as np
import numpy.typing as npt

from irsim.types import Floats
from irtrack.filters.data_association import nearest_neighbours
from irtrack.filters.multiple_model import MultipleModel, States, densities, update

HIDE, APPEAR = 0.03, 0.15
"""Probabilities per frame that a visible target becomes hidden, and that a hidden one reappears, on average after 10
frames."""
MARGIN = 9.0
"""Log of the odds against the best hypothesis at which another one is dropped."""
SAME_PX = 0.7
"""Distance below which two hypotheses of a frame are the same, px."""
CONTINUED = 0.6
"""Largest log-likelihood ratio of a detection that continues a hypothesis detected in the last frame: any object in the
place of the target would give one, too."""
SLACK, MOST_SLACK = 10, 20
"""Number of frames since the last `ESTABLISHED` successive hits after which scores may be twice as far below the
target's level, and the number at which this factor stops growing."""
ESTABLISHED = 4
"""Least age, frames, of another object that may explain detections."""
MOST_CONFLICT = 12.0
"""Largest conflict."""
FORGET = 6
"""Successive misses after which another object is dropped; an older object may miss half its age, up to 25 frames."""
MOST_OBJECTS = 24
"""Largest number of other objects."""


@dataclass(frozen=True, slots=True, eq=False)
class Scores:
    """Distributions of scores: for a target normal with `sd` below its level, for clutter exponential above `least`
    with `mean`."""

    sd: float
    least: float
    mean: float

    def ratios(self, level: Floats, scores: Floats, slack: Floats) -> Floats:
        """Return ln p1 - ln p0 (n, m) of scores (m,) about levels (n,); a score above the level is as good as it.

        slack (n,): factor of the deviation
        """
        short = self.shortfall(level, scores) / slack[:, None]
        above = (np.minimum(scores[None], level[:, None]) - self.least) / self.mean
        found: Floats = -0.5 * short**2 + above + log(self.mean / (self.sd * sqrt(2 * pi)))
        return found

    def shortfall(self, level: Floats, scores: Floats) -> Floats:
        """Return by how many deviations scores (m,) are below levels (n,), (n, m), at least 0."""
        return np.maximum(level[:, None] - scores[None], 0.0) / self.sd


@dataclass(frozen=True, slots=True, eq=False)
class Objects:
    """Other objects: states, levels (n,), ages and successive misses (n,), frames."""

    states: States
    level: Floats
    age: npt.NDArray[np.int64]
    misses: npt.NDArray[np.int64]

    def take(self, rows: np.ndarray) -> Objects:
        """Return the objects selected by a mask or by indices."""
        return Objects(self.states.take(rows), self.level[rows], self.age[rows], self.misses[rows])


@dataclass(frozen=True, slots=True, eq=False)
class Hypotheses:
    """Hypotheses of the target, the best first: states, log weights (n,) relative to the best, probability in sight
    (n,), successive misses and hits (n,), frames since it last had `ESTABLISHED` successive hits (n,), the detection of
    the last frame (n,) or -1; and the other objects."""

    states: States
    weight: Floats
    sight: Floats
    misses: npt.NDArray[np.int64]
    hits: npt.NDArray[np.int64]
    unsettled: npt.NDArray[np.int64]
    detection: npt.NDArray[np.int64]
    objects: Objects

    @classmethod
    def started(cls, bank: MultipleModel, center: tuple[float, float], sd: float, speed: float) -> Hypotheses:
        """Return one hypothesis at a centre, deviation `sd`, px; `speed`: deviation of its first speed, px/frame."""
        states = bank.started(np.array([center]), np.full((1, 2), sd * sd), speed)
        none, zero = np.zeros(0), np.zeros(0, np.int64)
        one = np.zeros(1, np.int64)
        return cls(
            *(states, np.zeros(1), np.ones(1), one, one + ESTABLISHED, one, one - 1),
            Objects(states.take(zero), none, zero, zero),
        )

    def predicted(self, bank: MultipleModel, moved: tuple[float, float]) -> Hypotheses:
        """Return the hypotheses a frame ahead, the scene displaced by `moved` (dx, dy) px."""
        both = bank.predict(self.states.joined(self.objects.states))
        both.mean[:, :, 0] += moved[0]
        both.mean[:, :, 1] += moved[1]
        count = len(self.weight)
        objects = replace(self.objects, states=both.take(np.arange(count, len(both))), age=self.objects.age + 1)
        sight = (1 - HIDE) * self.sight + APPEAR * (1 - self.sight)
        return replace(self, states=both.take(np.arange(count)), sight=sight, objects=objects)

    @property
    def probabilities(self) -> Floats:
        """Probability of each hypothesis, (n,)."""
        weights = np.exp(self.weight)
        found: Floats = weights / weights.sum()
        return found


@dataclass(frozen=True, slots=True)
class Splitting:
    """Rules of the association.

    noise      (2, 2) px^2, covariance of a detection's centre
    detection  P_D, of a visible target;  clutter  false detections per px^2
    gate       largest squared Mahalanobis distance
    most       largest number of hypotheses
    apart      distance of different objects, px
    speed      deviation of an object's first speed, px/frame
    """

    noise: Floats
    detection: float
    clutter: float
    gate: float
    most: int
    apart: float
    speed: float

    def advance(
        self,
        before: Hypotheses,
        bank: MultipleModel,
        centers: Floats,
        quality: Floats,
        noises: Floats,
        level: float,
        scores: Scores,
    ) -> Hypotheses:
        """Return the predicted hypotheses updated by the detections of a frame.

        centers (m, 2) px, quality (m,), noises (m, 2, 2) px^2 of detections if they are of the target;  level  the
        target's score
        """
        count = len(before.weight)
        everyone = before.states.joined(before.objects.states)
        distance, density = densities(everyone, self.noise, centers)
        levels = np.concatenate([np.full(count, level), before.objects.level])
        # A target that reappears may show another side.
        slack = 1 + np.minimum(before.unsettled, MOST_SLACK) / SLACK
        slacks = np.concatenate([slack, np.ones(len(everyone) - count)])
        ratios = density - log(self.clutter) + scores.ratios(levels, quality, slacks)
        ratios = np.where(distance <= self.gate, ratios, -np.inf)
        sight = before.sight * self.detection
        missed = np.log1p(-sight)
        other = ratios[count:] + log(self.detection / (1 - self.detection))
        conflict = self._conflict(before, other)
        evidence = ratios[:count] + np.log(sight)[:, None] - conflict
        follows = before.misses == 0  # detections of one object are correlated
        known = CONTINUED - 0.2 * (scores.shortfall(levels[:count], quality) / slack[:, None]) ** 2
        evidence = np.where(follows[:, None], np.minimum(evidence, known), evidence)
        split = before.weight[:, None] + evidence
        after = self._split(before, split, before.weight + missed, centers, noises)
        return replace(after, objects=self._objects(after, before.objects, bank, other, centers, quality))

    def _conflict(self, before: Hypotheses, other: Floats) -> Floats:
        """Return the conflict (n, m) of each hypothesis and detection."""
        objects = before.objects
        if not len(objects.age) or not other.shape[1]:
            return np.zeros((len(before.weight), other.shape[1]))
        gain = np.maximum(other, 0)
        if gain.shape[1] > 1:  # the object may have another detection instead
            first, second = np.partition(gain, -2, axis=1)[:, [-1, -2]].T
            gain = gain - np.where(gain == first[:, None], second[:, None], first[:, None])
        gain = np.clip(gain, 0, MOST_CONFLICT)
        established = objects.age >= ESTABLISHED
        senior = established[None] & (objects.age[None] > before.unsettled[:, None] + 1)
        found: Floats = (senior[:, :, None] * gain[None]).max(axis=1)
        return found

    def _split(self, before: Hypotheses, split: Floats, missed: Floats, centers: Floats, noises: Floats) -> Hypotheses:
        """Return the best hypotheses after splitting: `split` (n, m), `missed` (n,) log weights."""
        m = split.shape[1]
        table = np.concatenate([split, missed[:, None]], axis=1)
        order = np.argsort(-table, axis=None, kind="stable")
        order = order[table.ravel()[order] > table.max() - MARGIN][: 3 * self.most]
        parents, taken = order // (m + 1), order % (m + 1)
        hit = taken < m
        states = before.states.take(parents)
        if hit.any():
            found = update(states.take(hit), centers[taken[hit]], noises[taken[hit]])
            states = States(*(each.copy() for each in (states.mean, states.covariance, states.probability)))
            states.mean[hit], states.covariance[hit], states.probability[hit] = (
                *(found.mean, found.covariance),
                found.probability,
            )
        weight = table.ravel()[order]
        sight = before.sight[parents]
        sight = np.where(hit, 1.0, sight * (1 - self.detection) / (1 - sight * self.detection))
        misses = np.where(hit, 0, before.misses[parents] + 1)
        hits = np.where(hit, before.hits[parents] + 1, 0)
        unsettled = np.where(hits >= ESTABLISHED, 0, before.unsettled[parents] + 1)
        kept = self._distinct(states, weight)
        return Hypotheses(
            states.take(kept),
            weight[kept] - weight[kept[0]],
            sight[kept],
            misses[kept],
            hits[kept],
            unsettled[kept],
            np.where(hit, taken, -1)[kept],
            before.objects,
        )

    def _distinct(self, states: States, weight: Floats) -> npt.NDArray[np.int64]:
        """Return the rows of the best hypotheses that are at different places with different velocities."""
        mean = states.moments()[0]
        kept = [0]
        for row in range(1, len(weight)):
            if len(kept) == self.most:
                break
            if (np.abs(mean[kept, :4] - mean[row, :4]).max(axis=1) > SAME_PX).all():
                kept.append(row)
        return np.array(kept)

    def _objects(
        self, after: Hypotheses, objects: Objects, bank: MultipleModel, other: Floats, centers: Floats, quality: Floats
    ) -> Objects:
        """Return the other objects after an update by the detections not assigned to the target, and new ones from the
        rest."""
        m = len(centers)
        free = np.ones(m, bool)
        if after.detection[0] >= 0:
            free[after.detection[0]] = False
        states, level, misses = objects.states, objects.level.copy(), objects.misses + 1
        if len(level) and m:
            pairs = nearest_neighbours(np.where(free, other, -np.inf))
            rows, columns = pairs[:, 0], pairs[:, 1]
            if len(rows):
                found = update(states.take(rows), centers[columns], self.noise)
                states = States(*(each.copy() for each in (states.mean, states.covariance, states.probability)))
                states.mean[rows], states.covariance[rows] = found.mean, found.covariance
                states.probability[rows] = found.probability
                level[rows] += 0.2 * (quality[columns] - level[rows])
                misses[rows] = 0
                free[columns] = False
        allowed = np.minimum(FORGET + objects.age // 4, 25)
        allowed = np.where(objects.age < ESTABLISHED, 1, allowed)
        kept = misses <= allowed
        own = after.detection[after.detection >= 0]
        free[own] = False
        fresh = np.flatnonzero(free)
        if len(fresh):  # no new object where there is one, or where the target is seen
            seen = after.states.take(np.flatnonzero(after.misses[:1] == 0))
            present = states.take(kept).joined(seen).moments()[0][:, :2]
            apart = ((centers[fresh, None] - present[None]) ** 2).sum(axis=-1)
            fresh = fresh[(apart > self.apart**2).all(axis=1)]
        new = bank.started(centers[fresh], np.broadcast_to(np.diag(self.noise), (len(fresh), 2)), self.speed)
        zero = np.zeros(len(fresh), np.int64)
        whole = Objects(
            states.take(kept).joined(new),
            np.concatenate([level[kept], quality[fresh]]),
            np.concatenate([objects.age[kept], zero]),
            np.concatenate([misses[kept], zero]),
        )
        if len(whole.age) > MOST_OBJECTS:
            whole = whole.take(np.sort(np.argsort(-(whole.age - 10 * whole.misses), kind="stable")[:MOST_OBJECTS]))
        return whole
