"""Detectors by name, a person's own detectors and their answers, and networks in ONNX files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from detector_frames import noise_frame, write_onnx, write_onnx_boxes

from irsim.types import Box, Frame
from irtrack.detectors import DETECTORS, PlainDetector, make_detector, parse_detector
from irtrack.detectors.onnx import _session
from irtrack.errors import InputError, TrackerError
from irtrack.types import Detection, Detections

FRAME = noise_frame(0)
BOX = (10.0, 12.0, 4.0, 3.0)


def answer(given: Any) -> Detections:
    """Detections of a plain detector that gives the same value for every image."""
    return PlainDetector.of(lambda image: given).detect(FRAME)


@pytest.mark.parametrize(
    ("given", "score"),
    [
        (np.array([BOX]), 1.0),
        (np.array([[*BOX, 0.3]], np.float32), 0.3),
        ([Box(*BOX)], 1.0),
        ([(Box(*BOX), 0.3)], 0.3),
        ([(BOX, 0.3)], 0.3),
        ([BOX], 1.0),
        ([[*BOX, 0.3]], 0.3),
        ([Detection(Box(*BOX), 0.3, "drone")], 0.3),
        (Detections.of([Detection(Box(*BOX), 0.3)]), 0.3),
    ],
)
def test_answers_of_plain_detectors(given: Any, score: float) -> None:
    (found,) = answer(given)
    assert found.box == Box(*BOX)
    assert found.score == pytest.approx(score)


@pytest.mark.parametrize("given", [[], (), np.empty((0, 4)), np.empty(0)])
def test_no_detections(given: Any) -> None:
    assert len(answer(given)) == 0


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (FRAME.image, "detect gave an image, uint16 of shape (80, 96)"),
        (np.zeros((80, 96, 3)), "detect gave an image"),
        (np.zeros((3, 6)), "an array of float64, shape (3, 6)"),
        (np.array([[1.0, np.nan, 2, 2]]), "centers of detection 0 are not finite"),
        ([(1, 2, 3)], "detection 0 is (1, 2, 3)"),
        ([BOX, "here"], "detection 1 is 'here'"),
        ([(1, 2, 0, 3)], "a size of 0 or less"),
        (None, "detect gave NoneType"),
        (3.5, "detect gave float"),
    ],
)
def test_wrong_answers_are_one_line(given: Any, says: str) -> None:
    with pytest.raises(TrackerError) as error:
        answer(given)
    assert says in str(error.value)
    assert "frame 0" in str(error.value)
    assert "allowed" in str(error.value) or "not finite" in str(error.value)
    assert "\n" not in str(error.value)


class Counter:
    """Gives as many boxes as it has seen frames; `frame` is annotated."""

    def __init__(self, least: int = 0) -> None:
        self.seen = least

    def detect(self, frame: Frame) -> list[Box]:
        assert isinstance(frame, Frame)
        frame.image[:] = 0
        self.seen += 1
        return [Box(*BOX)] * self.seen


@pytest.mark.parametrize("given", [Counter, Counter(), f"{__name__}:Counter"])
def test_every_run_of_a_plain_class_begins_anew(given: Any) -> None:
    detector: Any = make_detector(given)
    state, found = detector.step(None, FRAME)
    assert [len(found), len(detector.step(state, FRAME)[1]), len(detector.step(None, FRAME)[1])] == [1, 2, 1]
    assert FRAME.image.max() > 0


def brightest(image: Any, reach: float = 2.0) -> list[tuple[float, float, float, float]]:
    row, column = np.unravel_index(image.argmax(), image.shape)
    return [(float(column), float(row), 2 * reach, 2 * reach)]


def test_specs() -> None:
    assert parse_detector("tophat:threshold=7:radius=2") == make_detector("tophat", {"threshold": 7.0, "radius": 2})
    assert parse_detector("mpcm:sides=[3, 5]") == make_detector("mpcm", {"sides": [3, 5]})
    mine: Any = parse_detector(f"{__name__}:brightest:reach=3")
    assert mine.detect(noise_frame(0, 50)).sizes.tolist() == [[6, 6]]
    assert [kind.source and kind.__doc__ for kind in DETECTORS.values()]


@pytest.mark.parametrize(
    ("spec", "says"),
    [
        ("tophatt", "unknown detector 'tophatt'.*did you mean 'tophat'"),
        ("tophat:radius=0", "radius"),
        ("tophat:size=3", "size"),
        ("mpcm:sides=[4]", "4 is even"),
        ("tophat:radius=2:radius=3", "given twice"),
        ("nowhere:f", "cannot import detector 'nowhere:f'"),
        ("math:pi", "'math:pi' is no detector"),
        (f"{__name__}:Counter:most=3", "most"),
        ("onnx", "file"),
    ],
)
def test_wrong_specs(spec: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        parse_detector(spec)


IDENTITY = np.ones((1, 1))


def test_onnx_heat_maps_and_boxes(tmp_path: Path) -> None:
    image = np.zeros((20, 30), np.uint8)
    image[5, 7], image[15, 20] = 255, 102
    frame = Frame(image, 0, 0.0, 8)
    heat: Any = make_detector("onnx", {"file": write_onnx(tmp_path / "one.onnx", IDENTITY), "threshold": 0.3})
    found = heat.detect(frame)
    assert found.centers.tolist() == [[7, 5], [20, 15]]
    assert found.scores == pytest.approx([1, 0.4])
    loaded = _session.cache_info().misses
    make_detector("onnx", {"file": heat.file}).step(None, frame)
    assert _session.cache_info().misses == loaded
    given = np.array([[3, 4, 2, 2, 0.1], [5, 6, 2, 3, 0.9], [8, 9, 2, 2, 0.6]])
    boxes: Any = make_detector("onnx", {"file": write_onnx_boxes(tmp_path / "b.onnx", given), "output": "boxes"})
    assert boxes.detect(frame).centers.tolist() == [[5, 6], [8, 9]]
    lost = write_onnx_boxes(tmp_path / "nan.onnx", np.full((1, 5), np.nan))
    with pytest.raises(TrackerError, match="not finite"):
        make_detector("onnx", {"file": lost, "output": "boxes"}).step(None, frame)


def test_onnx_files_that_do_not_fit(tmp_path: Path) -> None:
    (tmp_path / "text.onnx").write_text("no network")
    fixed = write_onnx(tmp_path / "fixed.onnx", IDENTITY, (64, 48))
    free = write_onnx(tmp_path / "free.onnx", IDENTITY)
    for parameters, says in (
        ({"file": str(tmp_path / "none.onnx")}, "there is no such file"),
        ({"file": str(tmp_path / "text.onnx")}, "is no ONNX file"),
        ({"file": fixed}, "takes 64x48 px; the frame has 96x80"),
        ({"file": fixed, "size": [96, 80]}, "size 96x80; allowed: 64x48"),
        ({"file": free, "size": [64, 48]}, "takes 64x48 px; the frame has 96x80"),
        ({"file": free, "output": "boxes"}, r"output of shape \(1, 1, 80, 96\); allowed: \(n, 5\)"),
    ):
        with pytest.raises(InputError, match=says) as error:
            make_detector("onnx", parameters).step(None, FRAME)
        assert "\n" not in str(error.value)
