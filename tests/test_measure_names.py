"""docs/figures.md names all that the measuring commands print as JSON, and nothing else."""

from __future__ import annotations

import json
import re
from dataclasses import fields
from pathlib import Path

import pytest
from typer.testing import CliRunner

import irsim
from irsim.cli import app
from irsim.measure import Figures, NoiseReport
from irsim.measure.field import Field
from irsim.measure.flaws import Flaws
from irsim.measure.memory import Memory

PAGE = Path(__file__).parent.parent / "docs" / "figures.md"
NO_FIGURES = {"frames", "memory_age_s", "rows", "columns", "texture", "mean", "histogram", "flaws", "region", "notes"}
"""Fields of `Figures` that are told elsewhere in the document, or are made of others."""
OF_PARTS = {"rows.*": Memory, "columns.*": Memory, "texture.*": Field, "flaws.*": Flaws}

SCENE = """
frames: 30
camera: {preset: uncooled_lwir, size: [64, 64]}
background: {kind: ground, spread_k: 2}
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


def printed(command: str, scene: str) -> set[str]:
    return set(json.loads(CliRunner().invoke(app, [command, scene, "--json"]).stdout))


def test_names_of_noise(scene: str) -> None:
    (table,) = tables("noise")
    assert set(table) == {field.name for field in fields(NoiseReport)} | {"source", "start"} == printed("noise", scene)


def test_names_of_a_fit(scene: str) -> None:
    top, figures = tables("fit")
    assert set(top) == printed("fit", scene)
    assert set(figures) == ({field.name for field in fields(Figures)} - NO_FIGURES) | set(OF_PARTS)
    measured = dict(irsim.fit(scene).figures.measured())
    assert measured
    assert {re.sub(r"\..*", ".*", name) for name in measured} <= set(figures)
    for name, part in OF_PARTS.items():
        told = set(re.findall(r"`([a-z_]+)`", figures[name]))
        assert told <= {field.name for field in fields(part)}
        assert {figure.split(".")[1] for figure in measured if figure.startswith(name[:-1])} <= told


def test_names_of_realism(scene: str) -> None:
    (table,) = tables("realism")
    assert set(table) == printed("realism", scene)
