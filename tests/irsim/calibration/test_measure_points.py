"""The blur is read off points, passing and still; bad pixels and what is full are told from them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from even_noise import rendered
from scipy.special import ndtr

import irsim
from irsim.measure import defects, measure_figures, points
from irsim.measure.points import LEAST_POINT_FRAMES, POINT_REACH, Spot, _median, _on_all_sides, fitted, point_blur
from irsim.measure.still import still_things
from irsim.types import Floats

POINT = """\
frames: 40
camera: {size: [160, 128], psf_px: PSF}
background: {kind: ground, spread_k: 0.3}
targets:
  - id: a
    shape: {kind: point, area_m2: AREA, temperature_k: 700}
    path: {kind: straight, start: [20.3, 60.2], speed: 1.3, heading_deg: 10, range_m: 2000}
"""


@pytest.mark.sampled
@pytest.mark.parametrize("psf_px", [0.5, 0.8, 1.2])
def test_the_blur_is_read_off_a_point(psf_px: float) -> None:
    fitted = irsim.fit(irsim.loads(POINT.replace("PSF", str(psf_px)).replace("AREA", "0.02")))
    found = fitted.figures.blur
    assert found is not None
    assert found.value == pytest.approx(psf_px, rel=0.05)
    assert any("its own size among it" in note for note in fitted.notes)


def test_a_point_that_fills_its_pixels_gives_no_blur() -> None:
    """Its top is cut off, so it looks wider: 0.66 px for a blur of 0.47 px."""
    text = POINT.replace("AREA", "0.004").replace("psf_px: PSF", "preset: cooled_mwir")
    assert irsim.fit(irsim.loads(text)).figures.blur is None
    found = irsim.fit(irsim.loads(text.replace("0.004", "0.0003"))).figures.blur
    assert found is not None
    assert found.value == pytest.approx(0.47, rel=0.05)


def test_where_points_that_pass_are_not_looked_for_only_what_hangs_on_the_blur_is_less_sure() -> None:
    text = POINT.replace("PSF", "0.5").replace("AREA", "0.02").replace("spread_k: 0.3", "spread_k: 2")
    scene = irsim.Rendering(irsim.loads(text))
    frames = np.stack([frame.image for frame in scene.frames()])
    seen, unseen = (measure_figures(frames, scene.rate_hz, passing=passing) for passing in (True, False))
    assert seen.blur is not None
    assert (unseen.blur, unseen.psf.low, unseen.psf.high) == (None, 0.4, 0.8)
    assert seen.pixel is not None
    assert unseen.pixel is not None
    assert unseen.pixel.high - unseen.pixel.low > seen.pixel.high - seen.pixel.low
    same = ("noise", "white", "memory", "row_noise", "column_noise", "level", "level_frames")
    assert [getattr(unseen, name) for name in same] == [getattr(seen, name) for name in same]


def test_what_is_no_point_gives_no_blur() -> None:
    rng = np.random.default_rng(0)
    frames = rng.normal(100, 1, (8, 64, 64))
    frames[:, 20:26, 30:36] += 500  # a square
    frames[:, 50, 50] += 500  # one pixel
    assert point_blur(frames, np.zeros((64, 64), bool)) is None


def test_an_edge_all_across_the_picture_takes_no_fits(monkeypatch: pytest.MonkeyPatch) -> None:
    frames = np.random.default_rng(0).normal(100, 1, (8, 96, 128))
    frames[:, :, 60:69] += 500
    fits: list[Floats] = []

    def counted(window: Floats) -> Spot:
        fits.append(window)
        return fitted(window)

    monkeypatch.setattr(points, "fitted", counted)
    assert point_blur(frames, np.zeros((96, 128), bool)) is None
    assert not fits
    frames[:, 40, 20], frames[:, 40, 19], frames[:, 40, 21] = 1100, 600, 600
    point_blur(frames, np.zeros((96, 128), bool))
    assert len(fits) == 8


@pytest.mark.parametrize("sigma", [0.5, 0.7, 1.2, 1.6])
@pytest.mark.parametrize("off", [(0.0, 0.0), (0.5, 0.5), (-0.5, 0.2)])
def test_a_point_on_a_slope_beside_another_is_not_left_out_before_it_is_fitted(
    sigma: float, off: tuple[float, float]
) -> None:
    edges = np.arange(-POINT_REACH, POINT_REACH + 2) - 0.5
    shares = np.outer(*(np.diff(ndtr((edges - at) / sigma)) for at in off))
    window = 500 * shares / shares.max() + np.random.default_rng(0).normal(0, 10, shares.shape)
    window[2:5, -1] += 60
    assert _on_all_sides(window + 100 * np.arange(len(window)))
    assert fitted(window).is_point


@pytest.mark.parametrize("count", [LEAST_POINT_FRAMES, 15, 20, 48])
def test_the_median_lies_between_two_of_the_samples_at_the_stated_rate(count: int) -> None:
    """0.95 at least; the next nearer two of them hold it less often. 600 draws tell that within 0.036, four sigmas."""
    drawn = np.sort(np.random.default_rng(count).exponential(1.0, (600, count)))
    found = [_median(ordered) for ordered in drawn]
    held = np.mean([each.low <= math.log(2) <= each.high for each in found])  # the law's own median
    assert held > 0.95 - 0.036
    assert np.mean([each.value for each in found]) == pytest.approx(math.log(2), abs=0.1)
    nearer = [ordered[(ordered > each.low) & (ordered < each.high)] for ordered, each in zip(drawn, found, strict=True)]
    assert np.mean([inner[0] <= math.log(2) <= inner[-1] for inner in nearer]) < 0.95


STILL = """\
frames: 60
seed: 4
camera:
  size: [192, 160]
  band: lwir
  range_k: [260, 340]
  netd_mk: 60
  psf_px: 0.8
  noise:
    - {kind: white}
    - {kind: fixed_pattern, pixel: 0.4}
    - {kind: bad_pixels, dead: 0.001, hot: 0.001, blinking: 0.0015}
