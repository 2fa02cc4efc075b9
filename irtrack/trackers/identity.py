"""`identity`: `gnn` with class and identity of each track, which vetoes swaps at crossings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from irsim.types import Box, Floats, Frame, Image
from irtrack.detectors import detected
from irtrack.features.gallery import Gallery, appearance_vector
from irtrack.features.recognition import recognition_vector
from irtrack.models import model_path
from irtrack.models.classes import ClassModel, Method
from irtrack.trackers.base import Ratio
from irtrack.trackers.ego_motion import ego_view, scene_motion
from irtrack.trackers.gnn import GNN
from irtrack.trackers.multi_target import ManyState, TrackTable
from irtrack.tracks import TrackFrame

CLASS_RATE = 0.1
"""Share of a new frame in the running mean of a track's class probabilities."""
KNOWN = 5
"""Number of whole-view frames from which on an identity's gallery counts."""
FORGET = 60
"""Frames after the last contact for which an identity without a track is kept."""
NEAR_SD = 3.0
"""Standard deviations within which a new track may be a lost identity's."""
ALONE = 1.5
"""Distance from any other track from which on an appearance is that of the target alone, in `near_px`."""


@dataclass(frozen=True, slots=True, eq=False)
class Encounter:
    """First and last frame in which others were near; place (2,) px and velocity (2,) px/frame in the first."""

    begun: int
    last: int
    place: Floats
    velocity: Floats

    def moved(self, homography: Floats) -> Encounter:
        """Return the encounter after the camera moved the whole scene by a homography (3, 3) of pixels."""
        ends = np.stack([self.place, self.place + self.velocity])
        x, y, w = homography @ np.vstack([ends.T, np.ones(2)])
        place, ahead = np.stack([x / w, y / w], axis=1)
        return replace(self, place=place, velocity=ahead - place)


@dataclass(frozen=True, slots=True, eq=False)
class Identity:
    """One identity: number of the track that has it now, gallery, class probabilities (K,) or None.

    met       encounter, None outside encounters
    partners  identities met
    fresh     gallery of the frames in whole view since the encounter
    seen      last frame with a detection
    """

    track: int
    gallery: Gallery
    classes: Floats | None = None
    met: Encounter | None = None
    partners: frozenset[int] = frozenset()
    fresh: Gallery = field(default_factory=Gallery.empty)
    seen: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class IdentityState:
    """State: tracks, identities by their numbers, number of the next one, frame."""

    tracks: ManyState
    identities: Mapping[int, Identity]
    next_id: int
    frame: int


