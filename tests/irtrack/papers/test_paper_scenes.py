"""Scenarios of the papers and hard ones: siblings and events; tests/validation checks the heads."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import irsim
from irsim.scenario.catalog import shipped

SOURCES = shipped("sources")
SIBLINGS = ("-mild", "-hard")
BASES = {name: path for name, path in SOURCES.items() if not name.endswith(SIBLINGS)}


def test_scenes_have_mild_and_hard_siblings() -> None:
    bases = BASES.keys()
    assert len(bases) == 8
    assert SOURCES.keys() == bases | {base + sibling for base in bases for sibling in SIBLINGS}
    for base in bases:
        own, *others = (irsim.load(f"sources/{name}") for name in (base, base + "-mild", base + "-hard"))
        for other in others:
            assert (other.frames, other.camera.size, other.follow) == (own.frames, own.camera.size, own.follow)
        mild, middle, hard = (_scr(SOURCES[base + end]) for end in ("-mild", "", "-hard"))
        assert mild > middle > hard


def _scr(path: Path) -> float:
    found = re.search(r"SCR (-?[\d.]+)", path.read_text())
    assert found is not None
    return float(found.group(1))


def test_hard_target_turns_in_occlusion_of_12_frames() -> None:
    scenario = irsim.load("stress/hard-6x6")
    truths = {truth.index: truth.target(scenario.follow or "") for truth in irsim.Rendering(scenario).truths(62, 92)}
    hidden = [index for index, target in truths.items() if target is not None and (target.visible or 0) < 0.02]
    assert hidden == list(range(hidden[0], hidden[0] + 12))
    before, after = truths[hidden[0]], truths[hidden[-1]]
    assert before is not None
    assert after is not None
    assert after.velocity != pytest.approx(before.velocity, abs=0.5)
    assert len(scenario.targets) == 4
