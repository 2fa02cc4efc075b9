"""Bad pixels are counted by kind, and nothing else is taken for one."""

from __future__ import annotations

import numpy as np
import pytest
from even_noise import rendered
from scipy.ndimage import gaussian_filter

from irsim.measure import Region, defects, measure_noise
from irsim.measure.words import noise_lines
from irsim.types import Floats


def test_bad_pixels_are_counted_by_kind() -> None:
    frames = rendered(4, (60, 64, 64), {"kind": "white"}, {"kind": "fixed_pattern"})
    frames[:, 5, 9] = 0
    frames[:, 30, 30] = frames[0, 30, 30]
    frames[:, 40, 12] += 500
    frames[10:30, 50, 50] += 200
    found = defects(frames)
    assert sorted(map(tuple, np.argwhere(found.dead).tolist())) == [(5, 9), (30, 30)]
    assert np.argwhere(found.hot).tolist() == [[40, 12]]
    assert np.argwhere(found.blinking).tolist() == [[50, 50]]
    report = measure_noise(frames, 30.0)
    assert report.terms.tvh.value == pytest.approx(10, rel=0.05)
    assert (report.dead, report.hot, report.blinking) == (2, 1, 1)


@pytest.mark.parametrize("sigma", [0.3, 0.6, 2.0])
def test_what_does_not_happen_to_change_is_not_called_dead(sigma: float) -> None:
    """Whole counts hide noise below one: in few frames good pixels hold their value, in enough only a dead one does."""
    rng = np.random.default_rng(8)
    frames = np.rint(rng.uniform(100, 101, (64, 96)) + rng.normal(0, sigma, (400, 64, 96)))
    frames[:, 20, 30] = 100
    assert ((frames[:12] == frames[0]).all(axis=0).sum() > 100) == (sigma == 0.3)  # good ones, by chance
    few = measure_noise(frames[:12], 30.0)
    assert (few.dead, few.frozen_from is not None and few.frozen_from > 12) == (0, True)
    assert any("12 frames are too few to tell dead pixels" in text for _, text in noise_lines(few))
    assert np.argwhere(defects(frames).dead).tolist() == [[20, 30]]
    assert not any("too few" in text for _, text in noise_lines(measure_noise(frames, 30.0)))


def test_where_most_pixels_never_change_none_is_called_dead_for_it() -> None:
    frames = np.full((40, 32, 32), 7.0)
    frames[5, :8] += 1
    report = measure_noise(frames, 30.0)
    assert (report.dead, report.frozen_from) == (0, None)
    assert any("most pixels never change" in text for _, text in noise_lines(report))


def test_ridges_and_tracks_are_no_bad_pixels() -> None:
    frames = rendered(7, (40, 64, 64), {"kind": "white"})
    rows, columns = np.mgrid[:64, :64]
    frames += (300 * np.exp(-np.square((rows - columns * 0.7 - 5) / 1.5))).astype(np.float32)
    for k in range(40):
        frames[k, 50, 10 + k] += 400
    assert not defects(frames).all.any()


def test_neighbours_that_blink_do_not_hide_each_other() -> None:
    """Clusters as the kind bad_pixels has them: the noise lies in its interval, or 0.6 % beside it at most."""
    bad = {"kind": "bad_pixels", "dead": 0.001, "hot": 0.001, "blinking": 0.006, "cluster": 3.0}
    found = []
    for seed in range(8):
        frames = rendered(seed, (120, 96, 96), {"kind": "white"}, bad)
        tvh = measure_noise(frames, 30.0).terms.tvh
        found.append(tvh.low <= 10 <= tvh.high)
        assert tvh.value == pytest.approx(10, rel=0.006)
    assert sum(found) >= 6
    two = rendered(1, (80, 64, 64), {"kind": "white"})
    two[20:50, 30, 30] += 120
    two[40:60, 30, 32] -= 100
    assert np.argwhere(defects(two).blinking).tolist() == [[30, 30], [30, 32]]


@pytest.mark.parametrize(("share", "cluster", "least"), [(0.0005, 2.0, 0.95), (0.005, 2.0, 0.9), (0.002, 4.0, 0.65)])
def test_hot_pixels_beside_each_other_are_found(share: float, cluster: float, least: float) -> None:
    """As the kind bad_pixels has them, but for some that are dense about their highest, as a point of light is."""
    told, alone = 0, 0
    for seed in range(4):
        bad = {"kind": "bad_pixels", "dead": 0, "hot": share, "blinking": 0, "cluster": cluster}
        frames = rendered(seed, (60, 128, 160), {"kind": "white"}, bad)
        report = measure_noise(frames, 30.0, Region(48, 32, 64, 64))
        told += report.hot
        alone += report.terms.vh.low == 0 and report.terms.vh.value < 0.1 * report.terms.tvh.value
    assert least <= told / (4 * share * 128 * 160) <= 1.05
    assert alone >= 2


