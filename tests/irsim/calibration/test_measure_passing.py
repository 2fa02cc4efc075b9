"""The blur is read off faint points that pass before texture that stands; what is none of them gives no blur."""

from __future__ import annotations

import numpy as np
import pytest

import irsim
from irsim.geometry.random_fields import spectral
from irsim.measure import defects
from irsim.measure.passing import passing_blurs
from irsim.types import Floats

PASSING = """\
frames: 40
seed: SEED
camera: {size: [128, 96], psf_px: PSF, netd_mk: 60SMEAR}
background: {kind: ground, spread_k: 0.3}
targets:
  - id: a
    shape: {kind: point, scr: 3, area_m2: 0.001}
    path: {kind: straight, start: [20.3, 40.2], speed: SPEED, heading_deg: 20, range_m: 2000}
"""


@pytest.mark.parametrize(
    ("seed", "psf_px", "speed", "smear"),
    [
        (0, 0.5, 0.6, ""),
        (1, 0.8, 1.3, ""),
        (2, 1.2, 0.9, ""),
        # Without its way taken for what it is, this looked like 0.57 px.
        (5, 0.5, 2.3, ", smear: {time_ms: 25}"),
    ],
)
def test_a_faint_point_before_texture_tells_the_blur(seed: int, psf_px: float, speed: float, smear: str) -> None:
    text = PASSING.replace("SEED", str(seed)).replace("PSF", str(psf_px)).replace("SPEED", str(speed))
    scene = irsim.Rendering(irsim.loads(text.replace("SMEAR", smear)))
    frames = np.stack([frame.image for frame in scene.frames()])
    (blur,) = passing_blurs(frames, defects(frames).all, 2.0**scene.bits - 1)
    assert blur.low <= psf_px <= blur.high
    assert blur.high - blur.low < 0.12 * psf_px


def scene(things: Floats) -> Floats:
    """Frames (T, rows, columns) of things before texture, with noise of 10."""
    rng = np.random.default_rng(3)
    texture = 40.0 * spectral(things.shape[1:], 3, (2.6, 2.6), 30, 1.0, 1, "field")
    return 1000 + texture + things + rng.normal(0, 10, things.shape)


def drawn(width: float, height: float, blur: float, speed: float, count: int = 40) -> Floats:
    """A bright box of that size, px, that goes to the right, blurred; (T, 64, 96)."""
    from scipy.special import ndtr

    def along(size: int, middle: float, length: float) -> Floats:
        fine = middle + np.linspace(-length / 2, length / 2, 9)
        edges = np.arange(size + 1) - 0.5
        return np.asarray(np.diff(ndtr((edges[None] - fine[:, None]) / blur), axis=1).mean(axis=0))

    return np.stack(
        [400 * np.outer(along(64, 31.3, height), along(96, 12 + speed * k, width)) for k in range(count)]
    ).astype(np.float64)


def blurs(frames: Floats) -> int:
    return len(passing_blurs(frames, np.zeros(frames.shape[1:], bool)))


def test_what_is_no_point_gives_no_blur() -> None:
    point = drawn(0.1, 0.1, 0.6, 1.3)
    assert blurs(scene(point)) == 1
    assert blurs(scene(0 * point)) == 0
    assert blurs(scene(20 * drawn(5.0, 4.0, 0.6, 1.3))) == 0  # extended
    assert blurs(scene(drawn(0.1, 0.1, 0.6, 0.05))) == 0  # what is behind is never seen
    flashing = 0 * point
    flashing[::7, 30:32, 40] = 500  # a pixel that blinks, and one beside it
    flashing[3::5, 44, 60] = 500
    assert blurs(scene(flashing)) == 0
    rng = np.random.default_rng(4)
    twigs = rng.normal(0, 30, (64, 96)).cumsum(axis=1)
    trees = np.stack([np.roll(twigs, round(3 * np.sin(k / 3)), 1) for k in range(40)])
    trees[:, :32] = 0
    assert blurs(scene(trees)) == 0
