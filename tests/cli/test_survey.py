"""What is said of each target over all frames: figures by hand."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

import irsim
from irsim.cli.app import app
from irsim.cli.truth_summary import Spell, survey
from irsim.errors import decimal_text
from irsim.types import Box, TargetTruth, Truth

SIZE = (64, 48)


def seen(visible: float | None = 1.0, scr: float | None = None, **rest: object) -> TargetTruth:
    return replace(TargetTruth("jet", (20.0, 20.0), Box(20, 20, 8, 4), visible=visible, scr=scr), **rest)  # type: ignore[arg-type]  # fields of any type


def test_spells_are_runs_of_frames_with_whoever_hid_it() -> None:
    rows = [seen(), seen(0.2, occluders=("tree",)), seen(0.0, occluders=("tree", "house")), seen(0.5), None, seen(0.1)]
    (jet,) = survey((Truth(k, k / 30, (row,) if row else ()) for k, row in enumerate(rows)), SIZE)
    assert jet.hidden == (Spell(1, 2, ("tree", "house")), Spell(5, 5))
    assert jet.absent == (Spell(4, 4),)
    assert jet.crossing == ()
    assert (jet.frames, jet.first, jet.size) == (5, 0, (8.0, 4.0))


def test_what_has_left_the_picture_is_out_of_view_and_not_hidden() -> None:
    rows = [seen(0.0, in_view=False), seen(0.3, in_view=False, occluders=("tree",)), seen(0.2, in_view=True), seen()]
    (jet,) = survey((Truth(k, k / 30, (row,)) for k, row in enumerate(rows)), SIZE)
    assert jet.outside == (Spell(0, 1),)
    assert jet.hidden == (Spell(2, 2),)


def test_what_the_pictures_corner_cuts_is_partly_out_of_view_and_not_hidden() -> None:
    """But hidden where something hides it, and where all of it lies in the picture."""
    corner, edge = Box(2, 1, 8, 4), Box(61, 20, 8, 4)
    rows = [seen(0.4, box=corner), seen(0.45, box=edge), seen(0.3, box=corner, occluders=("tree",)), seen(0.3)]
    (jet,) = survey((Truth(k, k / 30, (row,)) for k, row in enumerate(rows)), SIZE)
    assert jet.cut == (Spell(0, 1),)
    assert jet.hidden == (Spell(2, 3, ("tree",)),)
    assert jet.outside == ()


CORNERED = """
frames: 3
camera: {size: [80, 60], netd_mk: 0}
background: {kind: ground, spread_k: 0}
targets: [{id: jet, shape: {kind: fighter}, path: {kind: straight, start: [8, 2], speed: 0, range_m: 500}}]
"""


HIDDEN = """
frames: 8
camera: {size: [80, 60], netd_mk: 0}
background: {kind: ground, spread_k: 0}
targets: [{id: jet, shape: {kind: point}, path: {kind: straight, start: [9, 30], speed: 4, range_m: 500}}]
occluders: [{kind: bar, range_m: 100, center_px: [24, 30], size_px: [8, 20]}]
"""


def test_a_rendered_target_in_the_corner_is_said_to_be_cut() -> None:
    source = irsim.Rendering(irsim.loads(CORNERED))
    (jet,) = survey(source.truths(), source.size)
    assert jet.cut == (Spell(0, 2),)
    assert jet.hidden == jet.outside == ()


def test_ratios_are_of_frames_in_which_it_is_seen_and_speeds_are_medians() -> None:
    rows = [seen(scr=float(k), velocity=(3.0 * k, 4.0 * k)) for k in range(21)] + [seen(0.0, 1000.0)]
    (jet,) = survey((Truth(k, k / 30, (row,)) for k, row in enumerate(rows)), SIZE)
    assert jet.scr == pytest.approx((1, 10, 19))
    assert jet.speed == pytest.approx(50)


def test_what_truth_does_not_know_is_none() -> None:
    (jet,) = survey([Truth(0, 0.0, (seen(None),))], SIZE)
    assert (jet.scr, jet.speed, jet.hidden) == (None, None, ())


def test_an_intent_is_found_again() -> None:
    """The house of `hiding` is to hide the car from frame 66 to 78."""
    source = irsim.Rendering(irsim.load("hiding"))
    car = next(target for target in survey(source.truths(), source.size) if target.id == "car")
    (house,) = [spell for spell in car.hidden if "building" in spell.by]
    assert house.first <= 66
    assert house.last >= 78


def test_info_prints_plain_numbers(tmp_path: Path) -> None:
    """Of three frames 1000 s apart in which a hot point stands out by hundreds of sigmas, not 3e+03 s and 6e+02."""
    path = tmp_path / "scene.yaml"
    path.write_text(CORNERED.replace("netd_mk: 0", "rate_hz: 0.001, netd_mk: 20").replace("fighter", "point"))
    done = CliRunner().invoke(app, ["info", str(path)])
    assert done.exit_code == 0, done.output
    assert "frames     3 at 0.001 Hz, 3000 s" in done.stdout.splitlines()
    ratio = re.search(r"SCR (\d+) \((\d+) to (\d+)\)", done.stdout)
    assert ratio is not None, done.stdout
    assert int(ratio[1]) >= 100


def test_info_says_how_much_is_hidden_in_the_frames_that_it_counts(tmp_path: Path) -> None:
    """Of a point at 9, 13 and so on px those at 21 and 25, before which is a bar from 20 to 28."""
    path = tmp_path / "scene.yaml"
    path.write_text(HIDDEN)
    done = CliRunner().invoke(app, ["info", str(path)])
    assert "             more than half hidden in 3-4 by bar" in done.stdout.splitlines(), done.stdout


def test_info_says_why_there_is_no_ratio(tmp_path: Path) -> None:
    path = tmp_path / "scene.yaml"
    path.write_text(HIDDEN)
    for override, why in (
        ("occluders.bar.size_px=[70, 20]", "hidden"),
        ("targets.jet.path.start=[-500, 30]", "outside"),
        ("targets.jet.path.speed=0", None),
    ):
        done = CliRunner().invoke(app, ["info", str(path), "camera.netd_mk=20", override])
        assert (f"no SCR: {why}" in done.stdout) == (why is not None), done.output
        assert (" SCR " in done.stdout.replace("no SCR", "")) == (why is None), done.output


def test_a_truth_without_ratios_has_none_that_is_known() -> None:
    (jet,) = survey([Truth(0, 0.0, (seen(None),))], SIZE)
    assert jet.why_none == "unknown"


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [(100.0, 2, "100"), (1234.0, 3, "1230"), (0.25, 2, "0.25"), (1.5e-7, 2, "0.00000015"), (9.96, 2, "10")],
)
def test_plain_numbers(value: float, digits: int, text: str) -> None:
    assert decimal_text(value, digits) == text
