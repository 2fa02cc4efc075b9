"""Numbers of an AGC are found from anywhere in their ranges, the same every time; so are displays drawn by chance."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_displayed import agc_of, shown

from irsim.camera import CURVES
from irsim.camera.agc import Agc, Fixed, Linear
from irsim.camera.agc_local import Clahe
from irsim.displayed import KNOBS, FittedDisplay, fit_display
from irsim.displayed.evolved import evolved
from irsim.displayed.knobs import knobs, turned_to
from irsim.displayed.search import EXACT, tolerance
from irsim.displayed.starts import BASES
from irsim.rng import stream
from irsim.types import Floats

START = Clahe(base=Linear())
TARGET = Clahe(clip_limit=7.3, tiles=(5, 14), base=Linear(tails=(0.02, 0.0004)))
TURNED = [knob for knob in knobs(START) if knob.name != "time_constant_frames"]


def apart(agc: Agc) -> float:
    """Squared distance from the target on the knobs' scales, with ridges, in which a search downhill would stay."""
    steps = [knob.scaled(knob.of(agc)) - knob.scaled(knob.of(TARGET)) for knob in TURNED]
    return sum(step * step + 0.5 * math.sin(6 * step) ** 2 for step in steps)


def test_the_best_numbers_are_found_over_ridges_the_same_every_time() -> None:
    found = evolved(apart, START, TURNED)
    assert isinstance(found, Clahe)
    assert found.tiles == (5, 14)
    assert apart(found) <= EXACT
    assert evolved(apart, START, TURNED) == found


def test_what_is_not_turned_stays_and_ranges_are_kept() -> None:
    limit = replace(TURNED[0], least=1.0, most=4.0)
    found = evolved(apart, START, [limit])
    assert found.model_copy(update={"clip_limit": START.clip_limit}) == START
    assert limit.of(found) == pytest.approx(4.0, rel=0.01)


def test_numbers_that_no_agc_may_have_are_passed_over() -> None:
    """Ends the wrong way round."""
    ends = [replace(knob, least=0.0, most=100.0) for knob in knobs(Fixed())]
    found = evolved(lambda agc: (agc.low - 99) ** 2 + (agc.high - 40) ** 2, Fixed(), ends)  # type: ignore[attr-defined]
    assert found == Fixed(low=69, high=70)


@given(st.data())
def test_a_number_lies_where_its_scale_says(data: st.DataObject) -> None:
    knob = data.draw(st.sampled_from([knob for own in KNOBS.values() for knob in own]))
    numbers = st.integers(int(knob.least), int(knob.most)) if knob.whole else st.floats(knob.least, knob.most)
    value = float(data.draw(numbers))
    assert knob.value(knob.scaled(value)) == pytest.approx(value, rel=1e-9, abs=1e-12)
    assert knob.value(knob.scaled(knob.most) + 1) == knob.most


def test_what_may_stand_behind_places_is_of_each_kind() -> None:
    assert {base.kind for base in BASES} == set(CURVES.kinds)


def test_a_tolerance_holds_all_that_nobody_tells_apart_and_ends_where_its_range_does() -> None:
    """Told from 0.9 of the limit down and from 1.5 of it up; or never."""
    (limit,) = (knob for knob in TURNED if knob.name == "clip_limit")

    def errors(agc: Agc) -> Floats:
        return np.full(3, 0.0 if 0.9 * 4 <= limit.of(agc) <= 1.5 * 4 else 9.0)

    told = tolerance(errors, Clahe(clip_limit=4.0), limit)
    assert told.low <= 0.9 * 4 < told.low * (1 + 2 * limit.fine)
    assert told.high >= 1.5 * 4 > told.high * (1 - 2 * limit.fine)
    near = tolerance(errors, Clahe(clip_limit=4.0), replace(limit, most=6.01))
    assert near.high < 6.01
    free = tolerance(lambda _: np.zeros(3), Clahe(clip_limit=4.0), limit)
    assert (free.low, free.high) == (limit.least, limit.most)


def test_all_numbers_are_turned_at_once() -> None:
    both = [(knob, value) for knob, value in zip(knobs(Fixed()), (300.0, 400.0), strict=True)]
    assert turned_to(Fixed(low=1, high=2), both) == Fixed(low=300, high=400)
    assert turned_to(Fixed(), [(knob, 5.0) for knob, _ in both]) is None


def drawn(seed: int) -> str:
    """A display by `clahe`, its numbers drawn: bases of each kind that has numbers, some of them slow."""
    rng = stream(seed, "displays")

    def between(low: float, high: float) -> float:
        return round(math.exp(rng.uniform(math.log(low), math.log(high))), 5)

    slow = f"time_constant_frames: {between(1, 15) if seed % 2 else 0}"
    base = (
        f"{{kind: linear, tails: [{between(0.0005, 0.05)}, {between(0.0005, 0.05)}], {slow}}}",
        f"{{kind: plateau, plateau: {between(2e-4, 0.02)}, gain_limit: {between(0.1, 1)}, {slow}}}",
        "{kind: fixed, low: 1700, high: 6000}",
    )[seed % 3]
    across, down = (int(count) for count in rng.integers(2, 11, 2))
    return f"{{kind: clahe, clip_limit: {between(0.8, 8)}, tiles: [{across}, {down}], base: {base}}}"


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_any_display_by_places_is_found(seed: int) -> None:
    """Seed 1's slow plateau ended in a valley of 1.8 greys; of 24 others the worst was 1.0, the median 0.1."""
    true = agc_of(drawn(seed))
    display = fit_display(shown(true))
    assert isinstance(true, Clahe)
    assert isinstance(display, FittedDisplay)
    assert isinstance(display.agc, Clahe)
    assert display.agc.tiles == true.tiles
    assert display.agc.inner.kind == true.inner.kind
    assert display.rms_grey < (2.5 if seed == 1 else 1.2)