@pytest.mark.parametrize("places", [[(30, 30), (30, 32)], [(30, 30), (32, 31)], [(30, 30), (30, 31), (30, 32)]])
def test_neighbours_that_are_hot_do_not_hide_each_other(places: list[tuple[int, int]]) -> None:
    frames = np.random.default_rng(0).normal(1000, 4, (40, 64, 64))
    for row, column in places:
        frames[:, row, column] += 400
    assert [tuple(place) for place in np.argwhere(defects(frames).hot)] == places


@pytest.mark.parametrize("level", [0, 500, 1600, 8000])
def test_a_pixel_that_never_changes_is_dead_wherever_it_stands(level: float) -> None:
    frames = np.rint(np.random.default_rng(0).normal(1000, 4, (40, 64, 64)))
    frames[:, 20, 30] = level
    frames[:, 40, 40] += 600
    found = defects(frames, 16383.0)
    assert np.argwhere(found.dead).tolist() == [[20, 30]]
    assert np.argwhere(found.hot).tolist() == [[40, 40]]


@pytest.mark.parametrize(("level", "count"), [(30001, 1000), (8001, 3000), (300.01, 100)])
def test_a_bright_pixel_that_never_changes_is_dead_however_long_it_is_seen(level: float, count: int) -> None:
    """Sums of 2^24 and more lose what is below one in float32."""
    frames = np.random.default_rng(0).normal(level - 100, 4, (count, 16, 16))
    frames[:, 8, 5] = level
    assert np.argwhere(defects(frames).dead).tolist() == [[8, 5]]


@pytest.mark.filterwarnings("error")
def test_of_one_frame_no_pixel_is_called_dead() -> None:
    assert not defects(np.ones((1, 8, 8))).dead.any()


def test_light_that_flickers_is_no_blinking_pixel() -> None:
    rows, columns = np.mgrid[:64, :64]
    light = np.exp(-(np.square(rows - 30.3) + np.square(columns - 30.4)) / (2 * 2.0**2))
    frames = rendered(2, (80, 64, 64), {"kind": "white"})
    frames[::2] += (150 * light).astype(np.float32)
    assert not defects(frames).blinking.any()


SIZE = (150, 200)
PLACES = [(0, 0), (0, 199), (1, 20), (0, 40), (0, 41), (149, 33), (149, 199), (148, 50), (120, 0), (101, 198), (60, 90)]


@pytest.mark.parametrize("seed", range(4))
def test_a_textured_scene_has_no_bad_pixels_at_its_edge_but_the_true_ones(seed: int) -> None:
    """A slope that ends at the edge is seen from one side only: three of these scenes had false ones there."""
    rng = np.random.default_rng(seed)
    texture = gaussian_filter(rng.normal(size=SIZE), [2, 4])
    rows, columns = np.mgrid[: SIZE[0], : SIZE[1]]
    land = rows > 95 + 6 * np.sin(columns / 17)
    frames = 2000 + np.where(land, 250 + 60 * texture / texture.std(), 0) + rng.normal(0, 4, (20, *SIZE))
    assert not defects(frames).all.any()
    for height, kind in ((1500, "hot"), (-1500, "dead")):
        spoilt = frames.copy()
        spoilt[:, *np.transpose(PLACES)] += height
        assert sorted(map(tuple, np.argwhere(getattr(defects(spoilt), kind)).tolist())) == sorted(PLACES)


@pytest.mark.parametrize("speed_px", [1.0, 1.7, 2.5, 4.0, 7.0])
def test_a_point_that_passes_leaves_no_bad_pixels_and_hides_none(speed_px: float) -> None:
    """Fast ones light up a pixel here and a pixel there, each for a frame."""
    from irsim.physics.psf import GaussianPSF

    shape, spread = (60, 64, 96), GaussianPSF(0.6)
    frames = rendered(5, shape, {"kind": "white"})
    frames[10:30, 50, 50] += 300  # two that do blink: one of them once
    frames[20:31:5, 20, 70] += 300
    for k in range(shape[0]):
        x, y = 3.3 + speed_px * k, 20.4 + 0.31 * k
        frames[k] += 4000 * spread.pixel_integral(np.arange(64) - y, np.arange(96) - x)
    assert sorted(map(tuple, np.argwhere(defects(frames).all).tolist())) == [(20, 70), (50, 50)]


