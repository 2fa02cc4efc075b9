"""Video of a camera core: noise reduction, detail enhancement, encoding; a frame alone is the one in sequence."""

from __future__ import annotations

import sys
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import pytest

import irsim
from irsim._native import COMPILED
from irsim.camera import AGCS, detail, temporal_filter
from irsim.camera.agc import Agc, AgcSequence, Picture
from irsim.camera.detail import DetailEnhancement
from irsim.camera.encoding import H264, EncodedSequence, _Group
from irsim.camera.temporal_filter import FilterSequence, TemporalFilter
from irsim.camera.video import Video
from irsim.errors import InputError

Counts = npt.NDArray[np.uint16]
BASE = {"kind": "plateau", "time_constant_frames": 0.4}
FAST = {"gain": 0.6, "motion_counts": 50.0}
STAGES: dict[str, dict[str, Any]] = {
    "noise reduction": {"noise_reduction": FAST},
    "detail": {"detail": {"radius_px": 4}},
    "encoding": {"encoding": {"group_frames": 5}},
    "all": {"noise_reduction": FAST, "detail": {"radius_px": 4}, "encoding": {"group_frames": 5}},
}


def parsed(keys: dict[str, Any]) -> Agc:
    found = AGCS.parse(keys)
    assert isinstance(found, Agc)
    return found


def noise(count: int, shape: tuple[int, int] = (30, 45), sigma: float = 8.0) -> list[Counts]:
    """Return frames of a slope with white noise."""
    rng = np.random.default_rng(5)
    slope = np.linspace(4000, 4600, shape[1])
    return [np.rint(slope + rng.normal(0, sigma, shape)).astype(np.uint16) for _ in range(count)]


@pytest.mark.parametrize("stage", STAGES)
def test_a_frame_alone_is_the_one_in_sequence(stage: str) -> None:
    frames, agc = noise(24), parsed({"kind": "video", "base": BASE, **STAGES[stage]})

    def none(index: int) -> Counts:
        raise AssertionError("in order no counts are fetched")

    in_order = AgcSequence(agc, 14, none)
    expected = [in_order.picture(counts, k) for k, counts in enumerate(frames)]
    jumping = AgcSequence(agc, 14, frames.__getitem__)
    for k in (17, 18, 3, 23, 22, 0):
        np.testing.assert_array_equal(jumping.picture(frames[k], k), expected[k])
        alone = AgcSequence(agc, 14, frames.__getitem__).picture(frames[k], k)
        np.testing.assert_array_equal(alone, expected[k])
    np.testing.assert_array_equal(agc.display(frames[0], 14), expected[0])


def test_without_stages_the_picture_is_that_of_the_base() -> None:
    frames = noise(8)
    base, video = (AgcSequence(parsed(agc), 14, frames.__getitem__) for agc in (BASE, {"kind": "video", "base": BASE}))
    for k, counts in enumerate(frames):
        np.testing.assert_array_equal(base.picture(counts, k), video.picture(counts, k))


@pytest.mark.parametrize("gain", [0.1, 0.3])
def test_noise_falls_as_that_of_a_first_order_filter(gain: float) -> None:
    """To sqrt(gain / (2 - gain)), with a correlation of 1 - gain between frames, and no seam where runs change."""
    reduction = TemporalFilter(gain=gain, motion_counts=65_535)
    frames, sequence = noise(4 * reduction.warm_up, (60, 80)), FilterSequence(reduction)
    filtered = np.stack([sequence.frame(k, frames.__getitem__) for k in range(len(frames))])
    late = (filtered - filtered.mean(axis=0))[2 * reduction.warm_up - 3 :]
    sigmas = np.stack([each - np.linspace(4000, 4600, 80) for each in filtered]).std(axis=(1, 2))
    expected = 8.0 * np.sqrt(gain / (2 - gain))
    np.testing.assert_allclose(sigmas[2 * reduction.warm_up - 3 :], expected, rtol=0.06)
    correlation = np.mean(late[1:] * late[:-1]) / np.mean(late * late)
    assert correlation == pytest.approx(1 - gain, abs=0.12)


def test_a_moving_body_leaves_no_trail() -> None:
    frames = noise(30, (40, 120), 3.0)
    for k, counts in enumerate(frames):
        counts[15:25, 3 * k : 3 * k + 10] += 400
    kept = {gain: FilterSequence(TemporalFilter(gain=0.1, motion_counts=gain)) for gain in (30.0, 65_535.0)}
    for k in range(30):
        found = {each: sequence.frame(k, frames.__getitem__) for each, sequence in kept.items()}
    level = np.linspace(4000, 4600, 120)[70:80]
    trail = {each: (picture[18:22, 70:80] - level).mean() for each, picture in found.items()}
    assert abs(trail[30.0]) < 5 < 50 < trail[65_535.0]


