"""Contract of every kind of detector."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from detector_frames import LEVEL, NOISE, PLACES, last, noise_frame, offsets, write_onnx

import irsim
from irsim.types import Frame
from irtrack.detectors import DETECTORS, FilterDetector, make_detector
from irtrack.detectors.matched_filter import point_image
from irtrack.errors import InputError
from irtrack.validity import fault_of_detections

FILTERS = [name for name, kind in DETECTORS.items() if issubclass(kind, FilterDetector)]
LINEAR = [name for name in FILTERS if DETECTORS[name].is_linear]  # type: ignore[attr-defined]  # all filters have it


@pytest.fixture(scope="module")
def network(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A convolution whose output is z of a point in white noise of a frame of 14 bits."""
    kernel = point_image(1.0, 7)
    kernel -= kernel.mean()
    scale = (2**14 - 1) / NOISE / np.sqrt(np.square(kernel).sum())
    return write_onnx(tmp_path_factory.mktemp("onnx") / "point.onnx", scale * kernel)


@pytest.fixture(params=DETECTORS)
def detector(request: pytest.FixtureRequest, network: str) -> Any:
    name = request.param
    return made(name, **({"file": network, "threshold": 5.5} if name == "onnx" else {}))


def made(name: str, **parameters: Any) -> Any:
    """The detector for frames of 96x80, where a target is among the five largest singular parts."""
    return make_detector(name, ({"components": 1} if name == "svd" else {}) | parameters)


def changed(frame: Frame, image: Any) -> Frame:
    return Frame(np.ascontiguousarray(image), frame.index, frame.time, frame.bits)


def test_finds_points_of_scr_10(detector: Any) -> None:
    found = last(detector, noise_frame(1), noise_frame(2, scr=10))
    assert fault_of_detections(found) is None
    assert np.abs(offsets(found, PLACES)).max() < 1
    assert len(found) <= len(PLACES) + 1
    assert (np.diff(found.scores) <= 0).all()


def test_repeats_and_leaves_its_input(detector: Any) -> None:
    first, second = noise_frame(1), noise_frame(2, scr=10)
    before = second.image.copy()
    second.image.setflags(write=False)
    state, _ = detector.step(None, first)
    one, two = detector.step(state, second)[1], detector.step(state, second)[1]
    assert (second.image == before).all()
    for name in ("centers", "sizes", "scores"):
        assert np.array_equal(getattr(one, name), getattr(two, name))


