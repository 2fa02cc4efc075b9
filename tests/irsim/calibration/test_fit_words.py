"""What was measured is written into a scenario under the key that means it, in the unit of that key."""

from __future__ import annotations

import pytest

from irsim.backgrounds import Ground
from irsim.camera.detectors import BadPixels
from irsim.fitting.scene import Scene
from irsim.measure import Figures, Measured, Region
from irsim.measure.field import Field
from irsim.measure.flaws import Flaws
from irsim.physics.radiometry import radiance
from irsim.render.stream import Rendering
from irsim.scenario.loader import loads
from irsim.scenario.model import Scenario

SOURCE = """\
frames: 4
camera: {size: [64, 64], rate_hz: 25, bits: 14, band: lwir, range_k: [270, 320]}
background: {kind: sky}
"""
FULL = 2**14 - 1
HISTOGRAM_K = (288.0, 289.5, 290.0, 291.0, 297.0)


def counts(kelvin: float) -> float:
    """Of a black body: 0 at 270 K, full at 320 K, and linear in radiance between them."""
    cold, own, hot = (float(radiance("lwir", each)) for each in (270.0, kelvin, 320.0))
    return FULL * (own - cold) / (hot - cold)


def about(value: float) -> Measured:
    return Measured(value, 0.9 * value, 1.1 * value)


TEXTURE = Field(
    spread=about(100.0), beta_x=about(2.1), beta_y=about(3.3), correlation_px=about(50.0), stretch=about(1.5)
)
FLAWS = Flaws(
    dead=about(0.001),
    hot=about(0.002),
    blinking=about(0.003),
    cluster=1.8,
    dead_level=0.25 * FULL,
    hot_height=about(60.0),
    jump=about(40.0),
    on_frames=about(10.0),
    off_frames=about(75.0),
)


@pytest.fixture(scope="module")
def written() -> Scenario:
    """The scenario of figures in which no two that might be taken for each other are alike."""
    figures = Figures(
        frames=90,
        noise=about(4.0),
        white=about(4.0),
        memory=None,
        memory_frames=None,
        walk=about(0.01),
        row_noise=None,
        column_noise=None,
        rows=None,
        columns=None,
        level=None,
        level_frames=None,
        pixel=about(2.0),
        row=about(0.4),
        column=about(1.2),
        even_rows=None,
        even_columns=None,
        blur=None,
        psf=about(0.7),
        texture=TEXTURE,
        mean=counts(291.5),
        histogram=tuple(counts(kelvin) for kelvin in HISTOGRAM_K),
        flaws=FLAWS,
        region=Region(0, 0, 64, 64),
        notes=(),
    )
    return loads("\n".join(Scene.of(Rendering(loads(SOURCE)), figures).lines(4)))


def test_bad_pixels_are_written_as_they_were_found(written: Scenario) -> None:
    """Times at 25 Hz, heights in units of a noise of 4 counts, the level of dead ones as a share of the highest."""
    (bad,) = (noise for noise in written.camera.noise if isinstance(noise, BadPixels))
    assert (bad.dead, bad.hot, bad.blinking) == pytest.approx((0.001, 0.002, 0.003))
    assert bad.cluster == pytest.approx(1.8)
    assert bad.dead_level == pytest.approx(0.25)
    assert (bad.hot_ratio, bad.blink_ratio) == pytest.approx((15.0, 10.0), rel=1e-3)
    assert (bad.on_s, bad.off_s) == pytest.approx((10 / 25, 75 / 25))


def test_texture_is_written_along_the_axis_that_it_was_found_along(written: Scenario) -> None:
    ground = written.background
    assert isinstance(ground, Ground)
    assert ground.betas == pytest.approx((2.1, 3.3))
    assert ground.stretch == pytest.approx(1.5)
    assert ground.correlation_mrad == pytest.approx(50 * written.camera.ifov_mrad)


def test_a_background_has_the_temperatures_whose_counts_were_found(written: Scenario) -> None:
    ground = written.background
    assert isinstance(ground, Ground)
    assert ground.mean_k == pytest.approx(291.5, abs=0.01)
    assert ground.histogram == pytest.approx(HISTOGRAM_K, abs=0.01)


def test_fixed_pattern_is_written_in_units_of_the_noise(written: Scenario) -> None:
    noise = written.camera.noise[0].model_dump()
    assert {term: noise[term] for term in ("tvh", "vh", "v", "h")} == pytest.approx(
        {"tvh": 1.0, "vh": 0.5, "v": 0.1, "h": 0.3}, rel=1e-3
    )
