"""The AGC behind pictures is found with its numbers; rendered with it and fitted again, the figures agree."""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np
import pytest

import irsim
from irsim.camera import AGCS
from irsim.camera.agc import Agc, AgcSequence, Linear, Picture, Plateau
from irsim.camera.agc_local import Clahe, Unsharp
from irsim.displayed import FITS, KNOBS, FittedDisplay, Tolerance, fit_display
from irsim.displayed.choice import cut_short
from irsim.displayed.fitted import refined
from irsim.displayed.knobs import knobs
from irsim.displayed.pairs import Pairs, scored_frames
from irsim.displayed.search import as_good
from irsim.displayed.starts import clahe
from irsim.displayed.trial import Trial
from irsim.types import Image

FRAMES = 60
SCENE = f"""\
frames: {FRAMES}
seed: 3
camera: {{size: [160, 128], range_k: [270, 330], netd_mk: 60, motion: [{{kind: pan, azimuth_deg_s: 1.5}}]}}
background: {{kind: ground, spread_k: 2, betas: [2.4, 2.8], correlation_mrad: 40}}
targets:
  - id: hot
    shape: {{kind: truck}}
    path: {{kind: straight, range_m: 150, start: [-30, 60], speed: 4}}
"""
"""A camera pans over ground while something hot comes in: the gain has to follow."""

TRUE = {
    "none": "{kind: none}",
    "fixed": "{kind: fixed, low: 1900, high: 6000}",
    "linear": "{kind: linear, tails: [0.013, 0.0031], time_constant_frames: 4.3}",
    "plateau": "{kind: plateau, plateau: 0.002, gain_limit: 0.12, time_constant_frames: 5}",
    "clahe": "{kind: clahe, clip_limit: 3, tiles: [8, 6], base: {kind: linear, tails: [0.004, 0.01]}}",
    "unsharp": "{kind: unsharp, amount: 1.5, sigma_px: 2, base: {kind: plateau, plateau: 0.002, gain_limit: 0.3}}",
}
"""One of each kind, by its words."""


def agc_of(text: str) -> Agc:
    agc = irsim.loads(f"frames: 1\ncamera: {{agc: {text}}}\nbackground: {{kind: ground}}\n").camera.agc
    assert isinstance(agc, Agc)
    return agc


@lru_cache
def counts() -> tuple[Image, ...]:
    return tuple(frame.image for frame in irsim.open_source(irsim.loads(SCENE)).frames("counts"))


def shown(agc: Agc, quality: int | None = None) -> Pairs:
    """The scene as an AGC shows it, through JPEG of that quality."""
    screen = AgcSequence(agc, 14, lambda index: counts()[index])
    pictures = [screen.picture(image, index) for index, image in enumerate(counts())]
    if quality is not None:
        pictures = [packed(picture, quality) for picture in pictures]
    return Pairs(np.stack(counts()), 14, {k: pictures[k] for k in scored_frames(FRAMES)})


def packed(picture: Picture, quality: int) -> Picture:
    _, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_GRAYSCALE), np.uint8)


@lru_cache
def found(words: str, quality: int | None = None) -> FittedDisplay:
    display = fit_display(shown(agc_of(TRUE[words]), quality))
    assert isinstance(display, FittedDisplay)
    return display


def test_a_range_that_ends_where_the_search_does_is_told_of() -> None:
    agc = agc_of(TRUE["plateau"])
    assert isinstance(agc, Plateau)
    share, gain, time = knobs(agc)
    assert next(cut_short(time, Tolerance(80.0, 25.4, 100.0))) == (
        "time_constant_frames may be anything from 25.4 on: its range ends at 100, as far as is searched"
    )
    assert next(cut_short(gain, Tolerance(255.0, 0.53, 255.0))) == (
        "gain_limit may be anything from 0.53 on: its range ends at 255, which is none"
    )
    assert next(cut_short(share, Tolerance(1e-5, 1e-6, 1e-4))) == (
        "plateau may be anything up to 0.0001: its range ends at 1e-06, as far as is searched"
    )
    assert not [*cut_short(time, Tolerance(0.0, 0.0, 2.0)), *cut_short(share, Tolerance(0.002, 0.001, 0.003))]


@pytest.mark.slow
def test_a_gain_that_hardly_moves_is_as_slow_as_is_searched() -> None:
    display = fit_display(shown(agc_of("{kind: linear, tails: [0.013, 0.0031], time_constant_frames: 80}")))
    assert isinstance(display, FittedDisplay)
    assert dict(display.tolerances)["time_constant_frames",].low > 10
    assert any(note.startswith("time_constant_frames may be anything from ") for note in display.notes)


