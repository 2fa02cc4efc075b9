"""Ranges of values: distributions against scipy's, severities, and draws of a whole scenario."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scenario_text import TEXT, errors_of
from scipy import stats

import irsim
from irsim.errors import InputError
from irsim.scenario.loader import change, dumps, load, loads, values_of
from irsim.scenario.variation import VARIATIONS, Choice, Integers, LogUniform, Normal, Span, Uniform, Variation


@pytest.mark.parametrize(
    ("variation", "oracle"),
    [
        (Uniform(low=-2, high=6), stats.uniform(-2, 8)),
        (LogUniform(low=0.1, high=50), stats.loguniform(0.1, 50)),
        (Normal(mean=3, sd=2), stats.truncnorm(-4, 4, 3, 2)),
        (Normal(mean=3, sd=2, low=2, high=9), stats.truncnorm(-0.5, 3, 3, 2)),
    ],
)
def test_quantiles_are_those_of_scipy(variation: Variation, oracle: Any) -> None:
    shares = np.linspace(0, 1, 41)
    assert [variation.quantile(share) for share in shares] == pytest.approx(oracle.ppf(shares), rel=1e-9, abs=1e-9)


def test_integers_and_choices_are_uniform() -> None:
    shares = (np.arange(600) + 0.5) / 600
    for variation, values in (
        (Integers(low=-1, high=4), [-1, 0, 1, 2, 3, 4]),
        (Choice(values=("a", None, [1, 2])), ["a", None, [1, 2]]),
    ):
        drawn = [variation.quantile(float(share)) for share in shares]
        assert [drawn.count(value) for value in values] == [600 // len(values)] * len(values)
        assert variation.quantile(0) == values[0]
        assert variation.quantile(1) == values[-1]


SOME: dict[str, Variation] = {
    "uniform": Uniform(low=1, high=3),
    "loguniform": LogUniform(low=1, high=3),
    "normal": Normal(mean=2, sd=0.25),
    "integers": Integers(low=1, high=11),
    "choice": Choice(values=(4.0, 1.0, 2.5)),
}


@pytest.mark.parametrize("word", VARIATIONS.kinds)
def test_severities_go_from_benign_to_an_end(word: str) -> None:
    """Contract of every kind, with the benign value at an end, inside, and outside of the range."""
    variation = SOME[word]
    for benign in (0.5, 1, 2, 3, 20):
        severities = variation.severities(benign)
        assert 0 in severities
        assert variation.at_severity(0, benign) == benign
        values = {severity: variation.at_severity(severity, benign) for severity in severities}
        if isinstance(variation, Span):
            low, high = variation.ends
            assert values[severities[-1]] == (low if benign >= high else high)
            assert values[severities[0]] == (low if low < benign < high else benign)
            for side in (1, -1):
                away = [abs(values[s] - benign) for s in severities if s * side >= 0][::side]
                assert away == sorted(away)
        else:
            assert set(values.values()) == {*SOME[word].probes().values(), benign}


def test_severities_of_a_log_range_are_equal_factors() -> None:
    found = [LogUniform(low=2, high=64).at_severity(severity, 2) for severity in range(6)]
    assert found == pytest.approx([2, 4, 8, 16, 32, 64])


VARIED = (
    TEXT
    + """\
vary:
  targets.jet.path.speed: {kind: uniform, low: 1, high: 4}
  camera.netd_mk: {kind: loguniform, low: 20, high: 200, benign: 20, nuisance: true}
  frames: {kind: integers, low: 5, high: 12}
  targets.far.shape: {kind: choice, values: [{kind: point}, {kind: bird}]}
