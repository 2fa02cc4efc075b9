"""Properties of trackers of many targets: each target has one track, whatever the order and number of detections."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from irsim.rng import stream
from irsim.types import Box, Floats
from irtrack.properties.case import APART, POINTS_FRAMES, POINTS_SIZE, Broken, Case, Clip, NotAsked, walk
from irtrack.tracks import TrackFrame
from irtrack.types import Detections

ON_PX = 5.0
"""Largest distance of a track that is on a target, px."""
SETTLED = 12
"""Frames after which a visible target has a confirmed track."""
MOST_MISSED = 0.1
"""Largest share of a target's frames without a track."""
JUMP_PX = 15.0
"""Largest step of one track from frame to frame, px: the points are 31 px apart and move 1.2 px a frame."""
ROUNDING_PX = 1e-3
"""Rounding of sums in another order, px."""
CROWD = 10_000
GAP = 200
"""Frames without detections."""


def follows(case: Case) -> None:
    """Each of three points that fly side by side has one confirmed track, with one number."""
    clip = case.points()
    _expect_followed(_tracks(case, clip), clip.centers[1:], SETTLED)


def ids(case: Case) -> None:
    """The number of a track is a whole number of one type, and never passes to a target elsewhere."""
    clip = case.points(p0=[[14, POINTS_FRAMES - 1]], p2=[[0, 8]])
    tracks = _tracks(case, clip)
    kinds = {str(np.asarray(each.ids).dtype) for each in tracks if len(each)}
    if len(kinds) > 1:
        raise Broken(f"the numbers of tracks are {' and '.join(sorted(kinds))}; allowed: one type")
    last: dict[int, Floats] = {}
    for k, each in enumerate(tracks, 1):
        for id, place in zip(each.ids[each.confirmed].tolist(), each.centers[each.confirmed], strict=True):
            if id in last and np.hypot(*(place - last[id])) > JUMP_PX:
                step = np.hypot(*(place - last[id]))
                raise Broken(f"frame {k}: track {id} is {step:.0f} px from its last place; allowed: {JUMP_PX:g}")
            last[id] = place


def order(case: Case) -> None:
    """The order of detections has no effect on the places of tracks."""
    one, other = _shuffled(case)
    for k, (first, second) in enumerate(zip(one, other, strict=True), 1):
        pairs, apart = _pairs(first, second)
        if len(first.ids[first.confirmed]) != len(second.ids[second.confirmed]) or (apart > ROUNDING_PX).any():
            counts = f"{int(first.confirmed.sum())} and {int(second.confirmed.sum())} confirmed tracks"
            worst = f", off by {apart.max():.2g} px" if len(pairs) else ""
            raise Broken(f"shuffled: frame {k} has {counts}{worst}")


def relabel(case: Case) -> None:
    """The order of detections changes at most the numbers of tracks, and each for the whole of its track."""
    names: tuple[dict[int, int], dict[int, int]] = {}, {}
    for k, (first, second) in enumerate(zip(*_shuffled(case), strict=True), 1):
        for pair in _pairs(first, second)[0]:
            for known, (id, name) in zip(names, (pair, pair[::-1]), strict=True):
                if known.setdefault(id, name) != name:
                    raise Broken(f"shuffled: frame {k}: a track has the number {name}, before it had {known[id]}")


def duplicates(case: Case) -> None:
    """Detections that come twice make no second confirmed track."""
    plots, paths = _plots(case)
    tracks = _on(case, [each.take(np.repeat(np.arange(len(each)), 2)) for each in plots])
    for k, (each, places) in enumerate(zip(tracks, paths[1:], strict=True), 1):
        for place in places:
            near = int((np.hypot(*(each.centers[each.confirmed] - place).T) <= ON_PX).sum())
            if near > 1:
                raise Broken(f"each detection twice: {near} confirmed tracks on one target in frame {k}")
    _expect_followed(tracks, paths[1:], SETTLED)


def empty(case: Case) -> None:
    """After 200 frames without a detection no track is left, and targets that come back are followed again."""
    plots, paths = _plots(case)
    nothing = plots[0].take(np.zeros(0, np.int64))
    tracks = _on(case, [*plots, *[nothing] * GAP, *plots])
    left = tracks[len(plots) + GAP - 2]
    if left.confirmed.any():
        raise Broken(f"{int(left.confirmed.sum())} confirmed tracks after {GAP} frames without a detection")
    _expect_followed(tracks[-len(plots) :], paths, SETTLED)