def test_every_kind_has_a_fit_and_its_numbers_and_a_true_one_here() -> None:
    kinds = {word for word, _ in AGCS}
    assert set(FITS) == set(KNOBS) == {agc_of(text).kind for text in TRUE.values()} == kinds


LONG = pytest.mark.slow
"""What is searched for place by place, or through JPEG, takes half a minute on a busy machine."""
SHORT = {("none", None), ("fixed", None), ("linear", None), ("none", 85)}
RUNS = [
    pytest.param(words, quality, marks=() if (words, quality) in SHORT else LONG)
    for words in TRUE
    for quality in (None, 85)
]


@pytest.mark.sampled
@pytest.mark.parametrize(("words", "quality"), RUNS)
def test_what_showed_the_pictures_is_found(words: str, quality: int | None) -> None:
    """In its tolerances, made half as wide again where JPEG smoothed the pictures; and within a tenth, where they tell.

    `linear` lies between all first guesses, so that it is found by searching; regression alone finds `fixed`.
    """
    true, display = agc_of(TRUE[words]), found(words, quality)
    assert display.agc.kind == true.kind
    assert display.rms_grey < (9 if quality else 3)
    assert [path for path, _ in display.tolerances] == [knob.path for knob in knobs(true)]
    for knob, (path, told) in zip(knobs(true), display.tolerances, strict=True):
        value, width = knob.of(true), told.high - told.low
        reach = 0.25 * width if quality else 0.0
        assert told.low - reach <= value <= told.high + reach, (path, told)
        if width < value:
            assert told.value == pytest.approx(value, rel=0.1), path


@pytest.mark.sampled
@pytest.mark.parametrize(("words", "quality"), RUNS)
def test_shown_and_fitted_again_the_figures_agree(words: str, quality: int | None) -> None:
    first = found(words, quality)
    second = fit_display(shown(first.agc))
    assert isinstance(second, FittedDisplay)
    assert second.agc.kind == first.agc.kind
    again = dict(second.tolerances)
    assert [path for path, _ in first.tolerances] == list(again)
    apart = [
        (path, told, again[path])
        for path, told in first.tolerances
        if told.low > again[path].high or again[path].low > told.high
    ]
    assert not apart


@pytest.mark.slow
def test_a_display_that_ran_before_the_recording_had_seen_its_first_frame() -> None:
    """Something hot comes in soon after: a display that began with the first frame would have followed at once."""
    agc, before, count = agc_of("{kind: linear, tails: [0.013, 0.0031], time_constant_frames: 6}"), 60, 40
    draws = np.random.default_rng(4)
    scene = draws.normal(3000, 200, (64, 80))
    frames = (scene + draws.normal(0, 10, (before + count, 64, 80))).astype(np.uint16)
    frames[before + 8 :, 20:40, 30:50] += 5000
    screen = AgcSequence(agc, 14, lambda index: frames[index])
    pictures = {k: screen.picture(frames[before + k], before + k) for k in scored_frames(count)}
    pairs = Pairs(frames[before:], 14, pictures)
    assert Trial(pairs).error(agc) > 2  # squared greys, of the true one
    display = fit_display(pairs)
    assert isinstance(display, FittedDisplay)
    assert isinstance(display.agc, Linear)
    assert display.agc.time_constant_frames == pytest.approx(6, rel=0.05)
    assert display.agc.tails == pytest.approx((0.013, 0.0031), rel=0.1)
    assert display.rms_grey < 1