def test_what_targets_of_the_truth_do_is_not_counted() -> None:
    frames = rendered(6, (60, 64, 96), {"kind": "white"})
    frames[:, 10, 20] += 500  # a hot pixel
    frames[:, 40, 60] += 500  # a target that stands
    frames[15:30, 42, 66] += 500  # one that flickers
    taken = np.zeros((64, 96), bool)
    taken[36:48, 56:70] = True
    assert (measure_noise(frames, 30.0).hot, measure_noise(frames, 30.0).blinking) == (2, 1)
    report = measure_noise(frames, 30.0, taken=taken)
    assert (report.hot, report.blinking, report.pixels) == (1, 0, 64 * 96 - 12 * 14)
    nearly_all = np.ones((64, 96), bool)
    assert measure_noise(frames, 30.0, taken=nearly_all).hot == 2


def test_what_a_still_scene_hides_is_told() -> None:
    """Hot pixels of 20 sigmas: found where the picture is even, missed in the third that is textured."""
    rng = np.random.default_rng(5)
    frames = rendered(6, (60, 96, 96), {"kind": "white"})
    frames[:, :, 64:] += 60 * rng.standard_normal((96, 32)).astype(np.float32)
    places = [(row, column) for row in range(8, 90, 12) for column in (8, 20, 32, 44, 74, 86)]
    for row, column in places:
        frames[:, row, column] = frames[:, row, column - 1] + 200
    report = measure_noise(frames, 30.0)
    assert report.uneven == pytest.approx(1 / 3, abs=0.04)
    assert 300 < report.uneven_by < 1500
    hot = {(row, column) for row, column in np.argwhere(defects(frames).hot).tolist()}
    assert hot & set(places) == {place for place in places if place[1] < 64}
    assert len(hot - set(places)) <= 1  # the sharpest of the texture, at its edge
    (line,) = [text for _, text in noise_lines(report) if "the scene differs" in text]
    assert f"stand out by {report.uneven_by:.3g} counts" in line
    for row, column in places:
        frames[:, row, column] += 2 * report.uneven_by
    assert defects(frames).hot.sum() > 0.9 * len(places)


def test_rows_and_columns_of_a_camera_hide_no_hot_pixels() -> None:
    """Rows of 2 NETD hid 26 of 90 hot pixels of 20, and 5 % of the picture was said to be the scene's."""
    frames = rendered(3, (60, 96, 128), {"kind": "white"}, {"kind": "fixed_pattern", "pixel": 0.3, "row": 2})
    frames[:, 8:90:9, 5:120:13] += 200
    found = defects(frames)
    assert found.hot[8:90:9, 5:120:13].all()
    assert found.hot.sum() == 90
    assert measure_noise(frames, 30.0).uneven < 0.01


def test_noise_and_fixed_pattern_hide_no_hot_pixels() -> None:
    for kinds in ([{"kind": "white"}], [{"kind": "white"}, {"kind": "fixed_pattern"}]):
        report = measure_noise(rendered(4, (60, 96, 96), *kinds), 30.0)
        assert report.uneven < 0.002  # median of 25 px, by chance
        assert not any("the scene differs" in text for _, text in noise_lines(report))


def to_and_fro(sigmas: float, seed: int) -> Floats:
    """120 frames of white noise of 10 counts and pixels, 50 up and 50 down, that are so many sigmas off for 5 of 6 of
    the time; 40 more, whose noise is 2.5 times as much, are hot by 15 sigmas."""
    rng = np.random.default_rng(seed)
    frames = rendered(seed, (120, 96, 128), {"kind": "white"}, {"kind": "fixed_pattern", "pixel": 0.3})
    away = np.repeat(rng.random((24, 60)) < 5 / 6, 5, axis=0)
    frames[:, 6:66:6, 6:66:12] += 10 * sigmas * away[:, :50].reshape(120, 10, 5)
    frames[:, 6:66:6, 12:72:12] -= 10 * sigmas * away[:, 10:].reshape(120, 10, 5)
    frames[:, 72:92:5, 6:126:12] += 150 + 10 * np.sqrt(2.5**2 - 1) * rng.standard_normal((120, 4, 10))
    return frames


@pytest.mark.parametrize("sigmas", [5.0, 6.0, 7.0])
def test_what_blinks_by_little_is_neither_hot_nor_dead(sigmas: float) -> None:
    """Of 50 up and 50 down 70 to 97 were hot or dead; some are on their own level in no frame or in few. The others are
    patched, and hot ones of more noise stay hot."""
    for seed in range(3):
        frames = to_and_fro(sigmas, seed)
        found = defects(frames)
        assert found.hot[:70].sum() + found.dead.sum() < 30
        assert found.faint.sum() > 50
        assert not (found.faint & (found.hot | found.dead | found.blinking)).any()
        assert found.hot[72:92:5, 6:126:12].all()
        assert found.all[found.faint].all()
        assert not found.where(~found.faint).faint.any()
