"""Each property is broken by a planted tracker that breaks no other; sound trackers break none."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from command_line import Call
from planted import PLANTED
from sound_tracker import Constant, Dies, Forks, Hangs, Killed, KilledBefore, Raises, Sound

import irsim
from irtrack.detectors import DETECTORS
from irtrack.errors import InputError
from irtrack.properties import EXCEPTIONS, PROPERTIES, PROPERTIES_OF, check, check_tracker
from irtrack.registry.table import ALL_KINDS


def broken(tracker: Any, *only: str) -> set[str]:
    outcomes = check(tracker, only=only or None)
    return {outcome.property.name for outcome in outcomes if outcome.verdict == "broken"}


def test_each_property_has_a_planted_breaker() -> None:
    assert list(PLANTED) == list(PROPERTIES)
    assert len(PROPERTIES) >= 25
    assert all(each.says.endswith(".") for each in PROPERTIES.values())
    assert all(need in list(PROPERTIES)[:k] for k, each in enumerate(PROPERTIES.values()) for need in each.needs)


@pytest.mark.slow
def test_sound_tracker_has_all_properties() -> None:
    assert {outcome.property.name: outcome.verdict for outcome in check(Sound())} == dict.fromkeys(PROPERTIES, "holds")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name == "elsewhere" else name for name in PROPERTIES]
)
def test_planted_tracker_breaks_its_property(name: str) -> None:
    (outcome,) = check(PLANTED[name](), only=[name])
    assert outcome.verdict == "broken"
    assert outcome.why


TRACKING = {"follows", "start_place", "start_size", "duplicates", "drops", "reacquires", "says_hidden", "says_gone"}


def test_constant_box_breaks_the_tracking_properties() -> None:
    assert broken(Constant(), *TRACKING, "says_empty") == {*TRACKING, "says_empty"}


def test_exceptions_name_trackers_and_properties() -> None:
    assert set(EXCEPTIONS) <= set(ALL_KINDS)
    for name, reasons in EXCEPTIONS.items():
        assert set(reasons) <= set(PROPERTIES_OF["detect" if name in DETECTORS else "single"])
        assert all(reason.strip() for reason in reasons.values())


def test_failing_example_is_the_mildest_scene() -> None:
    (outcome,) = check(PLANTED["offset"](), only=["offset"])
    assert outcome.drawn["by"] == 5  # the background of 51 greys with noise exceeds 55
    assert outcome.scenario is not None
    assert irsim.loads(outcome.scenario).seed == 0


def test_exception_breaks_the_property() -> None:
    (outcome,) = check(Raises(), only=["follows"])
    assert (outcome.verdict, outcome.why) == ("broken", "raises ZeroDivisionError: division by zero")


DIED = "frame 4: the process died 2 times while the tracker was at work (exit status 3)"


def test_hang_or_crash_breaks_the_property() -> None:
    hung = check(Hangs(), only=["gentle", "rests"], frame_limit_s=1.0)
    assert [(each.verdict, each.why) for each in hung] == [
        ("broken", "frame 4: hangs: more than 1 s in the tracker")
    ] * 2
    (dead,) = check(Dies(), only=["gentle"], frame_limit_s=60.0)
    assert (dead.verdict, dead.why) == ("broken", DIED)


def test_a_tracker_that_forks_is_checked_once() -> None:
    assert [each.verdict for each in check(Forks(), only=["gentle"], frame_limit_s=30.0)] == ["holds"]


@pytest.mark.slow
def test_worker_killed_once_breaks_nothing(tmp_path: Path) -> None:
    """Killed while the tracker works, and before."""
    at_work, before = tmp_path / "at work", tmp_path / "before"
    assert [each.verdict for each in check(Killed(str(at_work)), only=["gentle"], frame_limit_s=60.0)] == ["holds"]
    assert [each.verdict for each in check(KilledBefore(str(before)), only=["gentle"], frame_limit_s=60.0)] == ["holds"]
    assert at_work.exists()
    assert before.exists()


@pytest.mark.slow
def test_worker_process_changes_no_verdict() -> None:
    names = ["elsewhere", "resumes", "flip"]
    assert [outcome.verdict for outcome in check(Sound(), only=names, frame_limit_s=60.0)] == ["holds"] * 3
    here, there = (check(PLANTED["flip"](), only=["flip"], frame_limit_s=limit) for limit in (None, 60.0))
    assert here == there
    assert here[0].verdict == "broken"

    class Local(Sound):
        pass

    with pytest.raises(InputError, match="cannot be sent to a worker process: "):
        check(Local(), only=["gentle"], frame_limit_s=60.0)


def test_needs_are_tested_and_reported_where_broken() -> None:
    """In the order of the table, for any order of `only`."""
    outcomes = check(PLANTED["deterministic"](), only=["pure", "causal", "pure"])
    assert [(each.property.name, each.verdict) for each in outcomes] == [
        ("deterministic", "broken"),
        ("causal", "not judged"),
        ("pure", "not judged"),
    ]
    assert {each.why for each in outcomes[1:]} == {"needs deterministic"}
    assert [each.property.name for each in check(Sound(), only=["flip", "causal"])] == ["causal", "flip"]
    with pytest.raises(AssertionError, match="deterministic: "):
        check_tracker(PLANTED["deterministic"](), only=["causal"])
    check_tracker(PLANTED["deterministic"](), only=["causal"], excused={"deterministic": "it is random"})


class Simple:
    """Plain tracker around the sound one."""

    def start(self, frame: Any, box: irsim.Box) -> None:
        self.tracker, self.k = Sound(), 0
        self.state = self.tracker.init(irsim.Frame(frame, 0, 0.0, 8), box, None)  # type: ignore[arg-type]  # it draws nothing

    def step(self, frame: Any) -> Any:
        self.k += 1
        self.state, estimate = self.tracker.step(self.state, irsim.Frame(frame, self.k, self.k / 30, 8), None)  # type: ignore[arg-type]  # it draws nothing
        return estimate.box if estimate.status == "tracking" else None


def test_plain_trackers_are_checked() -> None:
    names = ["deterministic", "elsewhere", "resumes", "gentle", "shift", "velocity", "says_hidden"]
    verdicts = [outcome.verdict for outcome in check(Simple, only=names)]
    assert verdicts == ["holds", "holds", "not asked", "holds", "holds", "not asked", "holds"]


def test_check_tracker_raises_assertion_error() -> None:
    check_tracker(Sound(), only=["deterministic", "flip"])
    with pytest.raises(AssertionError, match=r"(?s)1 of 2 properties is broken\nflip: A mirrored picture.*off by"):
        check_tracker(PLANTED["flip"](), only=["deterministic", "flip"])
    check_tracker(PLANTED["flip"](), only=["flip"], excused={"flip": "it leans"})
    with pytest.raises(InputError, match=r"unknown property 'flop'; .*did you mean 'flip'\?"):
        check_tracker(Sound(), excused={"flop": "?"})


@pytest.fixture
def call(bare_call: Call) -> Call:
    return lambda *words: bare_call("check", *words)


def test_command_prints_verdicts_and_repeat_command(call: Call, tmp_path: Path) -> None:
    status, out, _ = call("planted_following:Lags", "--only", "gentle,follows", "-o", "failures")
    assert status == 1
    assert "gentle    holds    Frames are read and not changed." in out
    assert "follows: from the target: off by" in out
    assert "repeat: irtrack check planted_following:Lags --only follows" in out
    assert "1 holds, 1 broken" in out
    scenario = irsim.load(tmp_path / "failures" / "follows.yaml")
    assert scenario.follow == "target"
    assert [path.name for path in tmp_path.iterdir()] == ["failures"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["kalman", "--only", "flop"], "unknown property 'flop'; allowed: legal, "),
        (["kalmann"], "did you mean 'kalman'?"),
        (["kalman", "--profile", "daily"], "--profile daily: allowed: ci or nightly"),
    ],
)
def test_bad_input_is_one_line(call: Call, words: list[str], said: str) -> None:
    status, out, err = call(*words)
    assert (status, out) == (2, "")
    assert said in err
    assert len(err.splitlines()) == 1
