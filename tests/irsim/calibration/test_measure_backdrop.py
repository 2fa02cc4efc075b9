"""What targets hold, and small things that stand far out, is no texture of the background."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

import irsim
from irsim.errors import InputError
from irsim.geometry.random_fields import spectral
from irsim.measure import Figures, Region, backdrops, measure_figures, texture
from irsim.measure.backdrop import backdrop, continued, far_out
from irsim.measure.pattern import fixed_pattern
from irsim.types import Floats

NOISE = 2.0
STANDS_OUT = "far out of the texture"


def field(rows: int = 128, columns: int = 160) -> Floats:
    """A steep texture of sigma 30 about 1000."""
    return np.asarray(1000 + 30 * spectral((256, 256), 3, (3.0, 3.4), 40, 1.0, 1, "field")[:rows, :columns])


def with_thing(picture: Floats, left: int, top: int, height: float) -> Floats:
    """With a thing of 9 x 7 px."""
    seen = picture.copy()
    seen[top : top + 7, left : left + 9] += height
    return seen


def filmed(lefts: list[int] | None, height: float = 600.0, drawn: bool = True) -> Figures:
    """By a still camera before which a thing is at those columns, frame after frame; truth has it, or not (None)."""
    count = 40
    scene, rng = field(), np.random.default_rng(2)
    frames = np.stack([with_thing(scene, lefts[k], 60, height) if lefts and drawn else scene for k in range(count)])
    boxes = tuple((Region(left - 4, 56, 17, 15),) for left in lefts) if lefts else None
    return measure_figures(np.rint(frames + rng.normal(0, NOISE, frames.shape)), 30.0, passing=False, boxes=boxes)


def alike(found: Figures, expected: Figures, slope: float, spread: float) -> None:
    assert found.texture is not None
    assert expected.texture is not None
    for name in ("beta_x", "beta_y"):
        assert getattr(found.texture, name).value == pytest.approx(getattr(expected.texture, name).value, abs=slope)
    assert found.texture.spread.value == pytest.approx(expected.texture.spread.value, rel=spread)


@lru_cache
def of_scene(name: str, jet: bool) -> tuple[Figures, Figures]:
    """Figures of 40 frames as `irsim fit` tells them, and of the same frames without truth."""
    source = irsim.open_source(name, [] if jet else [f"without=[{', '.join(TARGETS[name])}]"])
    frames = np.stack([frame.image for frame in source.frames("counts", 0, 40)])
    blind = measure_figures(frames, source.rate_hz, None, 2.0**source.bits - 1, passing=False)
    return irsim.fit(source, stop=40).figures, blind


TARGETS = {"sky": ["jet"], "ground": ["tank"], "clouds": ["drone"], "sea": ["boat"], "countryside": ["truck"]}


@pytest.mark.parametrize("name", ["sky", *(pytest.param(each, marks=pytest.mark.slow) for each in list(TARGETS)[1:])])
def test_the_targets_of_a_recording_are_no_texture(name: str) -> None:
    """The jet's heat made betas of 0.9 / 0.9 for 3.1 / 3.7, and a spread three times as large."""
    beside, without = of_scene(name, True)[0], of_scene(name, False)[0]
    alike(beside, without, slope=0.4, spread=0.2)
    assert beside.mean == pytest.approx(without.mean, rel=0.005)
    assert not [note for note in (*beside.notes, *without.notes) if STANDS_OUT in note]


@pytest.mark.parametrize("name", ["sky", *(pytest.param(each, marks=pytest.mark.slow) for each in ("ground", "sea"))])
def test_without_truth_hot_targets_are_no_texture_either(name: str) -> None:
    beside, without = of_scene(name, True)[1], of_scene(name, False)[1]
    alike(beside, without, slope=0.4, spread=0.2)
    assert [note for note in beside.notes if STANDS_OUT in note] == [
        "1 small thing stands far out of the texture: left out of its spectrum, mean and histogram"
    ]
    assert not [note for note in without.notes if STANDS_OUT in note]


def test_a_fit_looks_like_what_it_was_fitted_to() -> None:
    """A power law has no edges of clouds, but it falls off alike; it was 0.9 for 3.3."""
    source = irsim.open_source("sky")
    fitted = irsim.Rendering(irsim.fit(source, stop=40).scenario)
    assert texture(backdrops(fitted, 2)).beta == pytest.approx(texture(backdrops(source, 2)).beta, abs=0.4)


@pytest.mark.sampled
@pytest.mark.parametrize("lefts", [[60] * 40, [60 + k // 6 for k in range(40)], [20 + 3 * k for k in range(40)]])
def test_before_a_camera_that_stands_targets_are_no_texture(lefts: list[int]) -> None:
    """One that stands, one that creeps and so is at the same pixels in most frames, one that passes."""
    found, without = filmed(lefts), filmed(None)
    alike(found, without, slope=0.05, spread=0.05)
    assert found.mean == pytest.approx(without.mean, abs=0.2)
    assert found.pixel is not None
    assert without.pixel is not None
    assert found.pixel.low <= without.pixel.high


def test_behind_a_target_that_moves_the_scene_is_that_of_other_frames() -> None:
    """Nothing of it is taken from around."""
    lefts = [20 + 3 * k for k in range(40)]
    assert filmed(lefts).texture == pytest.approx(filmed(lefts, height=0.0).texture)


@pytest.mark.parametrize("height", [400.0, -400.0])
def test_a_small_thing_far_out_is_found_alone(height: float) -> None:
    even, noise = field(), np.random.default_rng(3).normal(0, NOISE, (128, 160))
    assert far_out(even + noise)[1] == 0
    held, things = far_out(with_thing(even + noise, 60, 50, height))
    assert things == 1
    assert held[50:57, 60:69].all()
    assert held.mean() < 0.05
    behind = backdrop(with_thing(even + noise, 60, 50, height), None)
    assert np.abs(behind.picture - even)[50:57, 60:69].max() < 100
    assert behind.seen.mean() == pytest.approx(even.mean(), abs=1)


def test_what_is_wide_or_even_is_nothing_that_stands_out() -> None:
    wide = field()
    wide[40:100, 40:120] += 400
    assert far_out(wide)[1] == 0
    assert far_out(np.full((128, 160), 12345.6))[1] == 0
    assert far_out(np.random.default_rng(4).normal(1000, 5, (128, 160)))[1] == 0


def test_a_picture_that_targets_fill_is_taken_as_it_is() -> None:
    taken = np.ones((128, 160), np.bool_)
    taken[:40] = False
    found = backdrop(field(), taken)
    assert not found.held.any()
    assert found.picture is continued(found.picture, found.held)
    assert np.array_equal(found.picture, field())


def test_what_goes_on_where_a_target_was_is_not_the_quietest_place() -> None:
    """Edges all over, so that pixels are told where the picture is quietest: where it is made up, nothing is white."""
    rng = np.random.default_rng(5)
    steps = 40.0 * (np.add.outer(np.arange(160) // 20, np.arange(200) // 20) % 2)
    held = np.zeros(steps.shape, np.bool_)
    held[10:80, 20:90] = True
    picture = np.where(held, 0.0, steps + rng.normal(0, NOISE, steps.shape))
    quietest = fixed_pattern(picture, None, False, held).quietest
    assert quietest is not None
    assert held[quietest.rows, quietest.columns].mean() < 0.1


def test_boxes_are_those_of_all_frames() -> None:
    with pytest.raises(InputError, match="boxes: of 1 frame; allowed: None, or of all 8"):
        measure_figures(np.zeros((8, 40, 40)), 30.0, boxes=((),))
