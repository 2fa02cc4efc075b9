"""The scenarios rebuilt from the sources, and the hard ones: each is what its head says."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from scene_figures import figures

import irsim
from irsim.scenario.catalog import shipped

NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
SOURCES = shipped("sources")
HARD = {name: path for name, path in shipped("stress").items() if name.startswith("hard-")}
SIBLINGS = ("-mild", "-hard")
BASES = {name: path for name, path in {**SOURCES, **HARD}.items() if not name.endswith(SIBLINGS)}


def check(path: Path) -> None:
    """The lines '#: ...' of a scenario's head agree with what is measured, within a tenth, or the last digit."""
    stated = [line[2:].strip() for line in path.read_text().splitlines() if line.startswith("#:")]
    measured = figures(irsim.load(path)).lines()
    assert [NUMBER.sub("", line) for line in stated] == [NUMBER.sub("", line) for line in measured]
    for said, found in zip(stated, measured, strict=True):
        numbers = [float(number) for number in NUMBER.findall(found)]
        assert [float(number) for number in NUMBER.findall(said)] == pytest.approx(numbers, rel=0.1, abs=0.06), path


@pytest.mark.sampled
@pytest.mark.parametrize("path", BASES.values(), ids=BASES.keys())
def test_a_scenario_is_what_its_head_states(path: Path) -> None:
    check(path)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(SOURCES.keys() - BASES.keys()))
def test_a_sibling_is_what_its_head_states(name: str) -> None:
    check(SOURCES[name])


def test_each_has_a_milder_and_a_harder_sibling_of_the_same_size_and_length() -> None:
    bases = SOURCES.keys() & BASES.keys()
    assert len(bases) == 8
    assert SOURCES.keys() == bases | {base + sibling for base in bases for sibling in SIBLINGS}
    for base in bases:
        own, *others = (irsim.load(f"sources/{name}") for name in (base, base + "-mild", base + "-hard"))
        for other in others:
            assert (other.frames, other.camera.size, other.follow) == (own.frames, own.camera.size, own.follow)


def test_siblings_differ_in_the_signal_to_clutter_ratio_as_their_names_say() -> None:
    for base in SOURCES.keys() & BASES.keys():
        mild, own, hard = (_scr(SOURCES[base + end]) for end in ("-mild", "", "-hard"))
        assert mild > own > hard


def _scr(path: Path) -> float:
    found = re.search(r"SCR (-?[\d.]+)", path.read_text())
    assert found is not None
    return float(found.group(1))


@pytest.mark.parametrize("name", HARD)
def test_a_hard_one_hides_its_target_for_twelve_frames_in_which_it_turns(name: str) -> None:
    scenario = irsim.load(f"stress/{name}")
    truths = {truth.index: truth.target(scenario.follow or "") for truth in irsim.Rendering(scenario).truths(62, 92)}
    hidden = [index for index, target in truths.items() if target is not None and (target.visible or 0) < 0.02]
    assert hidden == list(range(hidden[0], hidden[0] + 12))
    before, after = truths[hidden[0]], truths[hidden[-1]]
    assert before is not None
    assert after is not None
    assert after.velocity != pytest.approx(before.velocity, abs=0.5)
    assert len(scenario.targets) == 4