"""
)


def test_draws_fill_their_ranges_and_repeat() -> None:
    scenario = loads(VARIED)
    assert scenario.hash == loads(TEXT).hash  # ranges change no pixel
    drawn = irsim.sample(scenario, 60, seed=5)
    assert irsim.sample(scenario, 3, seed=5) == drawn[:3]
    assert irsim.sample(scenario, 2, seed=5, start=40) == drawn[40:42]
    assert irsim.sample(scenario, 1, seed=6) != drawn[:1]
    assert len({each.seed for each in drawn}) == 60
    assert not any(each.vary for each in drawn)
    speeds = [values_of(each, ["targets.jet.path.speed"])["targets.jet.path.speed"] for each in drawn]
    assert stats.kstest(speeds, stats.uniform(1, 3).cdf).pvalue > 0.01
    netds = [math.log10(each.camera.netd_mk) for each in drawn]
    assert stats.kstest(netds, stats.uniform(math.log10(20), 1).cdf).pvalue > 0.01
    assert abs(stats.pearsonr(speeds, netds).statistic) < 0.33  # 99 % of independent ones
    assert {each.frames for each in drawn} == set(range(5, 13))
    assert {each.targets[1].shape.kind for each in drawn} == {"point", "bird"}


def test_nuisances_follow_the_seed() -> None:
    space = irsim.variations(loads(VARIED))
    assert [knob.key for knob in space.knobs] == ["targets.jet.path.speed", "frames", "targets.far.shape"]
    assert space.benign()["targets.jet.path.speed"] == 2
    assert space.at([0, 1, 0]) == {
        "targets.jet.path.speed": 1,
        "frames": 12,
        "targets.far.shape": {"kind": "point"},
    }
    assert space.at_severities([0, 0, 0]) == space.benign()
    assert space.at_severities([-5, 5, 1])["targets.jet.path.speed"] == 1
    first, again, other = (space.concrete(space.at([0.5] * 3), seed) for seed in (3, 3, 4))
    assert first == again
    assert first.seed == 3
    assert first.camera.netd_mk != other.camera.netd_mk
    assert change(first, {"seed": 4, "camera.netd_mk": other.camera.netd_mk}) == other
    assert space.concrete({"camera.netd_mk": 33}, 1).camera.netd_mk == 33


def test_wrong_points_are_errors() -> None:
    space = irsim.variations(loads(VARIED))
    cases: list[tuple[Callable[[], object], str]] = [
        (lambda: space.at([0.5]), "1 coordinate; allowed: 3, for targets.jet.path.speed, frames,"),
        (lambda: space.at([0.5, 0.5, math.nan]), "no place in the unit cube"),
        (lambda: space.at_severities([6, 0, 0]), "there is no severity 6; allowed: -5 to 5"),
        (lambda: space.concrete({"camera.bits": 9}), "there is no 'camera.bits'; allowed: targets.jet"),
        (lambda: irsim.sample(loads(TEXT), 1), "nothing varies in this scenario"),
    ]
    for wrong, message in cases:
        with pytest.raises(InputError, match=message):
            wrong()


@pytest.mark.parametrize(
    ("entry", "line"),
    [
        ("camra.bits: {kind: integers, low: 1, high: 2}", "f.yaml:27:3: vary.camra.bits: unknown key 'camra'; allowed"),
        ("camera.bits: {kind: unifrm, low: 1, high: 2}", "f.yaml:27:23: vary.camera.bits.kind: unknown variation kind"),
        ("camera.bits: {kind: choice}", "f.yaml:27:16: vary.camera.bits.values: it is missing; allowed: a list"),
        ("camera.bits: {kind: integers, low: 10, high: 20}", "f.yaml:27:48: vary.camera.bits.high: with 20: camera."),
        ("camera.bits: {kind: uniform, low: 8, high: 10}", "f.yaml:27:23: vary.camera.bits.kind: with 8.62832: camera"),
        ("camera.bits: {kind: choice, values: [8, 99]}", "f.yaml:27:43: vary.camera.bits.values.1: with 99: camera."),
        ("camera.bits: {kind: choice, values: [8], benign: 99}", "f.yaml:27:52: vary.camera.bits.benign: with 99: cam"),
        ("camera.netd_mk: {kind: uniform, low: 9, high: 2}", "f.yaml:27:40: vary.camera.netd_mk.low: 9 is not below 2"),
        ("camera.netd_mk: {kind: normal, mean: 1, sd: 1, low: 20, high: 22}", "f.yaml:27:40: vary.camera.netd_mk.mea"),
        ("seed: {kind: integers, low: 1, high: 2}", "f.yaml:27:3: vary.seed: 'seed' cannot vary; allowed: keys"),
        (
            "targets.jet.path: {kind: uniform, low: 1, high: 2}",
            "f.yaml:27:21: vary.targets.jet.path: the scenario has ",
        ),
    ],
)
def test_a_wrong_range_is_an_error_at_its_place(entry: str, line: str) -> None:
    (found,) = errors_of(f"{TEXT}vary:\n  {entry}\n")
    assert found.startswith(line)


def test_overrides_end_and_change_a_variation() -> None:
    scenario = loads(VARIED, overrides=["targets.jet.path={kind: straight, start: [1, 2]}", "frames=9"])
    assert list(scenario.vary) == ["camera.netd_mk", "targets.far.shape"]
    changed = loads(
        VARIED, overrides=["vary.targets.jet.path.speed.high=9", "vary.camera.bits={kind: integers, low: 8, high: 9}"]
    )
    assert changed.vary["targets.jet.path.speed"] == Uniform(low=1, high=9)
    assert changed.vary["camera.bits"] == Integers(low=8, high=9)


LEVELS = TEXT + "severities:\n  camera.netd_mk: [10, 40, 90]\n  camera.size.0: [64, 80, 96]\n"


def test_a_severity_puts_its_values_in_place() -> None:
    for severity, (netd, width) in enumerate([(10, 64), (40, 80), (90, 96)]):
        scenario = loads(LEVELS, overrides=[f"severity={severity}"])
        assert (scenario.camera.netd_mk, scenario.camera.size) == (netd, (width, 48))
        plain = loads(TEXT, overrides=[f"camera.netd_mk={netd}", f"camera.size.0={width}"])
        assert scenario.hash == plain.hash
        assert loads(dumps(scenario)) == loads(dumps(scenario, short=True)) == scenario
        assert change(scenario, {"severity": 1}) == loads(LEVELS, overrides=["severity=1"]) or severity != 1
    assert loads(LEVELS).camera.netd_mk == 10


def test_an_override_holds_at_every_severity() -> None:
    scenario = loads(LEVELS, overrides=["camera.netd_mk=55", "severity=2"])
    assert (scenario.camera.netd_mk, scenario.camera.size[0]) == (55, 96)
    again = loads(dumps(scenario), overrides=["severity=1"])
    assert (again.camera.netd_mk, again.camera.size[0]) == (55, 80)
    for text in (LEVELS, loads(LEVELS, overrides=["severity=1"])):
        given = {"camera.netd_mk": 55, "camera.size": [96, 48], "severity": 2}
        if isinstance(text, str):
            by_hand = loads(text, overrides=[f"{key}={value}" for key, value in given.items()])
        else:
            by_hand = change(text, given)
        assert (by_hand.camera.netd_mk, by_hand.camera.size) == (55, (96, 48))
        assert (by_hand.severity, by_hand.severities) == (0, {})
    (line,) = errors_of(LEVELS, "camera.netd_mk=55", "camera.size=[96, 48]", "severity=3")
    assert line.startswith("override severity: 3 is out of range")


def test_a_part_varies_and_its_key_has_severities() -> None:
    """A drawn part keeps its own value of the key; otherwise the severity sets it."""
    paths = [{"kind": "straight", "start": [9, 9], "speed": speed} for speed in (5, 7)]
    text = (
        f"{TEXT}severities:\n  targets.jet.path.speed: [1, 2, 3]\n"
        f"vary:\n  targets.jet.path: {{kind: choice, values: {json.dumps(paths)}}}\n"
    )
    for severity in range(3):
        scenario = loads(text, overrides=[f"severity={severity}"])
        assert values_of(scenario, ["targets.jet.path.speed"]) == {"targets.jet.path.speed": severity + 1}
        benign = irsim.variations(scenario).benign()
        assert values_of(change(scenario, benign), ["targets.jet.path.speed"]) == {
            "targets.jet.path.speed": severity + 1
        }
        drawn = [values_of(each, ["targets.jet.path.speed"]) for each in irsim.sample(scenario, 8)]
        assert {each["targets.jet.path.speed"] for each in drawn} == {5, 7}


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("[10, 40, 90]", "[10, 40]", "f.yaml:28:18: severities.camera.size.0: 3 values where another key has 2; "),
        ("[10, 40, 90]", "[10]", "f.yaml:27:19: severities.camera.netd_mk: too few items; allowed: a list, "),
        ("[10, 40, 90]", "7", "f.yaml:27:19: severities.camera.netd_mk: expected a list, not 7; "),
        ("[10, 40, 90]", "[-3, 40, 90]", "f.yaml:27:20: camera.netd_mk: -3 is out of range; "),
        ("camera.netd_mk: [", "camera.netd: [", "f.yaml:27:3: severities.camera.netd: unknown key 'netd'; "),
        ("camera.netd_mk: [", "severity: [", "f.yaml:27:3: severities.severity: 'severity' cannot vary"),
        ("severities:", "severity: 3\nseverities:", "f.yaml:26:11: severity: 3 is out of range; allowed: 0 to 2"),
        ("severities:", "severity: -1\nseverities:", "f.yaml:26:11: severity: -1 is out of range; "),
    ],
)
def test_a_wrong_severity_is_an_error_at_its_place(old: str, new: str, line: str) -> None:
    (found,) = errors_of(LEVELS.replace(old, new))
    assert found.startswith(line)


def test_no_severities_is_severity_0() -> None:
    (line,) = errors_of(TEXT, "severity=1")
    assert line == "override severity: 1 is out of range; allowed: 0, as there are no severities"


@pytest.mark.parametrize("name", ["sky", "sea", "drones", "countryside", "correction"])
def test_the_short_text_of_an_example_is_equal(name: str) -> None:
    scenario = load(name)
    short = dumps(scenario, short=True)
    assert loads(short) == scenario
    assert len(short) < 0.7 * len(dumps(scenario))


@pytest.mark.parametrize("preset", ["cooled_lwir", "uncooled_lwir"])
def test_a_short_preset_camera_follows_the_preset(preset: str) -> None:
    """Values of the preset are left out, so that another preset sets its own."""
    text = f"camera: {{preset: {preset}, netd_mk: 33.3}}\nbackground: {{kind: sky}}"
    scenario = loads(text)
    assert loads(dumps(scenario, short=True)) == scenario
    assert change(scenario, {"camera.preset": "ideal"}) == loads(text.replace(preset, "ideal"))


def test_expectations_are_read_and_their_targets_exist() -> None:
    text = TEXT + "expect:\n  - {kind: error_below, px: 3, share: 0.95}\n  - {kind: never_lost, target: far}\n"
    assert [rule.kind for rule in loads(text).expect] == ["error_below", "never_lost"]
    assert loads(text).hash == loads(TEXT).hash
    (line,) = errors_of(text.replace("target: far", "target: fat"))
    assert line.startswith("f.yaml:28:32: expect.1.target: there is no 'fat'; allowed: jet, far")
