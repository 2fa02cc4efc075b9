"""Trackers and detectors that need the camera's pose: frames with it, one line without it, marks in tables."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from bench_fakes import Walker

import irsim
import irtrack
from irsim.errors import InputError
from irsim.geometry.projection import homography
from irsim.types import Box, Frame, Pose
from irtrack.bench import Entry, run_bench, summary
from irtrack.bench.task_summary import task_summary
from irtrack.cli.output import print_summary, print_tasks
from irtrack.registry.identity import tracker_config, tracker_needs, tracker_of_config
from irtrack.registry.table import MULTI_TRACKERS, make
from irtrack.replay.many import run_detector, run_many
from irtrack.report.page import page
from irtrack.trackers.gnn import GNN
from irtrack.types import Estimate

SCENE = irsim.loads("""
frames: 5
camera: {size: [64, 48], elevation_deg: 10, motion: [{kind: pan, azimuth_deg_s: 3}, {kind: jitter, rms_px: 1}]}
background: {kind: sky}
targets: [{id: jet, shape: {kind: point, area_m2: 9}, path: {kind: straight, start: [8, 20], speed: 2, range_m: 900}}]
""")
REFERENCE = Path(__file__).parents[3] / "recordings" / "reference" / "car.mcap"
"""A recording made before recordings held the pose."""
SEEN: list[Any] = []


class Posed(Walker):
    needs: ClassVar[tuple[str, ...]] = ("pose",)

    def step(self, state: Box, frame: Frame, rng: np.random.Generator) -> tuple[Box, Estimate]:
        SEEN.append(frame.pose)
        return super().step(state, frame, rng)


class Unposed(Posed):
    needs: ClassVar[tuple[str, ...]] = ()


class PosedPlain:
    needs = ("pose",)

    def start(self, frame: Frame, box: Box) -> None:
        self.box = box

    def step(self, frame: Frame) -> Box:
        SEEN.append(frame.pose)
        return self.box


class PosedMany:
    needs = ("pose",)

    def start(self, frame: Frame) -> None:
        pass

    def step(self, frame: Frame) -> list[tuple[int, Box, float]]:
        SEEN.append(frame.pose)
        return [(0, Box(5, 5, 5, 5), 1.0)]


class PosedDetector:
    needs = ("pose",)

    def detect(self, frame: Frame) -> list[Box]:
        SEEN.append(frame.pose)
        return []


class WrongNeeds(Walker):
    needs: ClassVar[Any] = ("truth",)


POSES = [truth.pose for truth in irsim.Rendering(SCENE).truths()]


@pytest.mark.parametrize("kind", [Posed, PosedPlain, PosedMany, PosedDetector, Unposed])
def test_only_trackers_that_need_the_pose_get_it(kind: type[Any]) -> None:
    SEEN.clear()
    run = {PosedMany: run_many, PosedDetector: run_detector}.get(kind, irtrack.run)
    run(kind, SCENE)
    wanted = POSES if kind is PosedDetector else POSES[1:]
    assert ([None] * 4 if kind is Unposed else wanted) == SEEN
    assert len(set(POSES)) == 5


def test_a_recording_gives_the_poses_of_its_scenario(tmp_path: Path) -> None:
    SEEN.clear()
    irtrack.run(Posed, irsim.record(irsim.Rendering(SCENE), tmp_path / "r.mcap"))
    assert POSES[1:] == SEEN


def test_a_source_without_poses_is_one_line(tmp_path: Path) -> None:
    line = r"there is no camera pose, which a tracker needs; allowed: a scenario, [^\n]*$"
    with pytest.raises(InputError, match=f"^test_pose_needs:Posed: frame 0: {line}"):
        irtrack.run(Posed, REFERENCE, init=(Box(9, 9, 5, 5), 0))
    with pytest.raises(InputError, match=f"^gnn: frame 0: {line}"):
        run_many("gnn", REFERENCE, parameters={"ego_motion": "pose"})
    with pytest.raises(InputError, match=f"^car: {line}"):
        run_bench([REFERENCE], [Posed()], results=tmp_path / "r.db")
    with pytest.raises(InputError, match="needs the camera's pose, which the clips of a check do not have"):
        irtrack.check(Posed)


def test_needs_are_part_of_the_configuration() -> None:
    posed = GNN(ego_motion="pose")
    assert tracker_needs(posed) == ("pose",)
    assert tracker_needs(GNN(ego_motion="image")) == ()
    assert tracker_config(posed)["needs"] == ["pose"]
    assert "needs" not in tracker_config(GNN())
    assert repr(tracker_of_config(tracker_config(posed))) == repr(posed)
    with pytest.raises(InputError, match=r"needs \('truth',\); allowed: \('pose',\), or \(\)"):
        irtrack.run(WrongNeeds, SCENE)


def test_a_tracker_needs_what_its_detector_needs() -> None:
    made = GNN(detector="test_pose_needs:PosedDetector")
    assert tracker_needs(made) == ("pose",)
    SEEN.clear()
    run_many(made, SCENE)
    assert SEEN == POSES


def test_tables_mark_trackers_with_the_pose(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    trackers = [Entry("a", Posed()), Entry("b", Unposed()), Entry("c", GNN(ego_motion="pose")), Entry("d", GNN())]
    with run_bench([irsim.Rendering(SCENE, "scene")], trackers, results=tmp_path / "r.db", seeds=1) as results:
        cells = results.cells()
        for rows, show in ((summary(cells), print_summary), (task_summary(cells), print_tasks)):
            assert {row.label: row.as_dict()["needs"] for row in rows} in (
                {"a": "pose", "b": ""},
                {"c": "pose", "d": ""},
            )
            show(rows)  # type: ignore[arg-type]  # each of its own rows
            text = capsys.readouterr().out
            assert sum(f" {label}* " in text for label in "ac") == 1
            assert not any(f" {label}* " in text for label in "bd")
            assert text.count("\n* with the camera's pose of each frame") == 1
        html = page(results, [cell for cell in cells if cell.key.task == "many"])
    mark = '<abbr title="with the camera&#39;s pose of each frame, which other trackers do not get">*</abbr>'
    assert f"c{mark}</span>" in html
    assert f"d{mark}</span>" not in html
    assert html.count("<dt>*</dt>") == 1


@pytest.mark.parametrize("kind", MULTI_TRACKERS)
def test_a_camera_that_moves_is_compensated(kind: str) -> None:
    """A point at rest in the sky stays one track, and its speed is 0, while the camera turns by 12 px in a frame."""
    image = np.zeros((240, 320), np.uint8)
    frames = []
    first = Pose(0.0, 0.0, 0.0, 3e-4)
    for k in range(12):
        pose = Pose(0.2 * k * (-1) ** k, 0.1 * (k % 3), 3.0 * k, 3e-4)
        x, y, w = homography(first, pose, (320, 240)) @ (170.0, 110.0, 1.0)
        picture = image.copy()
        picture[round(y / w) - 1 : round(y / w) + 2, round(x / w) - 1 : round(x / w) + 2] = 200
        frames.append(Frame(picture, k, k / 30, 8, pose))
    tracks = {}
    for way in ("none", "pose"):
        made: Any = make(kind, {"ego_motion": way, "detector": "tophat"})
        rng = np.random.default_rng(0)
        state = made.init(frames[0], rng)
        for frame in frames[1:]:
            state, found = made.step(state, frame, rng)
        tracks[way] = found
    assert tracks["pose"].ids.tolist() == [0]
    assert tracks["pose"].confirmed.all()
    assert np.abs(tracks["pose"].velocities).max() < 0.5
    assert 0 not in tracks["none"].ids.tolist()