def test_detail_is_amplified_and_large_steps_are_kept() -> None:
    x = np.arange(96)
    ripple = 4000 + 6 * np.sin(2 * np.pi * x / 6) * np.ones((64, 1))
    step = np.where(x < 48, 4000.0, 8000.0) * np.ones((64, 1))
    enhance = DetailEnhancement(gain=3, radius_px=8, edge_counts=60)
    found = enhance.enhance(ripple.astype(np.float32), 14).astype(float)
    assert found[:, 20:-20].std() == pytest.approx(3 * ripple[:, 20:-20].std(), rel=0.1)
    flat = enhance.enhance(step.astype(np.float32), 14).astype(float)
    assert np.abs(flat - step).max() < 2 * 0.08 * 4000
    halo = DetailEnhancement(gain=3, radius_px=8, edge_counts=4000).enhance(step.astype(np.float32), 14).astype(float)
    assert halo[32, 50] > 8000 + 0.3 * 4000
    assert halo[32, 45] < 4000 - 0.3 * 4000
    assert abs(halo[32, 90] - 8000) < 2, "the halo is as wide as the windows"


def test_enhanced_counts_are_clipped_to_the_bit_depth() -> None:
    counts = np.where(np.arange(64) % 2, 1.0, 1022.0) * np.ones((48, 1))
    found = DetailEnhancement(gain=10, edge_counts=60_000).enhance(counts.astype(np.float32), 10)
    assert (found.min(), found.max()) == (0, 1023)


@pytest.mark.parametrize("shape", [(30, 45), (16, 16), (1, 7), (67, 1)])
def test_compiled_stages_equal_plain_ones(shape: tuple[int, int], monkeypatch: pytest.MonkeyPatch) -> None:
    frames = noise(3, shape)
    found = []
    for compiled in (COMPILED, False):
        monkeypatch.setattr(temporal_filter, "COMPILED", compiled)
        monkeypatch.setattr(detail, "COMPILED", compiled)
        sequence = FilterSequence(TemporalFilter())
        filtered = [sequence.frame(k, frames.__getitem__) for k in range(3)][-1]
        found.append((filtered, DetailEnhancement(radius_px=5).enhance(filtered, 14)))
    for compiled_stage, plain in zip(*found, strict=True):
        np.testing.assert_array_equal(compiled_stage, plain)


@pytest.mark.parametrize("rate", [0.05, 0.4])
def test_the_rate_of_h264_is_kept(rate: float) -> None:
    blurred = [cv2.GaussianBlur(each, (0, 0), 1.0) for each in noise(20, (96, 128), 200.0)]
    pictures: list[Picture] = [np.right_shift(each, 5, dtype=np.uint16).astype(np.uint8) for each in blurred]
    settings = H264(bits_per_pixel=rate, group_frames=20)
    group = _Group(settings, pictures[0].shape)
    decoded = [group.coded(each) for each in pictures]
    assert 8 * group.bytes / (20 * 96 * 128) == pytest.approx(rate, rel=0.25)
    error = np.mean([(a.astype(float) - b) ** 2 for a, b in zip(decoded, pictures, strict=True)])
    assert 0 < error < 0.5 * np.var(pictures[0])


def test_less_quality_costs_fewer_bytes() -> None:
    pictures = [(each >> 5).astype(np.uint8) for each in noise(4, (64, 64), 100.0)]
    sizes = []
    for crf in (15.0, 40.0):
        group = _Group(H264(crf=crf, bits_per_pixel=8), (64, 64))
        for picture in pictures:
            group.coded(picture)
        sizes.append(group.bytes)
    assert sizes[1] < 0.5 * sizes[0]


def test_pictures_of_odd_sides_are_encoded() -> None:
    picture = noise(1, (17, 21))[0].astype(np.uint8)
    assert EncodedSequence(H264()).frame(0, lambda k: picture).shape == (17, 21)


def test_encoding_without_pyav_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(InputError, match=r"^camera\.agc\.encoding needs PyAV: pip install 'irtrack\[video\]'"):
        Video(encoding=H264()).display(noise(1)[0], 14)


@pytest.mark.parametrize("preset", ["uncooled_video", "uncooled_stream"])
def test_presets_deliver_video(preset: str) -> None:
    changes = [f"camera={{preset: {preset}, size: [64, 48]}}", "frames=40"]
    source = irsim.Rendering(irsim.load("sky", changes))
    assert isinstance(source.agc, Video)
    pictures = [frame.image for frame in source.frames("display", 0, 40)]
    np.testing.assert_array_equal(pictures[37], irsim.Rendering(source.scenario).frame(37, "display").image)
    assert pictures[0].dtype == np.uint8
