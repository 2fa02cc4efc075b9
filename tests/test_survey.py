"""What is said of each target over all frames: figures by hand."""

from __future__ import annotations

import pytest

import irsim
from irsim.survey import Spell, survey
from irsim.types import Box, TargetTruth, Truth


def seen(visible: float | None = 1.0, scr: float | None = None, **rest: object) -> TargetTruth:
    return TargetTruth("jet", (0.0, 0.0), Box(0, 0, 8, 4), visible=visible, scr=scr, **rest)  # type: ignore[arg-type]


def test_spells_are_runs_of_frames_with_whoever_hid_it() -> None:
    rows = [seen(), seen(0.2, occluders=("tree",)), seen(0.0, occluders=("tree", "house")), seen(0.5), None, seen(0.1)]
    (jet,) = survey(Truth(k, k / 30, (row,) if row else ()) for k, row in enumerate(rows))
    assert jet.hidden == (Spell(1, 2, ("tree", "house")), Spell(5, 5))
    assert jet.absent == (Spell(4, 4),)
    assert jet.crossing == ()
    assert (jet.frames, jet.first, jet.size) == (5, 0, (8.0, 4.0))


def test_what_has_left_the_picture_is_out_of_view_and_not_hidden() -> None:
    rows = [seen(0.0, in_view=False), seen(0.3, in_view=False, occluders=("tree",)), seen(0.2, in_view=True), seen()]
    (jet,) = survey(Truth(k, k / 30, (row,)) for k, row in enumerate(rows))
    assert jet.outside == (Spell(0, 1),)
    assert jet.hidden == (Spell(2, 2),)


def test_ratios_are_of_frames_in_which_it_is_seen_and_speeds_are_medians() -> None:
    rows = [seen(scr=float(k), velocity=(3.0 * k, 4.0 * k)) for k in range(21)] + [seen(0.0, 1000.0)]
    (jet,) = survey(Truth(k, k / 30, (row,)) for k, row in enumerate(rows))
    assert jet.scr == pytest.approx((1, 10, 19))
    assert jet.speed == pytest.approx(50)


def test_what_truth_does_not_know_is_none() -> None:
    (jet,) = survey([Truth(0, 0.0, (seen(None),))])
    assert (jet.scr, jet.speed, jet.hidden) == (None, None, ())


def test_an_intent_is_found_again() -> None:
    """The house of `hiding` is to hide the car from frame 66 to 78."""
    car = next(target for target in survey(irsim.Rendering(irsim.load("hiding")).truths()) if target.id == "car")
    (house,) = [spell for spell in car.hidden if "building" in spell.by]
    assert house.first <= 66
    assert house.last >= 78
