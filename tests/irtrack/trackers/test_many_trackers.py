"""Trackers of many targets: contract of every kind, confirmation, deletion, and the decision that `mht` defers."""

from __future__ import annotations

import pickle
from typing import Any, cast

import numpy as np
import pytest
from plots_of_targets import SIZE, detections, noisy, track_at, tracked

import irsim
from irsim.rng import stream
from irtrack.errors import InputError
from irtrack.metrics import Comparison, ManyFigures
from irtrack.registry.table import MULTI_TRACKERS, make
from irtrack.replay.many import run_many
from irtrack.trackers.gnn import GNN
from irtrack.trackers.mht import MHT
from irtrack.trackers.multi_target import MultiTargetTracker
from irtrack.types import Detections
from irtrack.validity import fault_of_tracks

KINDS = [f"{name}-{motion}" for name in MULTI_TRACKERS for motion in ("cv", "imm")]
STRAIGHT = np.stack([[(20 + 2 * k, 40.0 + 30 * i) for i in range(5)] for k in range(40)])
"""Five targets side by side, (40, 5, 2) px."""


def tracker(kind: str) -> MultiTargetTracker:
    name, motion = kind.split("-")
    return cast(MultiTargetTracker, make(name, {"motion": motion}))


@pytest.mark.parametrize("kind", KINDS)
def test_targets_are_found_and_kept(kind: str) -> None:
    frames = tracked(tracker(kind), noisy(STRAIGHT, 1))
    ids = [[track_at(frame, place) for place in places] for frame, places in zip(frames, STRAIGHT[1:], strict=True)]
    assert None not in ids[-1]
    assert sum(a != b for a, b in zip(ids[15], ids[-1], strict=True)) <= 1
    assert all(fault_of_tracks(frame) is None for frame in frames)
    assert int(frames[-1].confirmed.sum()) <= 6


@pytest.mark.parametrize("kind", KINDS)
def test_false_detections_alone_confirm_little(kind: str) -> None:
    """Of 1500 false detections in 150 frames, 4 of 6 hits or the score of `mht` confirm at most five false tracks."""
    made = tracker(kind).model_copy(update={"clutter": 1.3e-4, "confirm_hits": 4, "confirm_frames": 6})
    frames = tracked(made, noisy(np.zeros((150, 0, 2)), 2, false=10))
    confirmed = {id for frame in frames for id in frame.ids[frame.confirmed].tolist()}
    assert len(confirmed) <= 5


@pytest.mark.parametrize("kind", KINDS)
def test_tracks_coast_and_are_deleted(kind: str) -> None:
    made = tracker(kind)
    plots = [detections([(20 + 2 * k, 100)]) for k in range(12)] + [detections(np.zeros((0, 2)))] * 40
    frames = tracked(made, plots)
    assert track_at(frames[10], (42, 100)) is not None
    assert frames[14].statuses[0] == "occluded"
    assert track_at(frames[14], (50, 100), 8) is not None
    assert len(frames[-1]) == 0


def test_track_survives_a_long_merger() -> None:
    """Two targets pass within 4 px of each other, where they give one detection, for 30 frames."""
    paths = np.stack([[(20 + 2 * k, 100.0), (20 + 2 * k, 92 + 0.27 * k)] for k in range(70)])
    plots = [
        detections(places if abs(places[1, 1] - places[0, 1]) > 4 else places.mean(axis=0, keepdims=True))
        for places in paths
    ]
    assert sum(len(each) == 1 for each in plots) >= 28
    frames = tracked(GNN(), plots)
    assert {track_at(frames[5], place, 3) for place in paths[6]} == {
        track_at(frames[-1], place, 3) for place in paths[-1]
    }


@pytest.mark.parametrize("kind", KINDS)
def test_states_are_values(kind: str) -> None:
    made, plots = tracker(kind), noisy(STRAIGHT[:10], 3)
    state = made.begin(plots[0], SIZE)
    for each in plots[1:6]:
        state = made.advance(state, each)
    copied = pickle.loads(pickle.dumps(state))
    first, again, resumed = made.advance(state, plots[6]), made.advance(state, plots[6]), made.advance(copied, plots[6])
    for other in (again, resumed):
        np.testing.assert_array_equal(first.tracks.frame().centers, other.tracks.frame().centers)
        np.testing.assert_array_equal(first.tracks.frame().ids, other.tracks.frame().ids)


