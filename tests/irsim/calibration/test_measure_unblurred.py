"""Where no point shows the blur, what hangs on it is held by its interval all the same."""

from __future__ import annotations

import numpy as np
import pytest
from intervals import held
from test_measure_fit import FIELD, apart

import irsim
from irsim.geometry.random_fields import spectral
from irsim.measure.field import periodogram
from irsim.measure.interval import Measured
from irsim.measure.notes import blur_notes
from irsim.measure.still import Still
from irsim.measure.unblurred import USUAL_BLUR, fit_unblurred

COOLED = """\
frames: 120
camera: {preset: cooled_mwir, size: [160, 128]}
background: {kind: ground, spread_k: 1, mean_k: 295}
"""
PASSING = """\
targets:
  - id: p
    shape: {kind: point, temperature_k: 360, area_m2: 0.1}
    path: {kind: straight, start: [20, 40], speed: 1, range_m: 4000}
"""


def test_a_blur_that_is_seen_the_first_time_only_leaves_the_figures_agreeing() -> None:
    """What a fit gives has no target: rendered, it shows no point, and texture and floor hang on the blur."""
    first = irsim.fit(irsim.loads(COOLED + PASSING))
    second = irsim.fit(first.scenario)
    assert first.figures.blur is not None
    assert second.figures.blur is None
    assert [line for line in apart(first.figures, second.figures) if not line.startswith("blur:")] == []


def test_a_thing_as_wide_as_a_pixel_is_not_taken_for_the_blur_of_the_lens() -> None:
    """A lens of 0.47 px was said to have 0.936 (0.931 to 0.941), pixels 13.5 counts (13.0 to 14.1) of 1.1, and the
    texture a slope of 0.58 (0.49 to 0.66) of 2.3; fitted again, the last two disagreed."""
    text = COOLED.replace("spread_k: 1", "spread_k: 0.8, beta: 2.3") + PASSING.replace("range_m: 4000", "range_m: 1100")
    first = irsim.fit(irsim.loads(text.replace("temperature_k: 360", "temperature_k: 320")))
    found = first.figures
    assert found.blur is not None
    assert found.blur.value > 0.7
    assert found.psf.low <= 0.47 <= found.psf.high
    assert found.psf.value == pytest.approx(0.47, abs=0.06)
    assert found.pixel is not None
    assert found.pixel.low <= 0.3 * found.noise.value <= found.pixel.high
    assert found.pixel.value < found.noise.value
    assert found.texture is not None
    for slope in (found.texture.beta_x, found.texture.beta_y):
        assert slope.low <= 2.3 <= slope.high
        assert slope.value == pytest.approx(2.3, abs=0.3)
    assert any(note.startswith("the blur is taken to be") for note in first.notes)
    again = irsim.fit(first.scenario)
    assert [line for line in apart(found, again.figures) if not line.startswith("blur:")] == []


def test_without_a_point_the_fixed_pattern_is_held_all_the_same() -> None:
    """True is 0.3 of the noise. Taken for 0.6 px, a blur of 0.47 px gave 3.7 (3.3 to 4.1) counts for 1.1."""
    found = irsim.fit(irsim.loads(COOLED)).figures
    assert found.blur is None
    assert found.pixel is not None
    assert found.pixel.low <= 0.3 * found.noise.value <= found.pixel.high
    assert found.pixel.value < 0.7 * found.noise.value
    assert found.psf.low <= 0.47 <= found.psf.high


@pytest.mark.parametrize("psf_px", [0.6, *(pytest.param(each, marks=pytest.mark.slow) for each in (0.42, 0.78))])
def test_what_hangs_on_an_unseen_blur_lies_in_its_intervals(psf_px: float) -> None:
    found = []
    passed = np.exp(-2 * np.pi**2 * psf_px**2 * np.add.outer(*[np.fft.fftfreq(1024) ** 2] * 2))
    for seed in range(4):
        texture = 10.0 * spectral((1024, 1024), 3, (2.6, 3.2), 60, 1.5, seed, "field")
        blurred = np.real(np.fft.ifft2(np.fft.fft2(texture) * passed))[:200, :240]
        noisy = blurred + np.random.default_rng(seed).normal(0, 0.5, (200, 240))
        spectrum, psf = fit_unblurred(periodogram(noisy), (200, 240), None)
        assert (psf.low, psf.high) == (USUAL_BLUR.low, USUAL_BLUR.high)
        found.append(spectrum)
    for name, true in FIELD.items():
        held([getattr(spectrum.texture, name) for spectrum in found], true)
    held([spectrum.floor for spectrum in found], 0.25)


def test_a_wider_blur_than_the_seen_one_is_told_of_as_such() -> None:
    """The note said that the lens may be sharper, and named what was seen."""
    seen, taken = Measured(0.6, 0.55, 0.95), Measured(0.86, 0.4, 0.95)
    notes = list(blur_notes(seen, taken, Still((), *np.zeros((3, 4, 4), np.bool_))))
    assert "0.4 to 0.95 px" in notes[0]
    assert notes[1].startswith("the blur is taken to be 0.86 px")
    assert len(list(blur_notes(seen, Measured(0.6, 0.4, 0.95), Still((), *np.zeros((3, 4, 4), np.bool_))))) == 1