class IdentityTracker(GNN):
    """`gnn` whose tracks have a class and an identity of their own, decided anew after each crossing.

    The recognition chain of the digest: smoothing, grey transform and equalisation; geometry, texture and frequencies;
    a support vector machine, a small network or nearest neighbours (`irtrack.features.recognition`,
    `irtrack.models.classes`). The gallery of an identity is the running mean and covariance of its appearance over
    frames in whole view (`irtrack.features.gallery`).

    Tracks that come within `near_px` meet. Where one of them ends, a new track near the straight continuation of its
    path has its identity for the time being. When all tracks of an encounter are apart again and have been seen in
    `settle` frames, identities are assigned to tracks by least cost: Mahalanobis distance of appearance between the
    galleries before and after, plus that of the position from the continuation, whose variance is place_sd^2 +
    (drift_sd t)^2. Identities are exchanged only where this lowers the cost by `margin`, and only where no appearance
    differs by more than `reject`. Chosen here: all of these numbers; the source names the parts only.
    """

    source: ClassVar[str] = "recognition (digest); Blackman, Popoli 1999"

    model: str | None = Field(default=None, max_length=4096)
    """File of `irtrack train identity`; by default the shipped model."""
    classifier: Method = "svm"
    """Classifier of the classes."""
    veto: bool = True
    """True: identities are decided by appearance after a crossing; False: they stay with the tracks of `gnn`."""
    near_px: Annotated[float, Field(ge=1, le=1000)] = 8.0
    """Distance of two tracks within which they meet, and their appearance is not learned, px."""
    settle: int = Field(default=6, ge=1, le=1000)
    """Number of frames in whole view after an encounter before identities are assigned."""
    place_sd: Ratio = 3.0
    """Standard deviation of the straight continuation of a path at the begin of an encounter, px."""
    drift_sd: Ratio = 0.25
    """Its growth with each frame since, px."""
    margin: Annotated[float, Field(ge=0, le=1e6)] = 10.0
    """Least gain of an exchange, squared Mahalanobis distance: odds of e^5."""
    reject: Ratio = 30.0
    """Largest squared Mahalanobis distance of an appearance that may be the identity's."""

    @property
    def weights(self) -> tuple[str, ...]:
        """Files whose content decides the tracks, for the key of a run."""
        return (str(model_path("identity", self.model)),)

    @cached_property
    def recogniser(self) -> ClassModel:
        """Classifiers of the model file; InputError, one line, where the file is none."""
        return ClassModel.read(model_path("identity", self.model))

    def init(self, frame: Frame, rng: np.random.Generator) -> IdentityState:
        """Return the state after the first frame, each of whose detections starts a track."""
        _ = self.recogniser
        return IdentityState(super().init(frame, rng), {}, 0, 0)

    def step(self, state: Any, frame: Frame, rng: np.random.Generator) -> tuple[IdentityState, TrackFrame]:
        """Return the state and the tracks, with identities and classes, after the next frame."""
        state = self._moved(state, frame)
        inner = state.tracks
        memory, found = detected(self.detector_used, inner.memory, frame)
        inner = replace(self.advance(inner, self.strongest(found)), memory=memory)
        after = self._named(replace(state, tracks=inner, frame=state.frame + 1), frame.image)
        if self.veto:
            after = self._decided(after)
        names = {each.track: number for number, each in after.identities.items()}
        given = inner.tracks.frame(self.survival)
        ids = np.array([names[track] for track in given.ids.tolist()], dtype=np.int64)
        classes = tuple(self._class(after.identities[number]) for number in ids.tolist())
        return after, replace(given, ids=ids, classes=classes)

    def _moved(self, state: IdentityState, frame: Frame) -> IdentityState:
        """Return the state with tracks and encounters where the camera's motion since the last frame has moved them."""
        view = ego_view(self.ego_motion, frame)
        before = state.tracks.view
        if view is None or before is None:
            return state
        motion = scene_motion(before, view, state.tracks.size)
        identities = {
            number: each if each.met is None else replace(each, met=each.met.moved(motion))
            for number, each in state.identities.items()
        }
        return replace(state, tracks=replace(state.tracks.moved(motion), view=view), identities=identities)

    def _class(self, identity: Identity) -> str | None:
        """Return the most probable class; None while there is no frame in whole view."""
        return None if identity.classes is None else self.recogniser.classes[int(identity.classes.argmax())]

    def _named(self, state: IdentityState, image: Image) -> IdentityState:
        """Return the state with an identity for each track, encounters marked, and appearances learned."""
        tracks = state.tracks.tracks
        mean, _ = tracks.states.moments()
        identities = dict(state.identities)
        names = {each.track: number for number, each in identities.items()}
        next_id = state.next_id
        for track in tracks.id.tolist():
            if track not in names:
                names[track], next_id = next_id, next_id + 1
                identities[names[track]] = Identity(track, Gallery.empty(), seen=state.frame)
        rows_of = {track: row for row, track in enumerate(tracks.id.tolist())}
        rows = {names[track]: row for track, row in rows_of.items()}
        apart = np.hypot(*(mean[:, None, :2] - mean[None, :, :2]).transpose(2, 0, 1))
        np.fill_diagonal(apart, np.inf)
        sure = np.where(tracks.confirmed[None], apart, np.inf)
        for number, row in rows.items():
            identity = identities[number]
            close = [names[int(tracks.id[k])] for k in np.flatnonzero(sure[row] < self.near_px).tolist()]
            if close and tracks.confirmed[row]:
                first = Encounter(state.frame, state.frame, mean[row, :2], mean[row, 2:4])
                met = first if identity.met is None else replace(identity.met, last=state.frame)
                partners = identity.partners | frozenset(close)
                identity = replace(identity, met=met, partners=partners, fresh=Gallery.empty())
            elif tracks.misses[row] == 0 and tracks.confirmed[row] and apart[row].min() >= ALONE * self.near_px:
                identity = self._learned(identity, image, tracks, row)
            seen = state.frame if tracks.misses[row] == 0 else identity.seen
            identities[number] = replace(identity, seen=seen)
        for number, row in rows.items():
            if tracks.confirmed[row] and identities[number].gallery.count < KNOWN:
                returned = self._returned(identities, rows, mean[row, :2], state.frame)
                if self.veto and returned is not None:
                    own = identities.pop(number)
                    identities[returned] = replace(identities[returned], track=own.track, fresh=Gallery.empty())
        alive = {
            number: each
            for number, each in identities.items()
            if each.track in rows_of or (self.veto and each.met is not None)
        }
        return replace(state, identities=alive, next_id=next_id)

    def _returned(
        self, identities: Mapping[int, Identity], rows: Mapping[int, int], place: Floats, frame: int
    ) -> int | None:
        """Return the identity lost in an encounter that may have come back at a place (2,) px; None without one.

        It is the nearest to the continuation of its path, within three standard deviations.
        """
        off = {}
        for number, each in identities.items():
            if number not in rows and each.met is not None and each.gallery.count >= KNOWN:
                ahead, sd = self._ahead(each.met, frame)
                off[number] = float(np.hypot(*(place - ahead))) / sd
        best = min(off, key=lambda number: off[number], default=None)
        return best if best is not None and off[best] <= NEAR_SD else None

    def _ahead(self, met: Encounter, frame: int) -> tuple[Floats, float]:
        """Return the straight continuation (2,) px of the path before an encounter, and its standard deviation, px."""
        since = frame - met.begun
        return met.place + since * met.velocity, float(np.hypot(self.place_sd, self.drift_sd * since))

    def _learned(self, identity: Identity, image: Image, tracks: TrackTable, row: int) -> Identity:
        """Return the identity with the appearance of its track in this frame."""
        x, y = tracks.states.moments()[0][row, :2].tolist()
        box = Box(x, y, *tracks.size[row].tolist()).at_least(5.0)
        vector = appearance_vector(image, (x, y))
        if vector is None:
            return identity
        p = self.recogniser.probabilities(recognition_vector(image, box)[None], self.classifier)[0]
        classes = p if identity.classes is None else identity.classes + CLASS_RATE * (p - identity.classes)
        if identity.met is None:
            return replace(identity, gallery=identity.gallery.learned(vector), classes=classes)
        return replace(identity, fresh=identity.fresh.learned(vector), classes=classes)

    def _decided(self, state: IdentityState) -> IdentityState:
        """Return the state with identities assigned to tracks in encounters that are over."""
        identities = dict(state.identities)
        tracks = state.tracks.tracks
        rows = {track: row for row, track in enumerate(tracks.id.tolist())}
        mean, _ = tracks.states.moments()
        for group in _groups(identities):
            known = [number for number in group if identities[number].gallery.count >= KNOWN]
            holders = [number for number in group if identities[number].track in rows]
            missing = [number for number in known if number not in holders]
            if any(identities[number].fresh.count < self.settle for number in holders):
                continue
            last = max(each.last for each in (identities[n].met for n in group) if each is not None)
            if missing and state.frame - last <= FORGET:
                continue  # a lost target may come back
            shown = {number: identities[number].fresh for number in holders}
            places = {number: mean[rows[identities[number].track], :2] for number in shown}
            pairs = self._assigned({n: identities[n] for n in known}, shown, places, state.frame)
            before = {number: identities[number] for number in shown}
            for number in {*group, *pairs.values()}:
                left = identities.pop(number)
                if number in before and number not in pairs.values():
                    identities[number] = _parted(left)
                elif number in before and number in known and number not in pairs:
                    del before[number]  # its track is another's now, and it has none
            for number, holder in pairs.items():
                kept, other = state.identities[number], state.identities[holder]
                classes = other.classes if kept.classes is None else kept.classes
                identities[number] = replace(_parted(kept), track=other.track, classes=classes, seen=state.frame)
        return replace(state, identities=identities)

    def _assigned(
        self, known: Mapping[int, Identity], shown: Mapping[int, Gallery], places: Mapping[int, Floats], frame: int
    ) -> dict[int, int]:
        """Return for each identity the number of the one whose track it gets, by least cost; some may get none."""
        from scipy.optimize import linear_sum_assignment  # 0.4 s to import

        numbers, holders = list(known), list(shown)
        if not numbers or not holders:
            return {}
        cost = np.zeros((len(numbers), len(holders)))
        likeness = np.zeros_like(cost)
        for i, each in enumerate(known.values()):
            assert each.met is not None
            ahead, sd = self._ahead(each.met, frame)
            for j, number in enumerate(holders):
                likeness[i, j] = each.gallery.distance(shown[number])
                cost[i, j] = float(((places[number] - ahead) ** 2).sum()) / sd**2 + likeness[i, j]
        keep = {i: holders.index(number) for i, number in enumerate(numbers) if number in shown}
        best = dict(zip(*(side.tolist() for side in linear_sum_assignment(cost)), strict=True))
        gain = sum(cost[i, j] for i, j in keep.items()) - sum(cost[i, j] for i, j in best.items())
        accepted = all(likeness[i, j] <= self.reject for i, j in best.items() if keep.get(i) != j)
        chosen = best if accepted and (len(keep) < len(best) or gain >= self.margin) else keep
        return {numbers[i]: holders[j] for i, j in chosen.items()}


def _parted(identity: Identity) -> Identity:
    """Return the identity after its encounter."""
    return replace(identity, met=None, partners=frozenset(), fresh=Gallery.empty())


def _groups(identities: Mapping[int, Identity]) -> list[list[int]]:
    """Return the numbers of identities in encounters, those that met each other, directly or not, together."""
    left = {number for number, each in identities.items() if each.met is not None}
    found = []
    while left:
        group, queue = set(), [min(left)]
        while queue:
            number = queue.pop()
            if number in left:
                left.remove(number)
                group.add(number)
                queue += [n for n in left if n in identities[number].partners or number in identities[n].partners]
        found.append(sorted(group))
    return found