@pytest.mark.parametrize("kind", KINDS)
def test_order_of_detections_does_not_matter(kind: str) -> None:
    plots = noisy(STRAIGHT[:20], 4)
    turned = [each.take(np.arange(len(each))[::-1]) for each in plots]
    one, other = (tracked(tracker(kind), each)[-1] for each in (plots, turned))
    places = [frame.centers[frame.confirmed] for frame in (one, other)]
    first, second = (each[np.lexsort(each.T)] for each in places)
    np.testing.assert_allclose(first, second, atol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_many_detections_and_none(kind: str) -> None:
    rng = np.random.default_rng(5)
    crowd = detections(rng.uniform((0, 0), SIZE, (10_000, 2)), rng.exponential(5, 10_000) + 1)
    made = tracker(kind).model_copy(update={"clutter": 1e-2})
    frames = tracked(made, [made.strongest(each) for each in (crowd, detections(np.zeros((0, 2))), crowd)])
    assert all(fault_of_tracks(frame) is None for frame in frames)


def crossing(noise_seed: int) -> list[list[tuple[float, float]]]:
    """Return detections of a target along y = 100 that a short-lived one crosses while the target is missed once.

    In frame 24 the target has no detection, and the other one is where it may be; from then on the other leads away
    until it vanishes in frame 28. To follow it is the most likely choice in frame 24, and wrong, as frame 28 shows.
    """
    rng = np.random.default_rng(noise_seed)
    frames = []
    for k in range(50):
        places = [(60 + 2.0 * k, 100.0)] if k != 24 else []
        if 24 <= k < 28:
            places.append((60 + 2.0 * k, 102.5 + 2.5 * (k - 24)))
        frames.append([(x + rng.normal(0, 0.2), y + rng.normal(0, 0.2)) for x, y in places])
    return frames


def test_only_deferred_decisions_are_right_at_this_crossing() -> None:
    """The trees of `mht` keep both readings until the other vanishes; `gnn`, and `mht` of one scan, lose identity."""
    keys: dict[str, Any] = {"amplitude": False, "measurement_sd": 0.6, "acceleration": 0.5, "merge_px": 0}
    trackers = {"mht": MHT(scans=6, **keys), "mht of one scan": MHT(scans=1, **keys), "gnn": GNN(**keys)}
    kept = dict.fromkeys(trackers, 0)
    for seed in range(10):
        plots = [detections(each) for each in crossing(seed)]
        for name, made in trackers.items():
            frames = tracked(made, plots)
            before, after = (track_at(frames[k - 1], (60 + 2 * k, 100.0), 3.0) for k in (20, 48))
            kept[name] += before == after is not None
    assert kept["mht"] >= 9
    assert max(kept["gnn"], kept["mht of one scan"]) <= 3


def test_scans_prune_the_tree() -> None:
    plots = noisy(STRAIGHT, 6, false=6)
    leaves = []
    for scans in (1, 6):
        made = MHT(scans=scans)
        state = made.begin(plots[0], SIZE)
        for each in plots[1:]:
            state = made.advance(state, each)
        leaves.append(len(state.leaves.score))
        history = state.leaves.history[:, 0]
        best = dict(zip(state.tracks.id.tolist(), history[state.hypotheses[0].rows].tolist(), strict=True))
        assert all(
            best.get(tree, one) == one for tree, one in zip(state.leaves.tracks.id.tolist(), history, strict=True)
        )
        assert len(state.hypotheses) <= made.hypotheses
    assert leaves[0] < leaves[1]


def test_seven_drones_without_a_box() -> None:
    source = irsim.open_source("swarm", ["frames=40"])
    found = run_many("gnn", source, input="counts")
    figures = ManyFigures(Comparison.of(source.truths(), found), source.rate_hz)
    assert figures.found == 1
    assert figures.recall > 0.8
    assert figures.false_tracks <= 2
    again = run_many("gnn", source, input="counts")
    np.testing.assert_array_equal(found.cx, again.cx)


def test_wrong_use_is_one_line() -> None:
    with pytest.raises(InputError, match="follows one target"):
        run_many("kalman", "sky")
    with pytest.raises(InputError, match=r"unknown detector 'tophatt'.*did you mean 'tophat'"):
        run_many("gnn", "sky", parameters={"detector": "tophatt"})


class Nearest:
    """A person's tracker of many: ids by the order of scores."""

    def step(self, detections: Detections) -> list[tuple[int, tuple[float, float, float, float], float]]:
        return [(k, (each.box.cx, each.box.cy, 5.0, 5.0), each.score) for k, each in enumerate(detections)][:3]


class Twice(Nearest):
    def step(self, detections: Detections) -> list[tuple[int, tuple[float, float, float, float], float]]:
        return [(1, (5.0, 5.0, 5.0, 5.0), 1.0)] * 2


def test_own_tracker_of_detections() -> None:
    found = run_many(Nearest, "sky", frames=4)
    assert set(found.id.tolist()) <= {0, 1, 2}
    assert found.confirmed.all()
    with pytest.raises(irsim.IrsimError, match="two tracks have the id 1"):
        run_many(Twice, "sky", frames=4)


def test_steps_take_frames_and_generators() -> None:
    made, source = GNN(), irsim.open_source("sky", ["frames=3"])
    frames = list(source.frames())
    state = made.init(frames[0], stream(0, "gnn", "many", 0))
    state, tracks = made.step(state, frames[1], stream(0, "gnn", "many", 1))
    assert fault_of_tracks(tracks) is None