def crowd(case: Case) -> None:
    """After ten thousand detections in one frame, the targets are still followed."""
    plots, paths = _plots(case)
    at = len(plots) // 2
    rng = stream(case.drawn["seed"], "crowd")
    places = rng.uniform((0, 0), POINTS_SIZE, (CROWD - len(plots[at]), 2))
    plots[at] = _joined(plots[at], places, 3.0 + rng.exponential(0.5, len(places)))
    _expect_followed(_on(case, plots)[-SETTLED:], paths[-SETTLED:], 0)


def _tracks(case: Case, clip: Clip) -> list[TrackFrame]:
    return list(walk(case.tracker, clip).estimates)


def _plots(case: Case) -> tuple[list[Detections], Floats]:
    """Draw the detections of three targets that fly side by side, with noise and clutter, and their paths (n, 3, 2)."""
    rng = stream(case.draw("seed", st.integers(0, case.seeds - 1)), "plots")
    angle = 2 * np.pi * rng.random()
    steps = np.arange(2 * SETTLED)[:, None, None] * 0.8 * np.array([np.cos(angle), np.sin(angle)])
    paths = np.array(APART) + steps
    plots = []
    for places in paths:
        hits = _joined(None, places + rng.normal(0, 0.5, places.shape), 20 * np.exp(rng.normal(0, 0.1, len(places))))
        clutter = rng.uniform((0, 0), POINTS_SIZE, (rng.poisson(1), 2))
        plots.append(_joined(hits, clutter, 5 + rng.exponential(1, len(clutter))))
    return plots, paths


def _joined(found: Detections | None, places: Floats, scores: Floats) -> Detections:
    more = Detections(places, np.full(places.shape, 5.0), scores)
    if found is None:
        return more
    return Detections(
        np.concatenate([found.centers, more.centers]),
        np.concatenate([found.sizes, more.sizes]),
        np.concatenate([found.scores, more.scores]),
    )


def _on(case: Case, plots: list[Detections]) -> list[TrackFrame]:
    """Return the tracks on given detections; NotAsked where the tracker takes none."""
    fed = case.tracker.on(plots)  # type: ignore[attr-defined]  # a `ManySubject`
    if fed is None:
        raise NotAsked("it takes no detections of a detector")
    count = len(plots)
    blank = np.broadcast_to(np.zeros(1, np.uint8), (count, POINTS_SIZE[1], POINTS_SIZE[0]))
    clip = Clip(blank, np.arange(count) / 30, np.zeros((count, 2)), np.zeros(count), Box(0, 0, 5, 5), "")
    return list(walk(fed, clip).estimates)


def _shuffled(case: Case) -> tuple[list[TrackFrame], list[TrackFrame]]:
    """Return the tracks on detections, and on the same in another order."""
    plots, _ = _plots(case)
    rng = stream(case.drawn["seed"], "order")
    return _on(case, plots), _on(case, [each.take(rng.permutation(len(each))) for each in plots])


def _pairs(first: TrackFrame, second: TrackFrame) -> tuple[list[tuple[int, int]], Floats]:
    """Return the numbers of the confirmed tracks of one frame, each with that of the nearest in another run, and the
    distances, px."""
    a, b = (each.centers[each.confirmed] for each in (first, second))
    if not len(a) or not len(b):
        return [], np.zeros(0)
    apart = np.hypot(*(a[:, None] - b).transpose(2, 0, 1))
    nearest = apart.argmin(axis=1)
    numbers = second.ids[second.confirmed][nearest].tolist()
    return list(zip(first.ids[first.confirmed].tolist(), numbers, strict=True)), apart.min(axis=1)


def _expect_followed(tracks: list[TrackFrame], paths: Floats, after: int) -> None:
    """Raise Broken where a target lacks a confirmed track in over a tenth of the frames, or its track id changes."""
    for target in range(paths.shape[1]):
        seen: list[int | None] = []
        for each, places in zip(tracks[after:], paths[after:], strict=True):
            apart = np.hypot(*(each.centers[each.confirmed] - places[target]).T)
            near = len(apart) > 0 and apart.min() <= ON_PX
            seen.append(int(each.ids[each.confirmed][apart.argmin()]) if near else None)
        missed, numbers = seen.count(None) / len(seen), set(seen) - {None}
        if missed > MOST_MISSED:
            raise Broken(f"no track on a target in {missed:.0%} of its frames; allowed: {MOST_MISSED:.0%}")
        if len(numbers) > 1:
            raise Broken(f"a target has {len(numbers)} tracks one after the other; allowed: 1")