def corner(agc: Agc, quality: int | None = None, side: int = 64) -> Pairs:
    """The last frames' corner, in which something hot drives, as an AGC without memory shows it."""
    few = np.ascontiguousarray(np.stack(counts())[-12:, -side:, : side * 5 // 4])
    pictures = {k: agc.display(few[k], 14) for k in scored_frames(len(few))}
    return Pairs(few, 14, {k: p if quality is None else packed(p, quality) for k, p in pictures.items()})


@pytest.mark.slow
def test_few_equalised_places_are_found_in_small_pictures() -> None:
    """Limit and tails make up for each other."""
    true = "{kind: clahe, clip_limit: 2.3, tiles: [3, 2], base: {kind: linear, tails: [0.004, 0.01]}}"
    display = fit_display(corner(agc_of(true)))
    assert isinstance(display, FittedDisplay)
    assert isinstance(display.agc, Clahe)
    assert display.agc.tiles == (3, 2)
    assert display.agc.clip_limit == pytest.approx(2.3, rel=0.25)
    assert display.rms_grey < 3


def test_small_places_are_found_in_small_pictures() -> None:
    """Of 8 px; wrong tails hid them, and the search left 6 squared greys."""
    trial = Trial(corner(agc_of("{kind: clahe, tiles: [12, 10], base: {kind: linear, tails: [0.01, 0.01]}}"), side=80))
    agc = refined(trial, clahe)
    assert isinstance(agc, Clahe)
    assert agc.tiles == (12, 10)
    assert trial.error(agc) < 1


def test_a_mask_is_found_in_small_pictures() -> None:
    """Both numbers lie between first guesses."""
    display = fit_display(
        corner(agc_of("{kind: unsharp, amount: 1.7, sigma_px: 1.6, base: {kind: fixed, high: 6000}}"))
    )
    assert isinstance(display, FittedDisplay)
    assert isinstance(display.agc, Unsharp)
    assert (display.agc.amount, display.agc.sigma_px) == pytest.approx((1.7, 1.6), rel=0.02)
    assert display.rms_grey < 0.5


@pytest.mark.parametrize(("tiles", "side"), [([2, 2], 24), ([2, 2], 80), ([8, 6], 80), ([16, 12], 80)])
def test_places_are_told_from_compression(tiles: list[int], side: int) -> None:
    """In small pictures, and where places are of 7 px."""
    assert Trial(corner(agc_of(f"{{kind: clahe, tiles: {tiles}, base: {{kind: linear}}}}"), side=side)).is_local
    assert not Trial(corner(agc_of("{kind: linear}"), 50, side)).is_local


def test_one_frame_tells() -> None:
    """What a line that follows the scene gained on a fixed one through JPEG of quality 50: where the truck came in."""
    best = np.full(12, 6.77)
    more = np.array([0.03, 0.04, 0.07, 0.12, 0.05, 0.02, 0.03, 0.0, -0.03, -0.01, 0.16, 0.96])
    margin = 0.01 + 0.02 * 6.77
    assert not as_good(best + more, best, margin)
    assert as_good(best + np.minimum(more, 0.2), best, margin)


@pytest.mark.slow
def test_a_slow_gain_is_told_through_poor_compression() -> None:
    """A fixed one leaves no more than 2.7 greys rms."""
    agc = found("linear", 50).agc
    assert isinstance(agc, Linear)
    assert agc.tails == pytest.approx((0.013, 0.0031), rel=0.02)
    assert agc.time_constant_frames == pytest.approx(4.3, rel=0.05)


@LONG
def test_a_mask_around_equalised_places_is_nearly_found() -> None:
    """Of that many numbers that make up for each other some come out of their tolerances; the pictures are alike."""
    display = fit_display(shown(agc_of("{kind: unsharp, amount: 1.5, base: {kind: clahe, clip_limit: 4}}")))
    assert isinstance(display, FittedDisplay)
    assert isinstance(display.agc, Unsharp)
    assert isinstance(display.agc.base, Clahe)
    assert display.agc.base.tiles == (8, 8)
    assert (display.agc.amount, display.agc.sigma_px) == pytest.approx((1.5, 2), rel=0.1)
    assert display.rms_grey < 3


@pytest.mark.parametrize("bits", [8, 12, 16])
def test_counts_of_any_depth_and_saturated_ones(bits: int) -> None:
    """A third of the pixels lie at the highest count."""
    rng = np.random.default_rng(bits)
    full = 2**bits - 1
    drift = np.linspace(0.4, 0.7, 24)[:, np.newaxis, np.newaxis]
    frames = np.clip(full * (drift + 0.4 * rng.normal(size=(24, 64, 80))), 0, full)
    deep = np.rint(frames).astype(np.uint8 if bits == 8 else np.uint16)
    agc = Linear(tails=(0.02, 0.0))
    pairs = Pairs(deep, bits, {k: agc.display(deep[k], bits) for k in scored_frames(24)})
    before = deep.copy()
    display = fit_display(pairs)
    assert isinstance(display, FittedDisplay)
    assert display.rms_grey < 0.3
    np.testing.assert_array_equal(deep, before)


def test_scored_frames_are_few_and_leave_the_first_ones_to_the_memory() -> None:
    assert scored_frames(1) == (0,)
    assert scored_frames(8) == (2, 3, 4, 5, 6, 7)
    assert len(scored_frames(300)) == 12
    assert (scored_frames(300)[0], scored_frames(300)[-1]) == (75, 299)
