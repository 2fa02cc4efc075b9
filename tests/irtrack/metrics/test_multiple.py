"""Figures of many targets against trackeval, and by hand: ignored targets, starts, false tracks, GOSPA."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from oracle_cases import sequence
from oracles import values_of

from irsim.types import Box, TargetTruth, Truth
from irtrack.metrics.comparison import Comparison, Matching, Pairs, Presence
from irtrack.metrics.multiple import MANY_FIGURES, ManyFigures
from irtrack.tracks import TrackFrame, TrackSet, stacked


def rows(found: list[tuple[int, int]]) -> Presence:
    table = np.array(found, dtype=np.int64).reshape(-1, 2)
    return Presence(table[:, 0], table[:, 1], np.zeros((len(table), 4)))


def comparison_of(frames: list[tuple[np.ndarray, np.ndarray, np.ndarray]]) -> Comparison:
    """Return the comparison of frames with given similarities."""
    pairs = [
        (k, target, track, similarity[i, j])
        for k, (targets, tracks, similarity) in enumerate(frames)
        for i, target in enumerate(targets.tolist())
        for j, track in enumerate(tracks.tolist())
        if similarity[i, j] > 0
    ]
    table = np.array(pairs, dtype=np.float64).reshape(-1, 4)
    numbers = table[:, :3].astype(np.int64)
    return Comparison(
        len(frames),
        rows([(k, t) for k, (targets, _, _) in enumerate(frames) for t in targets.tolist()]),
        rows([(k, t) for k, (_, tracks, _) in enumerate(frames) for t in tracks.tolist()]),
        Pairs(numbers[:, 0], numbers[:, 1], numbers[:, 2], table[:, 3], 1 - table[:, 3]),
        tuple(map(str, range(5))),
        np.arange(8),
    )


@pytest.mark.parametrize("seed", range(len(values_of("trackeval"))))
def test_figures_equal_trackeval(seed: int) -> None:
    figures = ManyFigures(comparison_of(sequence(seed)), 30.0)
    for name, value in values_of("trackeval")[seed].items():
        assert np.nan_to_num(getattr(figures, name)) == pytest.approx(value, abs=1e-9), name


def truths(frames: int, *targets: dict[str, Any]) -> list[Truth]:
    """Return targets that move to the right by 1 px a frame from `x`, in frames `first` to the end."""
    return [
        Truth(
            k,
            k / 30,
            tuple(
                TargetTruth(each["id"], (each["x"] + k, 50.0), Box(each["x"] + k, 50, 6, 6), visible=each["visible"](k))
                for each in targets
                if k >= each.get("first", 0)
            ),
        )
        for k in range(frames)
    ]


def target(id: str, x: float, visible: Any = lambda _: 1.0, first: int = 0) -> dict[str, Any]:
    return {"id": id, "x": x, "visible": visible, "first": first}


def tracks(frames: int, *lanes: tuple[int, float, range]) -> TrackSet:
    """Return tracks (id, x of frame 0, frames) that move as the targets do."""
    found = [
        (k, TrackFrame.of([(id, Box(x + k, 50, 6, 6), 1.0) for id, x, where in lanes if k in where]))
        for k in range(frames)
    ]
    ones = np.ones(frames)
    return TrackSet("s", "h", "t", {}, "display", 0, 0, np.arange(frames), ones, ones, ones, **stacked(found))


def figures(truth: list[Truth], found: TrackSet, matching: Matching = "distance") -> dict[str, float]:
    each = ManyFigures(Comparison.of(truth, found, matching), 30.0)
    return {name: float(figure.of(each) or 0) for name, figure in MANY_FIGURES.items() if figure.of is not None}


@pytest.mark.parametrize("matching", ["distance", "iou"])
def test_perfect_tracks(matching: Matching) -> None:
    found = figures(
        truths(30, target("a", 0), target("b", 40)), tracks(30, (1, 0, range(30)), (2, 40, range(30))), matching
    )
    for name in ("hota", "idf1", "mota", "recall", "precision", "found"):
        assert found[name] == 1
    for name in ("switches", "fragments", "misses", "false", "gospa", "ospa", "start_delay", "false_tracks"):
        assert found[name] == 0


def test_starts_switches_and_false_tracks() -> None:
    """a: found from frame 4 on, by track 1, then by track 2; track 3 is on nothing."""
    found = figures(
        truths(30, target("a", 0)), tracks(30, (1, 0, range(4, 15)), (2, 0, range(15, 30)), (3, 90, range(30)))
    )
    assert (found["start_delay"], found["switches"], found["misses"]) == (4, 1, 4)
    assert (found["false"], found["false_tracks"], found["false_tracks_min"]) == (30, 1, 60)


def test_hidden_targets_are_ignored() -> None:
    """A track on a hidden target is neither right nor wrong, and its absence is no miss."""
    hidden = target("a", 0, lambda k: 0.2 if 10 <= k < 20 else 1.0)
    whole = figures(truths(30, hidden), tracks(30, (1, 0, range(30))))
    broken = figures(truths(30, hidden), tracks(30, (1, 0, range(10)), (1, 0, range(20, 30))))
    for found in (whole, broken):
        assert (found["misses"], found["false"], found["mota"]) == (0, 0, 1)


def test_scenes_without_targets_count_false_tracks() -> None:
    found = figures(truths(60), tracks(60, (1, 0, range(10)), (2, 50, range(5))))
    assert (found["false_tracks"], found["false"]) == (2, 15)
    assert found["false_tracks_min"] == 60
    assert np.isnan([found[name] for name in ("mota", "recall", "found", "start_delay")]).all()


def test_gospa_and_ospa_by_hand() -> None:
    """One pair 3 px off, one target missed: GOSPA^2 = 9 + 20^2 / 2, OSPA^2 = (9 + 20^2) / 2."""
    found = figures(truths(2, target("a", 0), target("b", 200)), tracks(2, (1, 3, range(2))))
    assert found["gospa"] == pytest.approx((9 + 200) ** 0.5)
    assert found["ospa"] == pytest.approx(((9 + 400) / 2) ** 0.5)
