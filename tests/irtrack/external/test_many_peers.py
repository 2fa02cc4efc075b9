"""Trackers of many that run as programs on detections, and the peers of other libraries."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from plots_of_targets import SIZE, detections

import irsim
import irtrack
from irsim.types import Frame
from irtrack import external as peers
from irtrack.errors import InputError, TrackerError
from irtrack.external import DetectionSession, install
from irtrack.external.many_server import MANY_PEERS
from irtrack.registry.table import describe, make
from irtrack.trackers.many_external import MANY_EXTERNAL
from irtrack.tracks import TrackFrame
from irtrack.types import Detections

FAKE = Path(__file__).parents[2] / "support" / "fake_many_peer.py"
INSTALLED = peers.offered(*MANY_PEERS)
BLANK = np.zeros(SIZE[::-1], np.uint8)


def fake(mode: str = "good", at: int = 3, **more: object) -> Any:
    words = [sys.executable, str(FAKE), mode, str(at)]
    return make("program_many", {"command": shlex.join(words), **more})


def answers(tracker: Any, plots: list[Detections], seed: int = 5) -> list[TrackFrame]:
    """Return the tracks of each frame but the first."""
    session = DetectionSession(tracker.name, tracker.runs(), tracker.timeout_s)
    session.init(Frame(BLANK, 0, 0.0, 8), tracker.passed(plots[0]), seed)
    later = enumerate(plots[1:], start=1)
    return [session.step(Frame(BLANK, k, k / 30, 8), tracker.passed(each)) for k, each in later]


def test_detections_arrive_and_tracks_return() -> None:
    plots = [detections([(90.25, 50.5 + k), (20.0, 30.0)]) for k in range(4)]
    for frame, each in zip(answers(fake(), plots), plots[1:], strict=True):
        np.testing.assert_allclose(frame.centers, each.centers[::-1])
        np.testing.assert_allclose(frame.sizes, 5.0)
        assert frame.ids.tolist() == [0, 1]
        assert frame.scores.tolist() == [5, 5]
        assert frame.confirmed.all()
        assert set(frame.statuses) == {"tracking"}


def test_scores_and_statuses_may_be_left_out() -> None:
    plots = [detections([(20, 30)])] * 3
    short, hidden = (answers(fake(mode, 1), plots)[0] for mode in ("short", "occluded"))
    assert np.isnan([short.scores[0], hidden.scores[0]]).all()
    assert (short.statuses, hidden.statuses) == (("tracking",), ("occluded",))


def test_near_detections_are_merged_and_small_boxes_widened() -> None:
    crowd = detections([(20, 30), (22, 30), (60, 30)], np.array([5.0, 9.0, 7.0]))
    frame = answers(fake(box_px=12), [crowd, crowd])[0]
    assert frame.centers[:, 0].tolist() == [22, 60]
    assert (frame.sizes == 12).all()


def test_a_program_of_many_runs_on_a_detector() -> None:
    source = irsim.open_source("swarm", ["frames=6"])
    tracks = irtrack.run_many(fake(detector="tophat"), source)
    found = irtrack.run_detector("tophat", source)
    assert len(tracks) > 0
    assert set(zip(tracks.frame, tracks.cx.round(6), strict=True)) <= set(
        zip(found.frame, found.cx.round(6), strict=True)
    )


@pytest.mark.parametrize(
    ("mode", "said"),
    [
        ("raise", "program_many: frame 3: ValueError: too many"),
        ("die", "program_many: frame 3: its program ended with status 3; it last wrote: out of luck"),
        ("twice", "program_many: frame 3: two tracks have the id 1; allowed: each id once a frame"),
        ("nan", "program_many: frame 3: the centers of track 1 are not finite"),
        ("flat", "program_many: frame 3: a size of 0 or less"),
        ("status", "program_many: frame 3: its program answered"),
        ("half", "program_many: frame 3: its program answered"),
        ("none", "program_many: frame 3: its program answered b'{}'; allowed: {\"tracks\": [[id, x, y, w, h, score"),
    ],
)
def test_an_error_of_a_program_of_many_is_one_line(mode: str, said: str) -> None:
    with pytest.raises(TrackerError) as raised:
        irtrack.run_many(fake(mode), irsim.open_source("swarm", ["frames=5"]))
    assert str(raised.value).startswith(said)
    assert "\n" not in str(raised.value)


def test_a_missing_peer_of_many_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(install, "python", lambda: None)
    with pytest.raises(InputError, match="rf_sort: runs in an environment that is not there"):
        make("rf_sort", {})
    assert {*MANY_PEERS, "program_many"} == MANY_EXTERNAL.keys()
    assert {row.name for row in describe()} & MANY_EXTERNAL.keys() == {"program_many"}


@pytest.mark.slow
@pytest.mark.skipif(not INSTALLED, reason=f"no peers of many here: {peers.HINT}")
@pytest.mark.parametrize("name", INSTALLED or ["none"])
def test_an_installed_peer_keeps_identities(name: str) -> None:
    """Of three targets far apart, each seen in every frame."""
    rng = np.random.default_rng(0)
    places = np.array([[40.0, 40], [40, 110], [40, 190]])
    paths = [places + np.array([1.5 * k, 0]) for k in range(40)]
    frames = answers(make(name, {}), [detections(each + rng.normal(0, 0.3, each.shape)) for each in paths])
    owners = []
    for frame, each in zip(frames[15:], paths[16:], strict=True):
        apart = np.hypot(*(frame.centers[None] - each[:, None]).transpose(2, 0, 1))
        assert apart.min(axis=1).max() < 5
        owners.append(frame.ids[apart.argmin(axis=1)].tolist())
    assert all(each == owners[0] for each in owners)
    assert len(set(owners[0])) == 3
