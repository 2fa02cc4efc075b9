"""Whether the scene slides before the camera, or only seems to: slow slides, noise, blur and warming lenses."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from irsim.geometry.random_fields import spectral
from irsim.measure import measure_figures, measure_noise
from irsim.measure.steady import slides
from irsim.types import Floats

TEXTURE = 10.0


def sliding(speed: float, noise: float, count: int = 40, side: int = 128) -> Floats:
    """(count, side, side): texture of sigma 10 that goes right by `speed` px a frame, under white noise."""
    field = TEXTURE * spectral((512, 512), 3, (2.6, 2.6), 20, 1.0, 1, "field").astype(np.float32)
    rng = np.random.default_rng(2)
    frames = []
    for k in range(count):
        way = np.array([[1, 0, -speed * k], [0, 1, 0]], np.float32)
        moved = cv2.warpAffine(field, way, (512, 512), flags=cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP)
        frames.append(1000 + moved[100 : 100 + side, 150 : 150 + side] + rng.normal(0, noise, (side, side)))
    return np.stack(frames)


@pytest.mark.parametrize(("speed", "noise"), [(0.005, 1.0), (0.05, 10.0), (0.2, 3.0), (3.0, 3.0), (-0.2, 3.0)])
def test_a_slide_is_told_however_slow(speed: float, noise: float) -> None:
    assert slides(sliding(speed, noise))


@pytest.mark.parametrize("noise", [0.1, 1.0, 3.0, 10.0])
def test_a_still_scene_does_not_slide(noise: float) -> None:
    assert not slides(sliding(0.0, noise))


@pytest.mark.parametrize("side", [8, 20, 27, 28, 32, 48, 64, 128])
@pytest.mark.parametrize("blur", [0.0, 1.0])
def test_noise_alone_does_not_slide(side: int, blur: float) -> None:
    rng = np.random.default_rng(3)
    frames = rng.normal(0, 3, (40, side, side))
    assert not slides(np.stack([cv2.GaussianBlur(frame, (0, 0), blur) if blur else frame for frame in frames]))


def test_what_a_warming_lens_adds_does_not_slide() -> None:
    """A bowl that deepens by a quarter: of itself, without a blur taken off, a shift explains a third of it."""
    down, across = np.mgrid[:128, :128] / 64 - 1
    bowl = 20 * (down**2 + across**2)
    noise = np.random.default_rng(4).normal(0, 1, (60, 128, 128))
    assert not slides(noise + bowl * (1 + np.linspace(0, 0.25, 60)[:, None, None]))


def test_few_frames_and_small_pictures_are_judged() -> None:
    assert slides(sliding(1.0, 1.0, count=2))
    assert slides(sliding(1.0, 1.0, side=32))
    assert not slides(np.zeros((3, 8, 8)))


@pytest.mark.sampled
@pytest.mark.parametrize("speed", [0.0, 0.2])
def test_noise_and_fit_agree(speed: float) -> None:
    frames = sliding(speed, 3.0)
    figures = measure_figures(frames, 30.0)
    assert measure_noise(frames, 30.0).slides == (speed > 0) == (figures.pixel is None)
    assert any(note.startswith("the scene moves") for note in figures.notes) == (speed > 0)