@pytest.mark.parametrize("level", [0, 255, 65535])
def test_constant_frames_give_no_detections(detector: Any, level: int) -> None:
    frame = Frame(np.full((40, 50), level, np.uint16), 0, 0.0, 16)
    assert len(last(detector, frame, frame)) == 0


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("shape", [(1, 1), (1, 40), (40, 1), (2, 3), (5, 5), (130, 131)])
def test_any_size_and_depth(detector: Any, dtype: Any, shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(0)
    frames = [Frame(rng.integers(0, 200, shape).astype(dtype), k, k / 30, 8) for k in range(3)]
    found = last(detector, *frames)
    assert fault_of_detections(found) is None
    assert ((found.centers > -1) & (found.centers < np.array(shape)[::-1])).all()


@pytest.mark.parametrize("image", [np.zeros((0, 5), np.uint8), np.zeros((5, 5)), np.zeros((5, 5, 3), np.uint8)])
def test_other_images_are_an_error(detector: Any, image: Any) -> None:
    with pytest.raises(InputError, match=r"allowed: \(rows, cols\) of uint8 or uint16"):
        detector.step(None, Frame(image, 0, 0.0, 8))


@pytest.mark.parametrize("motion", ["shift", "flip", "turn"])
def test_detections_move_with_the_frame(detector: Any, motion: str) -> None:
    frames = [noise_frame(1), noise_frame(2, scr=15)]
    places = np.array(PLACES)
    if motion == "shift":
        moved = [changed(frame, np.roll(frame.image, (7, -5), (0, 1))) for frame in frames]
        places = places + np.array((-5, 7))
    elif motion == "flip":
        moved = [changed(frame, frame.image[:, ::-1]) for frame in frames]
        places = np.stack([95 - places[:, 0], places[:, 1]], axis=1)
    else:
        moved = [changed(frame, frame.image.T) for frame in frames]
        places = places[:, ::-1]
    here, there = offsets(last(detector, *frames), PLACES), offsets(last(detector, *moved), places)
    expected = here * ((-1, 1) if motion == "flip" else (1, 1))
    expected = expected[:, ::-1] if motion == "turn" else expected
    # A random projection takes other parts of noise, and a mirrored phase correlation rounds otherwise.
    tolerance = 0.3 if detector.source.startswith(("Cui", "Jain")) else 0.02
    assert np.abs(there - expected).max() < tolerance


@pytest.mark.parametrize("name", LINEAR)
def test_gain_and_offset_change_nothing(name: str) -> None:
    frames = [noise_frame(1), noise_frame(2, scr=12)]
    found = last(made(name), *frames)
    other = last(made(name), *[changed(frame, frame.image * 3 + 2000) for frame in frames])
    assert np.abs(offsets(found, PLACES) - offsets(other, PLACES)).max() < (0.3 if name == "svd" else 0.01)
    assert other.scores[:3] == pytest.approx(found.scores[:3], rel=0.15 if name == "svd" else 0.01)


@pytest.mark.parametrize("name", FILTERS)
def test_polarity(name: str) -> None:
    first, second = noise_frame(1), noise_frame(2, scr=14)
    cold = changed(second, np.rint(2 * LEVEL - second.image.astype(float)).astype(np.uint16))
    for polarity, is_hot, is_cold in (("hot", True, False), ("cold", False, True), ("both", True, True)):
        detector = made(name, polarity=polarity)
        for frame, is_found in ((second, is_hot), (cold, is_cold)):
            reached = np.abs(offsets(last(detector, first, frame), PLACES)).max() < 1
            assert reached == is_found, (polarity, is_found)


@pytest.mark.parametrize("name", FILTERS)
def test_few_false_alarms_in_noise(name: str) -> None:
    detector = make_detector(name)
    frames = [noise_frame(seed, shape=(240, 320)) for seed in range(6)]
    state, found = detector.step(None, frames[0])
    alarms = 0
    for frame in frames[1:]:
        state, found = detector.step(state, frame)
        alarms += len(found)
    assert alarms <= 4


@pytest.mark.parametrize("name", FILTERS)
def test_position_covariance(name: str) -> None:
    """The normalised error squared of each axis is 1 in the mean; twenty frames of three targets tell a factor of 3."""
    detector = made(name)
    squares = []
    for seed in range(20):
        found = last(detector, noise_frame(100 + seed), noise_frame(seed, scr=12))
        for place in PLACES:
            k = int(((found.centers - place) ** 2).sum(axis=1).argmin())
            assert found.covariances is not None
            squares.append((found.centers[k] - place) ** 2 / np.diag(found.covariances[k]))
            assert 1.5 < found.sizes[k].mean() < 4
    assert 1 / 3 < np.mean(squares) < 3


@pytest.fixture(scope="module")
def sky() -> list[tuple[Frame, irsim.Truth]]:
    """A point of SCR 8 before cloud."""
    source = irsim.open_source(irsim.load("sources/cui-cloud", ["frames=10", "targets.dim.shape.scr=8"]))
    return list(zip(source.frames("counts"), source.truths(), strict=True))


@pytest.mark.parametrize("name", FILTERS)
def test_pd_on_a_rendered_sky(name: str, sky: Any) -> None:
    """In nine of ten frames; a scene of smooth cloud tells only that it works at all."""
    detector, state, hits = make_detector(name), None, 0
    for frame, truth in sky:
        state, found = detector.step(state, frame)
        hits += np.abs(offsets(found, [truth.targets[0].center])).max() < 2
    assert hits >= 9


def test_a_saturated_target_is_one_detection() -> None:
    image = np.full((60, 60), 100, np.uint8) + np.random.default_rng(0).integers(0, 5, (60, 60)).astype(np.uint8)
    image[30:34, 20:23] = 255
    for name in ("threshold", "tophat"):
        found = made(name).step(None, Frame(image, 0, 0.0, 8))[1]
        assert len(found) == 1
        assert np.abs(found.centers[0] - (21, 31.5)).max() <= 0.5
        assert found.sizes[0] == pytest.approx([3, 4], abs=0.6)


def test_most_and_separation() -> None:
    frame = noise_frame(2, scr=30)
    every = make_detector("dog").step(None, frame)[1]
    assert len(make_detector("dog", {"most": 2}).step(None, frame)[1]) == 2
    apart = make_detector("dog", {"separation": 60}).step(None, frame)[1]
    assert len(apart) == 1
    assert apart.scores[0] == every.scores[0]
