"""Strategies for scenes: all that they draw loads, shrinks to the benign, and renders; all that is broken is told."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, find, given, settings
from hypothesis import strategies as st
from recording_fakes import Noise, same_frames

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
SOON_OR_NIGHTLY = pytest.mark.parametrize(
    "profile",
    [
        pytest.param(settings(STEADY, max_examples=20), id="ci"),
        pytest.param(settings(STEADY, max_examples=3000), id="nightly", marks=pytest.mark.slow),
    ],
)


@given(strategies.scenarios())
@settings(STEADY, max_examples=8)
def test_every_scenario_loads_survives_its_text_and_renders(scenario: Scenario) -> None:
    assert loads(dumps(scenario)) == loads(dumps(scenario, short=True)) == scenario
    frame, truth = next(iter(frames(scenario)))
    assert frame.image.shape == (72, 96)
    assert truth.target("target") is not None


ANY_COUNTRY = strategies.scenarios(
    background=st.one_of(strategies.skies(), strategies.clutters(), strategies.countries()),
    noise=strategies.cameras(),
)


@SOON_OR_NIGHTLY
def test_short_texts_and_changes_keep_defaults(profile: settings) -> None:
    def kept(scenario: Scenario) -> None:
        short = loads(dumps(scenario, short=True))
        assert short == scenario
        assert short.hash == scenario.hash
        assert change(scenario, {"seed": scenario.seed}) == scenario

    over(ANY_COUNTRY, kept, profile)


def test_what_it_shrinks_to_is_benign() -> None:
    tree = find(strategies.documents(), lambda tree: True, settings=STEADY)
    assert tree["seed"] == 0
    assert tree["occluders"] == tree["camera"]["motion"] == tree["camera"]["faults"] == []
    assert tree["camera"]["netd_mk"] == 20.0
    assert [target["id"] for target in tree["targets"]] == ["target"]
    assert tree["targets"][0]["path"]["speed"] == 0.0
    assert "clouds" not in tree["background"]


def test_what_it_shrinks_to_is_the_least_that_still_fails() -> None:
    """A failure that needs noise of at least severity 3 and any hiding is found with just these."""

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


@pytest.mark.parametrize(("strategy", "how_hard"), [row[1:] for row in LADDERS], ids=[row[0] for row in LADDERS])
def test_each_severity_is_harder_than_the_one_before(strategy: Any, how_hard: Any) -> None:
    steps = [how_hard(find(strategy(st.just(step)), lambda part: True, settings=STEADY)) for step in range(6)]
    assert steps == sorted(set(steps))


def broken_text_is_told(broken: tuple[str, str]) -> None:
    what, text = broken
    with pytest.raises(InputError) as caught:
        loads(text)
    assert all(line.strip() for line in str(caught.value).split("\n")), what


def mutated_text_is_told_or_a_scenario(text: str) -> None:
    try:
        scenario = loads(text)
    except InputError as error:
        assert all(line.strip() for line in str(error).split("\n"))  # noqa: PT017 - an error may come, and need not
    else:
        assert loads(dumps(scenario)) == scenario


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(Noise(), tmp_path_factory.mktemp("rec") / "noise.mcap")


def damage_is_told_or_changes_nothing(data: bytes, path: Path) -> None:
    path.write_bytes(data)
    for read in (open_recording, lambda path: open_recording(recover(path, path.with_name("recovered.mcap")))):
        try:
            recording = read(path)
            seen, truths = list(recording.frames()), list(recording.truths())
        except InputError as error:
            assert "\n" not in str(error)  # noqa: PT017 - an error may come, and need not
            assert str(error).strip()  # noqa: PT017 - an error may come, and need not
        else:
            if read is open_recording:
                assert same_frames(iter(seen), Noise().frames())
                assert truths == list(Noise().truths())
            else:
                known = {frame.image.tobytes() for frame in Noise().frames()}
                assert all(frame.image.tobytes() in known for frame in seen)


def over(strategy: st.SearchStrategy[Any], check: Callable[[Any], None], profile: settings) -> None:
    """The check over what a strategy draws."""

    @given(strategy)
    @profile
    def run(drawn: Any) -> None:
        check(drawn)

    run()


@SOON_OR_NIGHTLY
def test_broken_texts_are_told(profile: settings) -> None:
    over(strategies.invalid_texts(), broken_text_is_told, profile)


@SOON_OR_NIGHTLY
def test_mutated_texts_are_told_or_scenarios(profile: settings) -> None:
    over(strategies.mutated_texts(), mutated_text_is_told_or_a_scenario, profile)


@SOON_OR_NIGHTLY
def test_damaged_recordings_are_told(profile: settings, recorded: Path, tmp_path: Path) -> None:
    strategy = strategies.damaged_recordings(recorded.read_bytes())
    over(strategy, lambda data: damage_is_told_or_changes_nothing(data, tmp_path / "damaged.mcap"), profile)
