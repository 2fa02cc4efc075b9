"""The examples of CONTRIBUTING work: each kind in a package of one's own; noise, tracker, shape and AGC in this one."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import irsim

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "CONTRIBUTING.md").read_text()

SCENE = """
frames: 12
camera: {size: [160, 120], motion: [{kind: "kinds:Nod"}], agc: {kind: "kinds:SquareRoot"}, noise: []}
background: {kind: "kinds:Screen", wall_k: 280}
targets:
  - id: crate
    shape: {kind: "kinds:Crate", length_m: 8, lid_k: 330}
    path: {kind: "kinds:Zigzag", start: [40, 60], range_m: 900}
occluders:
  - {kind: "kinds:Triangle", id: tent, top_px: [60, 50], range_m: 500}
"""

TABLES = {
    "Hum": ("irsim/camera/hum.py", "irsim/camera/__init__.py", '        "white": White,'),
    "Brightest": ("irtrack/trackers/brightest.py", "irtrack/registry/table.py", '    "template": Template,'),
    "Crate": ("irsim/targets/crate.py", "irsim/targets/__init__.py", '        "point": Point,'),
    "SquareRoot": ("irsim/camera/square_root.py", "irsim/camera/agc_local.py", '        "linear": Linear,'),
}
"""File of a kind, file of its table, and the row after its own, by class."""


def blocks(text: str, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.M | re.S)


def test_each_kind_works_in_another_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "kinds.py").write_text("\n\n".join(blocks(PAGE.partition("## The other kinds")[2], "python")))
    (tmp_path / "scene.yaml").write_text(SCENE)
    monkeypatch.syspath_prepend(str(tmp_path))
    source = irsim.open_source(irsim.load(tmp_path / "scene.yaml"))
    frame, truth = source.frame(10), source.truth(10)
    first, last = source.truth(0).target("crate"), truth.target("crate")
    assert first is not None
    assert last is not None
    # The path goes 10 px to the right and 10 px up; the camera's nod of 10 mrad sin(1) moves the picture 16.8 px down.
    assert np.subtract(last.center, first.center) == pytest.approx((10, -10 + 16.8), abs=4)
    assert np.unique(frame.image).size >= 4  # wall, crate, lid, tent
    shown = source.frame(10, "display").image
    np.testing.assert_array_equal(shown, (255 * np.sqrt(frame.image / (2**frame.bits - 1))).astype(np.uint8))


@pytest.fixture(scope="module")
def repository(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of both packages to which four examples are added as CONTRIBUTING says."""
    folder = tmp_path_factory.mktemp("repository")
    for package in ("irsim", "irtrack"):
        shutil.copytree(ROOT / package, folder / package)
    for name in ("scenarios", "schemas"):
        if (ROOT / name).exists():
            (folder / name).symlink_to(ROOT / name)
    for name, (file, table, before) in TABLES.items():
        [example] = [text for text in blocks(PAGE, "python") if f"class {name}(" in text]
        if "write_text" in example:
            subprocess.run([sys.executable, "-c", example], cwd=folder, check=True)
            (folder / Path(file).name).rename(folder / file)
        else:
            (folder / file).write_text(example)
        module = file.removesuffix(".py").replace("/", ".")
        imported, row = f"from {module} import {name}", f'"{Path(file).stem}": {name},'
        assert "write_text" not in example or f"`{row}`" in PAGE
        text = (folder / table).read_text()
        assert text.count(before) == 1
        text = text.replace(before, f"{row}\n{before}").replace("\nfrom irsim", f"\n{imported}\nfrom irsim", 1)
        (folder / table).write_text(text)
    return folder


def run_python(repository: Path, *words: str) -> str:
    env = {**os.environ, "PYTHONPATH": str(repository)}
    done = subprocess.run(
        [sys.executable, *words], cwd=repository, env=env, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout.strip()


CONTRACTS = {
    "hum or crate or square_root": [
        *("irsim/config/test_kinds.py", "irsim/camera/test_noise.py"),
        *("irsim/camera/test_agc.py", "irsim/targets/test_target_contract.py"),
    ],
    "brightest": ["irtrack/trackers/test_tracker_contract.py"],
}
"""Files of contract tests, by kinds."""


@pytest.mark.parametrize(
    "kinds", [pytest.param(kinds, marks=() if "hum" in kinds else pytest.mark.slow) for kinds in CONTRACTS]
)
def test_kinds_in_this_repository_pass_their_contract(repository: Path, kinds: str) -> None:
    files = [str(ROOT / "tests" / file) for file in CONTRACTS[kinds]]
    said = run_python(repository, "-m", "pytest", "-vv", "-p", "no:cacheprovider", "-k", kinds, *files)
    for kind in kinds.split(" or "):
        assert re.search(rf"\b{kind}\b.*PASSED", said)
