"""Files of tracks of many targets and of detections: written, read, and used as a detector."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bench_fakes import Strip
from command_line import Call

import irtrack
from irtrack.bench.track_files import COLUMNS, read_track_set, rows, write_detections, write_track_set
from irtrack.detectors import make_detector
from irtrack.tracks import STATUSES, DetectionSet, TrackSet

FRAMES = np.array([0, 1, 2, 4])
"""Frames seen, of which 0 has no track."""
HEAD = ",".join(COLUMNS)


def track_set() -> TrackSet:
    """Two tracks and a candidate of several statuses and classes, on scores of which one is unknown."""
    random = np.random.default_rng(5)
    places = random.uniform(0, 99, (5, 4))
    return TrackSet(
        source="strip",
        source_hash="ab",
        tracker="gnn",
        config={},
        input="display",
        scene_seed=None,
        tracker_seed=0,
        frames=FRAMES,
        times=FRAMES / 30,
        step_ms=np.zeros(4),
        cpu_ms=np.zeros(4),
        frame=np.array([1, 1, 2, 4, 4]),
        id=np.array([3, 9, 3, 3, 70_000]),
        cx=places[:, 0],
        cy=places[:, 1],
        w=places[:, 2] + 0.1,
        h=places[:, 3] + 0.1,
        score=np.array([0.5, np.nan, 7.25, 1e-3, 2.0]),
        status=np.array([0, 1, 2, 0, 0], np.int8),
        confirmed=np.array([True, True, True, True, False]),
        classes=("drone", None, "drone", "bird, small", None),
    )


@pytest.mark.parametrize("name", ["t.mcap", "t.csv", "t.parquet", "t.txt"])
def test_tracks_are_read_as_written(name: str, tmp_path: Path) -> None:
    written = track_set()
    read = read_track_set(write_track_set(written, tmp_path / name))
    if name != "t.txt":
        assert rows(read) == rows(written)
    else:
        confirmed = written.confirmed
        assert read.classes is None
        assert set(read.status.tolist()) == {STATUSES.index("tracking")}
        for column in ("frame", "id", "cx", "cy", "w", "h", "score"):
            np.testing.assert_allclose(getattr(read, column), getattr(written, column)[confirmed], rtol=1e-12)
    if name == "t.mcap":
        assert read.frames.tolist() == FRAMES.tolist()
        np.testing.assert_allclose(read.times, written.times, atol=1e-9)
        assert (read.source, read.source_hash, read.tracker) == ("strip", "ab", "gnn")


@pytest.mark.parametrize("name", ["t.mcap", "t.csv", "t.parquet", "t.txt"])
def test_no_track_is_a_file_too(name: str, tmp_path: Path) -> None:
    full = track_set()
    columns = ("frame", "id", "cx", "cy", "w", "h", "score", "status", "confirmed")
    empty = replace(full, classes=None, **{each: getattr(full, each)[:0] for each in columns})
    read = read_track_set(write_track_set(empty, tmp_path / name))
    assert rows(read) == []
    assert len(read.frames) == (4 if name == "t.mcap" else 0)


def test_track_of_one_target_is_a_set_with_one_id(tmp_path: Path) -> None:
    track = irtrack.run("template", Strip())
    read = read_track_set(write_track_set(track, tmp_path / "one.mcap"))
    assert set(read.id.tolist()) == {0}
    np.testing.assert_array_equal(np.column_stack([read.cx, read.cy]), track.centers)
    assert tuple(STATUSES[place] for place in read.status.tolist()) == track.statuses
    assert rows(read) == rows(TrackSet.of(track))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (HEAD.replace("cx", "x") + "\n", ":1: no column 'cx'; allowed: frame, id, cx"),
        (f"{HEAD}\n0,1,2,3,4\n", ":2: 5 cells; allowed: at least 10"),
        (f"{HEAD}\n0,1,2,3,4,5,,tracking,True,\n\n0,1,2,3,0,5,,tracking,True,\n", ":4: w '0': allowed: above 0"),
        (f"{HEAD}\n0,1,nan,3,4,5,,tracking,True,\n", ":2: cx 'nan': allowed: a finite number"),
        (f"{HEAD}\n0,1.5,2,3,4,5,,tracking,True,\n", ":2: id '1.5': allowed: a whole number"),
        (f"{HEAD}\n-1,1,2,3,4,5,,tracking,True,\n", ":2: frame '-1': allowed: 0 or more"),
        (f"{HEAD}\n0,1,2,3,4,5,,gone,True,\n", ":2: status 'gone': allowed: tracking, occluded, lost"),
        (f"{HEAD}\n" + 2 * "0,1,2,3,4,5,,tracking,True,\n", ":3: track 1 is in frame 0 twice; allowed: once"),
        ("\0\xff", "1: no column 'frame'"),
    ],
)
def test_wrong_files_of_tracks_are_one_line(text: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text(text)
    with pytest.raises(irtrack.InputError) as caught:
        read_track_set(path)
    assert "\n" not in str(caught.value)
    assert said in str(caught.value)


def test_files_of_another_kind_are_one_line(tmp_path: Path) -> None:
    (tmp_path / "t.parquet").write_text("text")
    for name, said in (("t.parquet", "is no Parquet file"), ("t.json", "allowed: a file that ends in .csv")):
        with pytest.raises(irtrack.InputError, match=said):
            read_track_set(tmp_path / name)


def detections() -> DetectionSet:
    found: DetectionSet = irtrack.run_detector("tophat", "sky", frames=4)
    assert len(found)
    return replace(found, classes=("jet",) + (None,) * (len(found) - 1))


@pytest.mark.parametrize("name", ["d.csv", "d.txt"])
def test_detections_of_a_file_are_those_written(name: str, tmp_path: Path) -> None:
    written = detections()
    detector = make_detector("file", {"path": str(write_detections(written, tmp_path / name))})
    read = irtrack.run_detector(detector, "sky", frames=6)
    for column in ("frame", "cx", "cy", "w", "h", "score"):
        np.testing.assert_allclose(getattr(read, column), getattr(written, column), rtol=1e-12)
    assert (read.classes is not None) == (name == "d.csv")
    assert read.classes is None or read.classes[:1] == ("jet",)


def test_tracker_runs_on_a_file_of_detections(bare_call: Call) -> None:
    """From the detector's run to the tracker's: the tracks are those of the tracker on that detector."""
    assert bare_call("run", "tophat:most=5", "sky", "frames=12", "--csv", "d.csv").status == 0
    assert bare_call("run", "gnn", "sky", "frames=12", "detections=d.csv", "-o", "a.mcap").status == 0
    assert bare_call("run", "gnn:detector='tophat:most=5'", "sky", "frames=12", "--csv", "b.csv").status == 0
    assert len(rows(read_track_set("a.mcap"))) > 0
    assert rows(read_track_set("a.mcap")) == rows(read_track_set("b.csv"))
    Path("mine.py").write_text("class All:\n    def step(self, detections):\n        return []\n")
    assert bare_call("run", "mine:All", "sky", "frames=3", "detections=d.csv").status == 0
    Path("d.csv").write_text("frame,cx,cy,w,h,score\n0,1,2,3,4,high\n")
    for words in (("run", "gnn:detections=d.csv", "sky"), ("bench", "sky", "--trackers", "gnn:detections=d.csv")):
        answer = bare_call(*words)
        assert (answer.status, answer.err) == (2, "irtrack: d.csv:2: score 'high': allowed: a finite number\n")


def test_another_file_of_detections_is_another_run(tmp_path: Path) -> None:
    from irtrack.registry.identity import weights_digest
    from irtrack.registry.table import make

    path = tmp_path / "d.csv"
    digests = set()
    for score in (1, 2):
        path.write_text(f"frame,cx,cy,w,h,score\n0,1,2,3,4,{score}\n")
        digests.add(weights_digest(make("gnn", {"detections": str(path)})))
    assert len(digests) == 2
