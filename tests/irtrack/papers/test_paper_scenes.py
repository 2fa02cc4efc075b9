"""Scenarios of the papers and hard ones: measured figures agree with the head of each file.

tests/validation checks all heads.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from scene_figures import check_head

import irsim
from irsim.scenario.catalog import shipped

SOURCES = shipped("sources")
HARD = {name: path for name, path in shipped("stress").items() if name.startswith("hard-")}
SIBLINGS = ("-mild", "-hard")
BASES = {name: path for name, path in {**SOURCES, **HARD}.items() if not name.endswith(SIBLINGS)}


@pytest.mark.parametrize("name", ["xue-ground", "hard-6x6"])
def test_scene_agrees_with_its_head(name: str) -> None:
    check_head(BASES[name])


def test_scenes_have_mild_and_hard_siblings() -> None:
    bases = SOURCES.keys() & BASES.keys()
    assert len(bases) == 8
    assert SOURCES.keys() == bases | {base + sibling for base in bases for sibling in SIBLINGS}
    for base in bases:
        own, *others = (irsim.load(f"sources/{name}") for name in (base, base + "-mild", base + "-hard"))
        for other in others:
            assert (other.frames, other.camera.size, other.follow) == (own.frames, own.camera.size, own.follow)


def test_siblings_are_ordered_by_signal_to_clutter_ratio() -> None:
    for base in SOURCES.keys() & BASES.keys():
        mild, own, hard = (_scr(SOURCES[base + end]) for end in ("-mild", "", "-hard"))
        assert mild > own > hard


def _scr(path: Path) -> float:
    found = re.search(r"SCR (-?[\d.]+)", path.read_text())
    assert found is not None
    return float(found.group(1))


@pytest.mark.parametrize("name", HARD)
def test_hard_target_turns_in_occlusion_of_12_frames(name: str) -> None:
    scenario = irsim.load(f"stress/{name}")
    truths = {truth.index: truth.target(scenario.follow or "") for truth in irsim.Rendering(scenario).truths(62, 92)}
    hidden = [index for index, target in truths.items() if target is not None and (target.visible or 0) < 0.02]
    assert hidden == list(range(hidden[0], hidden[0] + 12))
    before, after = truths[hidden[0]], truths[hidden[-1]]
    assert before is not None
    assert after is not None
    assert after.velocity != pytest.approx(before.velocity, abs=0.5)
    assert len(scenario.targets) == 4
