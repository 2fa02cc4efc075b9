"""Warnings of all severities: each is told once, and what is alike at them is worked out once."""

from __future__ import annotations

from pathlib import Path
from unittest.mock import Mock

import pytest

from irsim.backgrounds import Ground
from irsim.errors import InputError
from irsim.lint.warnings import warnings
from irsim.scenario.placement_placing import place

LEAVES = """
frames: 50
camera: {size: [160, 120]}
background: {kind: ground}
targets:
  - {id: jet, shape: {kind: point, area_m2: 3}, path: {kind: straight, start: [59.6, 62], speed: 1, range_m: 300}}
"""
"""Its right edge is 99.9 px away: at 5 px a frame it is there in frames 0 to 19, at 6 in 0 to 16, at 10 in 0 to 9."""


def written(folder: Path, severities: str) -> Path:
    path = folder / "scene.yaml"
    path.write_text(f"{LEAVES}severities:\n  targets.jet.path.speed: {severities}\n")
    return path


@pytest.mark.parametrize(
    ("speeds", "told"),
    [
        ("[1, 5, 6, 10]", "at severities 1 to 3: at the first of them: "),
        ("[5, 1, 6, 10]", "at severities 0, 2 and 3: at the first of them: "),
        ("[5, 6]", "at severities 0 and 1: at the first of them: "),
        ("[1, 5, 5]", "at severities 1 and 2: "),
        ("[5, 5]", ""),
    ],
)
def test_a_warning_that_differs_in_numbers_alone_is_told_once_with_the_first_ones(
    speeds: str, told: str, tmp_path: Path
) -> None:
    (line,) = warnings(written(tmp_path, speeds))
    assert f"warning: {told}jet, whom trackers follow, is out of the picture in 30 of the 50 frames" in line


def test_what_is_told_of_two_names_stays_two_warnings(tmp_path: Path) -> None:
    path = tmp_path / "scene.yaml"
    path.write_text(f"{LEAVES}severities:\n  targets.0.id: [jet1, jet2]\n  targets.0.path.speed: [5, 6]\n")
    first, second = warnings(path)
    assert "at severity 0: jet1" in first
    assert "at severity 1: jet2" in second


def test_bare_ground_is_looked_at_once_where_severities_leave_it(monkeypatch: pytest.MonkeyPatch) -> None:
    land = Mock(wraps=Ground(mean_k=291, spread_k=0.15).ground_radiance)
    monkeypatch.setattr(Ground, "ground_radiance", land)
    for seed in (1, 2):
        warnings("stress/clutter", [f"seed={30 + seed}"])
        assert land.call_count == seed


def test_ground_that_severities_change_is_looked_at_anew(tmp_path: Path) -> None:
    """Too warm at severity 1 alone."""
    path = tmp_path / "scene.yaml"
    path.write_text(f"{LEAVES}severities:\n  background.mean_k: [290, 900, 290]\n".replace("frames: 50", "frames: 9"))
    (line,) = [line for line in warnings(path) if "lies above" in line]
    assert "at severity 1: all of the ground" in line


def test_occluders_are_placed_once_at_each_severity(monkeypatch: pytest.MonkeyPatch) -> None:
    placing = Mock(wraps=place)
    monkeypatch.setattr("irsim.scenario.placement_all.place", placing)
    warnings("stress/occlusion", ["seed=31"])
    assert placing.call_count == 6


def test_all_that_is_wrong_at_any_severity_is_told_at_once(tmp_path: Path) -> None:
    path = tmp_path / "scene.yaml"
    path.write_text(f"{LEAVES}severities:\n  camera.bits: [8, 40, 12, 50]\n")
    for overrides in ([], ["severity=0"]):
        with pytest.raises(InputError) as caught:
            warnings(path, overrides)
        assert len(str(caught.value).splitlines()) == 2
