"""Exported data sets as unmodified loaders of other projects read them, in the environment of `make oracles`.

A box shifted by half a pixel, or by half its size, fails every comparison.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import irsim
from irsim.recording.formats.base import clipped
from irsim.render.stream import Rendering
from irsim.types import TargetTruth

ROOT = Path(__file__).parents[2]
ORACLES = Path(os.environ.get("ORACLES_PYTHON") or ROOT / ".venv-oracles" / "bin" / "python")
SIZE = (48, 40)
SCENE = """\
seed: 3
frames: 8
camera: {size: [48, 40], netd_mk: 40, noise: [{kind: white}]}
background: {kind: sky}
targets:
  - {id: jet, shape: {kind: fighter}, cls: jet, path: {kind: straight, start: [36, 20], speed: 1.5, range_m: 1500}}
  - {id: near, shape: {kind: hot_spot, size_m: [6, 4], temperature_k: 330}, cls: jet,
     path: {kind: straight, start: [10, 30], speed: 0.7, range_m: 1500}}
"""
EXPORT = """\
import sys
import irsim
sys.path.append(sys.argv[3])  # after our own packages: rosbags and rerun
for name in ("coco", "yolo", "mot", "sirst", "ros2", "rrd"):
    irsim.export_dataset([sys.argv[1]], f"{sys.argv[2]}/{name}", name)
"""

Targets = list[tuple[TargetTruth, ...]]
"""Targets of each frame."""

pytestmark = pytest.mark.skipif(not ORACLES.exists(), reason="no .venv-oracles; make oracles installs it")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sets")
    (folder / "two.yaml").write_text(SCENE)
    where = [str(ORACLES), "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"]
    site = subprocess.run(where, capture_output=True, text=True, check=True).stdout.strip()
    subprocess.run([sys.executable, "-c", EXPORT, str(folder / "two.yaml"), str(folder), site], check=True)
    return folder


@pytest.fixture(scope="module")
def values(folder: Path) -> dict[str, Any]:
    alone = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    script = ROOT / "tests" / "support" / "dataset_loaders.py"
    done = subprocess.run([ORACLES, script, folder], stdout=subprocess.PIPE, check=True, env=alone)
    found: dict[str, Any] = json.loads(done.stdout)
    return found


@pytest.fixture(scope="module")
def truths(folder: Path) -> Targets:
    return [truth.targets for truth in Rendering(irsim.load(folder / "two.yaml")).truths()]


def corners(target: TargetTruth) -> list[float]:
    """Return left, top, right, bottom of the part in the picture; its first pixel reaches from 0 to 1."""
    return [edge + 0.5 for edge in clipped(target.box, SIZE).edges]


def test_pycocotools_reads_boxes_and_masks(values: dict[str, Any], truths: Targets, folder: Path) -> None:
    exact = irsim.masks(irsim.load(folder / "two.yaml"))
    for index, (targets, masks) in enumerate(zip(truths, exact, strict=True)):
        found = values["pycocotools"][f"two_{index:06}.png"]
        assert [name for name, _, _ in found] == ["jet", "jet"]
        for target, (_, (x, y, w, h), pixels) in zip(targets, found, strict=True):
            assert [x, y, x + w, y + h] == pytest.approx(corners(target), abs=1e-9)
            rows, columns = (masks[target.id].visible >= 0.5).nonzero()
            assert pixels == [list(each) for each in zip(rows.tolist(), columns.tolist(), strict=True)]
            # Covered pixels lie in the box: a mask that is shifted by a pixel would leave it.
            assert min(columns) >= x - 0.5
            assert max(columns) + 1 <= x + w + 0.5


@pytest.mark.parametrize("format", ["coco", "yolo"])
def test_supervision_reads_boxes(format: str, values: dict[str, Any], truths: Targets) -> None:
    for index, targets in enumerate(truths):
        found = values[f"supervision {format}"][f"two_{index:06}.png"]
        assert [name for name, _ in found] == ["jet", "jet"]
        for target, (_, box) in zip(targets, found, strict=True):
            assert box == pytest.approx(corners(target), abs=1e-4)
            assert min(box[2] - box[0], box[3] - box[1]) > 2


def test_trackeval_reads_tracks(values: dict[str, Any], truths: Targets) -> None:
    found = values["trackeval"]
    assert (found["frames"], found["hota"]) == (8, pytest.approx(1))
    for targets, rows in zip(truths, found["rows"], strict=True):
        assert [id for id, _ in rows] == [1, 2]
        for target, (_, box) in zip(targets, rows, strict=True):
            x, y, w, h = target.box.pixels
            assert box == pytest.approx([x + 1, y + 1, w, h], abs=1e-9)


def test_pyirstdmetrics_reads_masks(values: dict[str, Any]) -> None:
    expected = {"same_pd": 1, "same_fa": 0, "nothing_pd": 0, "nothing_fa": 0}
    assert values["pyirstdmetrics"] == pytest.approx(expected)


def test_rosbags_reads_pictures_and_boxes(values: dict[str, Any], truths: Targets, folder: Path) -> None:
    found = values["rosbags"]
    frames = Rendering(irsim.load(folder / "two.yaml")).frames()
    for index, (frame, targets) in enumerate(zip(frames, truths, strict=True)):
        assert found["times"][index] == round(frame.time * 1e9)
        assert found["pictures"][index] == ["mono16", 48, 40, int(frame.image.view("u1").sum())]
        expected = [[t.id, t.box.cx + 0.5, t.box.cy + 0.5, t.box.w, t.box.h] for t in targets]
        assert [each[0] for each in found["boxes"][index]] == [each[0] for each in expected]
        for one, other in zip(found["boxes"][index], expected, strict=True):
            assert one[1:] == pytest.approx(other[1:])


def test_rerun_reads_its_file(folder: Path) -> None:
    rerun = ORACLES.with_name("rerun")
    file = str(folder / "rrd" / "two.rrd")
    assert subprocess.run([rerun, "rrd", "verify", file], capture_output=True, check=False).returncode == 0
    facts = subprocess.run([rerun, "rrd", "stats", file], capture_output=True, text=True, check=True).stdout
    assert "/image/targets" in facts
