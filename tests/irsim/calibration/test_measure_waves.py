"""What moves in a scene is not named a bad pixel, and what it hides is not said to be 0."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from even_noise import rendered

import irsim
from irsim.camera.bad_pixels import clustered_pixels
from irsim.measure import defects, measure_figures, measure_noise
from irsim.measure.noise_3d import TERMS
from irsim.measure.words import noise_lines
from irsim.physics.psf import GaussianPSF
from irsim.types import Floats

CAMERA = """\
frames: 60
seed: SEED
camera:
  size: [192, 144]
  ifov_mrad: 0.4
  elevation_deg: ELEVATION
  band: BAND
  range_k: [210, 350]
  psf_px: 0.5
  netd_mk: 40
  noise: [{kind: white}, {kind: fixed_pattern, pixel: 0.3, row: 0.2, column: 0.2}, {kind: bad_pixels, BAD}]
background:
"""
SCENES = {
    "waves": ("-1.2", "lwir", "  {kind: sea, zenith_k: 225, camera_height_m: 18, water_k: 286, wind_m_s: 6}"),
    "glitter": ("-1", "mwir", "  {kind: sea, zenith_k: 225, water_k: 286, wind_m_s: 3, sun_deg: [4, 15]}"),
    "clouds": (
        "10",
        "mwir",
        "  kind: sky\n  clouds:\n"
        "    - {id: high, coverage: 0.5, temperature_k: 262, evolve_s: 20, wind_mrad_s: [2, 0]}\n"
        "    - {id: low, coverage: 0.3, temperature_k: 270, sunlit_k: 8, range_m: 2500, wind_mrad_s: [8, 0.3]}",
    ),
}
SHARES = {"dead": 0.0005, "hot": 0.001, "blinking": 0.001}
NONE = "dead: 0, hot: 0, blinking: 0"


@lru_cache
def filmed(scene: str, seed: int, bad: str = NONE) -> Floats:
    elevation, band, background = SCENES[scene]
    given = (("SEED", str(seed)), ("ELEVATION", elevation), ("BAND", band), ("BAD", bad))
    text = CAMERA
    for word, value in given:
        text = text.replace(word, value)
    scenario = irsim.loads(text + background + "\n")
    return np.stack([frame.image for frame in irsim.Rendering(scenario).frames("counts")])


@pytest.mark.sampled
@pytest.mark.parametrize(("scene", "most"), [("waves", 1), ("glitter", 8), ("clouds", 1)])
def test_what_moves_is_no_bad_pixel(scene: str, most: int) -> None:
    """In six pictures: 50 of each seemed to blink before waves. A horizon cuts off the blur of glitter beside it."""
    found = [defects(filmed(scene, seed), 2.0**14 - 1).all.sum() for seed in range(6)]
    assert sum(found) <= most


@pytest.mark.sampled
@pytest.mark.parametrize("scene", ["waves", "clouds"])
def test_bad_pixels_are_found_before_what_moves(scene: str) -> None:
    """All dead ones, most hot ones: they have at least 150 times the noise."""
    shape = (144, 192)
    hits = dict.fromkeys(SHARES, 0.0)
    for seed in range(3):
        bad = ", ".join(f"{kind}: {share}" for kind, share in SHARES.items()) + ", hot_ratio: 300"
        found = defects(filmed(scene, seed, bad))
        at = {kind: clustered_pixels(shape, share, 2.0, seed, "bad_pixels", kind) for kind, share in SHARES.items()}
        for kind in hits:
            hits[kind] += float(getattr(found, kind).ravel()[at[kind]].mean()) / 3
        true = np.concatenate(list(at.values()))
        assert np.isin(np.flatnonzero(found.all), true).all()
    assert hits["dead"] == 1
    assert hits["hot"] > 0.5


@pytest.mark.parametrize("place", [(30.0, 40.0), (30.5, 40.0), (30.0, 40.5)])
@pytest.mark.parametrize("psf", [0.47, 0.7])
def test_a_point_that_stands_is_no_hot_or_cold_pixel(place: tuple[float, float], psf: float) -> None:
    light = GaussianPSF(psf).pixel_integral(np.arange(64) - place[0], np.arange(64) - place[1])
    frames = rendered(3, (30, 64, 64), {"kind": "white"})
    for height in (600, -600):
        assert not defects(frames + np.float32(height) * light).all.any()


@pytest.mark.parametrize("psf", [0.4, 0.7])
def test_a_point_that_flickers_is_no_blinking_pixel(psf: float) -> None:
    light = GaussianPSF(psf).pixel_integral(np.arange(64) - 30.1, np.arange(64) - 40.2)
    frames = rendered(3, (60, 64, 64), {"kind": "white"})
    frames[np.random.default_rng(1).random(60) < 0.3] += np.float32(600) * light.astype(np.float32)
    assert not defects(frames).all.any()


CLUSTERS = [
    [(0, 0), (0, 1)],
    [(0, 0), (0, 1), (1, 1)],
    [(0, 0), (0, 1), (1, 0), (1, 1)],
]


@pytest.mark.parametrize("cluster", CLUSTERS, ids=len)
def test_clusters_of_bad_pixels_are_no_light(cluster: list[tuple[int, int]]) -> None:
    heights = np.random.default_rng(5).uniform(500, 1500, len(cluster))
    rows, columns = np.transpose(cluster) + np.array([[30], [40]])
    for sign, kind in ((1, "hot"), (-1, "dead")):
        frames = rendered(3, (30, 64, 64), {"kind": "white"})
        frames[:, rows, columns] += sign * heights
        assert sorted(np.argwhere(getattr(defects(frames), kind)).tolist()) == sorted(
            map(list, zip(rows, columns, strict=True))
        )


@pytest.mark.sampled
@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (2, 3))])
def test_what_waves_hide_is_not_said_to_be_nothing(seed: int) -> None:
    """Rows of a fifth of the NETD were told as 0 (0 to 0), or as twenty times that with an interval far above."""
    frames = filmed("waves", seed)
    report = measure_noise(frames, 30.0, top=2.0**14 - 1)
    for term in TERMS:
        found = getattr(report.terms, term)
        assert found.low <= found.value <= found.high
        assert found.high > 0
        assert not report.moving or found.low == 0
    figures = measure_figures(frames, 30.0, top=2.0**14 - 1)
    netd = irsim.load("sea", ["camera.range_k=[210,350]"]).camera.response()
    sigma = netd.noise / netd.gain
    for found, share in ((figures.pixel, 0.3), (figures.row, 0.2), (figures.column, 0.2)):
        assert found is None or (found.low == 0 and share * sigma <= found.high)
    assert report.hidden > 0.3
    told = [text for _, text in noise_lines(report)]
    assert any("by more than the noise: pixels that blink there cannot" in text for text in told)
    assert any("pixels that blink there cannot" in note for note in figures.notes) != report.slides


def test_what_a_whole_frame_has_in_common_hides_nothing() -> None:
    frames = rendered(3, (60, 64, 64), {"kind": "white"})
    wandering = frames + 40 * np.sin(np.arange(60) / 9).astype(np.float32)[:, None, None]
    assert measure_noise(wandering, 30.0).hidden == 0


def test_what_is_full_of_light_is_not_dead() -> None:
    """Glitter fills its pixels, and dips between them for a frame or two."""
    frames = rendered(3, (60, 64, 64), {"kind": "white"})
    frames[:, 20:40, 20:40] = 4095
    frames[7:9, 30, 30] = 3000
    assert not defects(frames, 4095).all.any()
    assert defects(frames).all.sum() > 100
