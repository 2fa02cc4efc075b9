"""The shipped scenes, after optics, noise and display, have the spectra of real recordings of their class.

Real figures: power spectra f^-beta over 4/N .. 0.2 cycles a px of infrared recordings: broken cloud 2.9
(along x 2.2, along y 3.4), ground from the air 2.8 to 2.9 (2.6 / 2.75), bare trees 2.2 and horizon with
field 3.6, between which a line of trees before a field lies.
"""

from __future__ import annotations

import numpy as np
import pytest

import irsim
from irsim.calibration import CLASSES
from irsim.types import Floats


def slopes(picture: Floats) -> tuple[float, float, float]:
    """-d log P / d log f of the 2-D spectrum under a Hann window: over all directions, and along x and y."""
    side = min(picture.shape) // 2 * 2
    window = np.hanning(side)
    power, frequency = [], np.fft.fftfreq(side)
    for left in (0, picture.shape[1] - side):
        part = picture[:side, left : left + side].astype(float)
        power.append(np.abs(np.fft.fft2((part - part.mean()) * window * window[:, None])) ** 2)
    mean, (fx, fy) = np.mean(power, axis=0), np.meshgrid(frequency, frequency)
    edges, radius = np.geomspace(4 / side, 0.2, 16), np.hypot(fx, fy)
    rings = np.digitize(radius, edges)

    def slope(where: Floats) -> float:
        rows = [(radius[m].mean(), mean[m].mean()) for i in range(1, 16) if (m := (rings == i) & where).any()]
        x, y = np.log(np.array(rows)).T
        return float(-np.polyfit(x, y, 1)[0])

    narrow = 1.5 / side
    return slope(radius > 0), slope(np.abs(fy) < narrow), slope(np.abs(fx) < narrow)


SLOWER = [pytest.param(name, marks=pytest.mark.slow) for name in ("treeline", "countryside")]


@pytest.mark.parametrize("name", ["sky", "clouds", "ground", *SLOWER])
def test_a_scene_without_its_targets_has_the_slopes_of_its_class(name: str) -> None:
    """The median of five seeds lies within what real recordings have, not widened."""
    scene = irsim.load(name)
    bare = [f"without=[{', '.join(target.id for target in scene.targets)}]"]
    scenes = (irsim.Rendering(irsim.load(name, [*bare, f"seed={seed}"])) for seed in range(1, 6))
    found = np.median([slopes(scene.frame(75, "display").image) for scene in scenes], axis=0)
    real = CLASSES[str(scene.like)]
    low, high = np.transpose([real.beta, real.beta_x, real.beta_y])
    assert np.all(found >= low), found
    assert np.all(found <= high), found
