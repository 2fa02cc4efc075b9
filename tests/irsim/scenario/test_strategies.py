"""Strategies for scenes: drawn scenes load, shrink to the benign and render; broken texts and files are errors."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, find, given, settings
from hypothesis import strategies as st
from recording_fakes import Noise

from irsim import frames, strategies
from irsim.errors import InputError
from irsim.recording import open_recording, record, recover
from irsim.scenario.loader import change, dumps, loads
from irsim.scenario.model import Scenario
from irsim.strategies import scenes

STEADY = settings(
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.function_scoped_fixture],
)
FEW = settings(STEADY, max_examples=12)


@given(strategies.scenarios())
@settings(STEADY, max_examples=4)
def test_scenarios_load_survive_their_text_and_render(scenario: Scenario) -> None:
    assert loads(dumps(scenario)) == loads(dumps(scenario, short=True)) == scenario
    frame, truth = next(iter(frames(scenario)))
    assert frame.image.shape == (72, 96)
    assert truth.target("target") is not None


ANY_COUNTRY = strategies.scenarios(
    background=st.one_of(strategies.skies(), strategies.clutters(), strategies.countries()),
    noise=strategies.cameras(),
)


@given(ANY_COUNTRY)
@FEW
def test_short_texts_and_changes_keep_defaults(scenario: Scenario) -> None:
    short = loads(dumps(scenario, short=True))
    assert short == scenario
    assert short.hash == scenario.hash
    assert change(scenario, {"seed": scenario.seed}) == scenario


def test_documents_shrink_to_the_benign_scene() -> None:
    tree = find(strategies.documents(), lambda tree: True, settings=STEADY)
    assert tree["seed"] == 0
    assert tree["occluders"] == tree["camera"]["motion"] == tree["camera"]["faults"] == []
    assert tree["camera"]["netd_mk"] == 20.0
    assert [target["id"] for target in tree["targets"]] == ["target"]
    assert tree["targets"][0]["path"]["speed"] == 0.0
    assert "clouds" not in tree["background"]


def test_documents_shrink_to_the_least_that_fails() -> None:
    """Where a failure takes noise of severity 3 and any occlusion, nothing else is left."""

    def fails(tree: dict[str, Any]) -> bool:
        return tree["camera"]["netd_mk"] >= scenes.NETD_MK[3] and bool(tree["occluders"])

    tree = find(strategies.documents(), fails, settings=settings(STEADY, max_examples=2000))
    assert tree["camera"]["netd_mk"] == scenes.NETD_MK[3]
    assert tree["occluders"][0]["fraction"] == scenes.HIDING[1][0]
    assert tree["targets"][0]["path"]["speed"] == 0.0
    assert len(tree["targets"]) == 1
    assert tree["camera"]["faults"] == []


LADDERS: list[tuple[str, Callable[[st.SearchStrategy[int]], st.SearchStrategy[Any]], Callable[[Any], float]]] = [
    ("straights", lambda s: strategies.straights(speed=s), lambda part: part["speed"]),
    ("weaves", lambda s: strategies.weaves(amplitude=s), lambda part: part["amplitude_px"]),
    ("manoeuvres", lambda s: strategies.manoeuvres(turn=s), lambda part: part["turn_deg"]),
    ("noises", lambda s: strategies.noises(s), lambda part: part["netd_mk"]),
    ("clutters", lambda s: strategies.clutters(s), lambda part: part.get("clutter", {}).get("per_mrad2", 0)),
    ("skies", lambda s: strategies.skies(s), lambda part: part.get("clouds", [{"coverage": 0}])[0]["coverage"]),
    (
        "occlusions",
        lambda s: strategies.occlusions(severity=s),
        lambda part: sum(each["fraction"] * (each["frames"][1] - each["frames"][0] + 1) for each in part),
    ),
    ("faults", lambda s: strategies.frame_faults(s), lambda part: sum(each["rate"] for each in part)),
    ("motions", lambda s: strategies.camera_motions(s), lambda part: sum(each["rms_px"] for each in part)),
    (
        "crossings",
        lambda s: strategies.crossings(severity=s),
        lambda part: sum(91 - each["path"]["angle_deg"] for each in part),
    ),
    (
        "decoys",
        lambda s: strategies.decoys({"start": [48, 36], "heading_deg": 0.0}, severity=s),
        lambda part: sum(100 - np.hypot(*np.subtract(each["path"]["start"], (48, 36))) for each in part),
    ),
]


@pytest.mark.parametrize(("strategy", "difficulty"), [row[1:] for row in LADDERS], ids=[row[0] for row in LADDERS])
def test_severities_rise_in_difficulty(strategy: Any, difficulty: Any) -> None:
    once = settings(STEADY, max_examples=1)
    steps = [difficulty(find(strategy(st.just(step)), lambda part: True, settings=once)) for step in range(6)]
    assert steps == sorted(set(steps))


@given(strategies.invalid_texts())
@FEW
def test_broken_texts_are_errors(broken: tuple[str, str]) -> None:
    fault, text = broken
    with pytest.raises(InputError) as caught:
        loads(text)
    assert all(line.strip() for line in str(caught.value).split("\n")), fault


@given(strategies.mutated_texts())
@FEW
def test_mutated_texts_are_errors_or_scenarios(text: str) -> None:
    try:
        scenario = loads(text)
    except InputError as error:
        assert all(line.strip() for line in str(error).split("\n"))  # noqa: PT017 - an error is one of two results
    else:
        assert loads(dumps(scenario)) == scenario


def test_damaged_recordings_are_errors_or_unchanged(tmp_path: Path) -> None:
    whole = record(Noise(), tmp_path / "noise.mcap").read_bytes()
    known, truths = [frame.image.tobytes() for frame in Noise().frames()], list(Noise().truths())
    path, recovered = tmp_path / "damaged.mcap", tmp_path / "recovered.mcap"

    @given(strategies.damaged_recordings(whole))
    @settings(STEADY, max_examples=40)
    def check(data: bytes) -> None:
        path.write_bytes(data)
        for salvage in (False, True):
            try:
                recording = open_recording(recover(path, recovered) if salvage else path)
                images = [frame.image.tobytes() for frame in recording.frames()]
                read = list(recording.truths())
            except InputError as error:
                assert str(error).strip()  # noqa: PT017 - an error is one of two results
                assert "\n" not in str(error)  # noqa: PT017 - an error is one of two results
            else:
                assert set(images) <= set(known) if salvage else (images, read) == (known, truths)

    check()
