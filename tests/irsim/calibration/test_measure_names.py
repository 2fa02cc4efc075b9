"""docs/figures.md names all that the measuring commands print as JSON, and nothing else."""

from __future__ import annotations

import json
import re
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import irsim
from irsim.camera.bad_pixels import BadPixels
from irsim.cli.app import app
from irsim.measure import CAMERAS, Figures, NoiseReport, Texture
from irsim.measure.field import Field
from irsim.measure.flaws import Flaws
from irsim.measure.memory import Memory

PAGE = Path(__file__).parents[3] / "docs" / "figures.md"
NO_FIGURES = {"frames", "memory_age_s", "rows", "columns", "texture", "mean", "histogram", "flaws", "region", "notes"}
"""Fields of `Figures` that are told elsewhere in the document, or are made of others."""
OF_PARTS = {"rows.*": Memory, "columns.*": Memory, "texture.*": Field, "flaws.*": Flaws}

SCENE = """
frames: 30
camera: {preset: uncooled_lwir, size: [64, 64]}
background: {kind: ground, spread_k: 2}
"""


BAD = """
frames: 30
camera:
  size: [64, 64]
  bits: 14
  noise: [{kind: white}, {kind: bad_pixels, dead: 0.01, hot: 0.01, blinking: 0, dead_level: 0.1}]
background: {kind: ground, spread_k: 0}
"""


def tables(command: str) -> list[dict[str, str]]:
    """Of each table below the heading of a command: what stands beside each name."""
    section = PAGE.read_text().split(f"## `irsim {command} --json`")[1].split("\n## ")[0]
    parts = re.split(r"\| --- \| --- \|\n", section)[1:]
    found = []
    for part in parts:
        rows = [line.split(" | ", 1) for line in part.splitlines() if line.startswith("| `")]
        found.append({name: text for names, text in rows for name in re.findall(r"`([^`]+)`", names)})
    return found


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("names") / "scene.yaml"
    path.write_text(SCENE)
    return str(path)


def printed(*arguments: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(CliRunner().invoke(app, [*arguments, "--json"]).stdout)
    return found


def test_names_of_noise(scene: str) -> None:
    (table,) = tables("noise")
    assert set(table) == {field.name for field in fields(NoiseReport)} | {"source", "start"}
    assert set(table) == set(printed("noise", scene))


def test_names_of_a_fit(scene: str) -> None:
    top, figures = tables("fit")
    found = printed("fit", scene)
    assert set(top) == set(found)
    assert set(figures) == ({field.name for field in fields(Figures)} - NO_FIGURES) | set(OF_PARTS)
    assert found["figures"]
    assert {re.sub(r"\..*", ".*", name) for name in found["figures"]} <= set(figures)
    for name, part in OF_PARTS.items():
        told = set(re.findall(r"`([a-z_]+)`", figures[name]))
        assert told <= {field.name for field in fields(part)}
        assert {figure.split(".")[1] for figure in found["figures"] if figure.startswith(name[:-1])} <= told
    assert set(re.findall(r"`([a-z_]+)`", figures["flaws.*"])) == {field.name for field in fields(Flaws)}


def test_all_that_a_fit_writes_of_bad_pixels_is_among_its_figures() -> None:
    fitted = irsim.fit(irsim.loads(BAD))
    (noise,) = [each for each in fitted.scenario.camera.noise if isinstance(each, BadPixels)]
    full = 2**14 - 1
    figures = fitted.as_json()["figures"]
    assert figures["flaws.cluster"] == [pytest.approx(noise.cluster, rel=5e-3), None, None]  # three digits are written
    assert figures["flaws.dead_level"] == [pytest.approx(noise.dead_level * full, rel=5e-4), None, None]
    clean = irsim.fit(irsim.loads(BAD.replace("0.01", "0"))).as_json()["figures"]
    assert "flaws.dead" in clean
    assert not {"flaws.cluster", "flaws.dead_level"} & set(clean)


def test_names_of_realism(scene: str) -> None:
    (table,) = tables("realism")
    assert set(table) == set(printed("realism", scene))


def test_names_of_realism_where_a_part_is_not_judged(scene: str) -> None:
    """Texture with a camera alone, noise of three frames."""
    (table,) = tables("realism")
    picture, noise = {*Texture.__slots__, "like", "classes"}, {*CAMERAS["cooled"], "camera", "cameras"}
    assert set(printed("realism", scene, "--camera", "uncooled")) == set(table) - picture
    assert set(printed("realism", scene, "--camera", "uncooled", "--like", "cloud")) == set(table)
    assert set(printed("realism", scene, "frames=3")) == (set(table) - noise) | {"noise_unknown"}
    (told,) = [row for names, row in table.items() if names == "beta"]
    assert "`--camera`" in told
    assert set(re.findall(r"`([a-z_]+)`", told)) == {"like", "classes"}
