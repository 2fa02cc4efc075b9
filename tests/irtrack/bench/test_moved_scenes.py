"""Benches and kept failures of scenes that are read from files, after a move."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from bench_fakes import Logger, steps
from mesh_files import BOX

import irsim
from irtrack.bench import Entry, run_bench

SCENE = """\
frames: 3
camera: {size: [32, 24]}
background: {kind: recording, file: footage/own.mcap}
targets:
  - id: box
    shape: {kind: mesh, file: box.obj, length_m: 4, temperature_k: 380}
    path: {kind: straight, start: [15, 12], range_m: 800}
vary:
  targets.box.path.speed: {kind: uniform, low: 0.1, high: 0.3}
"""
GROUND = "frames: 2\ncamera: {size: [32, 24]}\nbackground: {kind: ground}\n"
"""Scene of the footage."""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A folder that holds scene.yaml, its mesh and, deeper, its footage."""
    project = tmp_path / "all" / "project"
    (project / "footage").mkdir(parents=True)
    irsim.record(irsim.Rendering(irsim.loads(GROUND)), project / "footage" / "own.mcap")
    (project / "box.obj").write_text(BOX)
    (project / "scene.yaml").write_text(SCENE)
    return project


@pytest.fixture
def elsewhere(tmp_path: Path) -> Path:
    """Another folder, to give commands in."""
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    return folder


def test_moved_scene_is_not_repeated(project: Path, elsewhere: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log, results = elsewhere / "log", elsewhere / "r.db"

    def bench(scene: str, cwd: Path) -> list[str]:
        monkeypatch.chdir(cwd)
        with run_bench([scene], [Entry("a", Logger(log=str(log)))], seeds=1, results=results) as found:
            (row,) = found.sources().values()
            assert irsim.loads(row.text).files[0].is_file()
            return [cell.key.digest for cell in found.cells(every=True)]

    first = bench("scene.yaml", project)
    after_first = steps(log)
    assert after_first
    assert bench("../project/scene.yaml", project) == first
    assert bench("all/project/scene.yaml", elsewhere.parent) == first
    shutil.move(project, elsewhere / "moved")
    assert bench("moved/scene.yaml", elsewhere) == first
    assert steps(log) == after_first