background: {kind: sky, horizon_k: 285, zenith_k: 284}
targets:
  - id: p
    shape: {kind: point, temperature_k: 900, area_m2: AREA}
    path: {kind: straight, start: [60.3, 70.6], speed: 0.0, range_m: 1500}
"""


@pytest.mark.parametrize("area_m2", [0.01, 0.03])
def test_a_still_point_tells_the_blur_and_is_no_fixed_pattern(area_m2: float) -> None:
    """In the fixed pattern it made 0.7 and 1.7 of the noise, for 0.4."""
    found = irsim.fit(irsim.loads(STILL.replace("AREA", str(area_m2))))
    figures = found.figures
    assert figures.blur is not None
    assert figures.blur.low <= 0.8 <= figures.blur.high
    assert figures.blur.high - figures.blur.low < 0.08
    assert figures.pixel is not None
    assert figures.pixel.value / figures.noise.value == pytest.approx(0.4, rel=0.05)
    assert any(note.startswith("points that stand still: 1") for note in found.notes)


@pytest.mark.sampled
@pytest.mark.parametrize("area_m2", [0.1, 0.3])
def test_a_still_point_that_fills_its_pixels_is_no_fixed_pattern(area_m2: float) -> None:
    """It made 2.7 and 7.7 of the noise, and dead pixels, since what is full never changes."""
    found = irsim.fit(irsim.loads(STILL.replace("AREA", str(area_m2))))
    without = irsim.fit(irsim.loads(STILL.replace("AREA", "0.000001"))).figures
    assert found.figures.blur is None
    assert found.figures.pixel is not None
    assert found.figures.pixel.value / found.figures.noise.value == pytest.approx(0.4, rel=0.05)
    assert found.figures.flaws.dead.value == pytest.approx(without.flaws.dead.value, rel=0.01)
    assert found.figures.flaws.hot.value == pytest.approx(without.flaws.hot.value, rel=0.01)
    assert any(" full of light all the time" in note for note in found.notes)


def clustered(seed: int, size: float) -> Floats:
    """Frames (8, 256, 256) with clusters of hot pixels, of exponential heights."""
    bad = {"kind": "bad_pixels", "dead": 0.0005, "hot": 0.005, "blinking": 0.0005, "cluster": size}
    return rendered(seed, (8, 256, 256), {"kind": "white"}, bad)


@pytest.mark.sampled
@pytest.mark.parametrize(("seed", "size"), [(2, 4.0), (4, 4.0), (5, 2.0)])
def test_clusters_of_hot_pixels_are_no_points(seed: int, size: float) -> None:
    frames = clustered(seed, size)
    bad = defects(frames)
    assert bad.hot.sum() > 100
    still = still_things(frames, bad, 2.0**14 - 1)
    assert not still.points
    assert (still.spared(bad).hot == bad.hot).all()


@pytest.mark.parametrize("beside", [[], [(0, 1)], [(0, 1), (1, 0)], [(0, 1), (1, 0), (1, 1)]])
def test_pixels_stuck_at_the_top_are_dead_and_not_full_of_light(beside: list[tuple[int, int]]) -> None:
    frames = rendered(4, (40, 64, 64), {"kind": "white"})
    for row, column in [(0, 0), *beside]:
        frames[:, 30 + row, 30 + column] = 16383
    bad = defects(frames)
    still = still_things(frames, bad, 2.0**14 - 1)
    assert not still.all.any()
    assert still.spared(bad).dead.sum() + still.spared(bad).hot.sum() == 1 + len(beside)
