"""AGCs with a time constant: a frame alone is the one in sequence, and the curve follows the scene exponentially."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage

import irsim
from irsim.camera import AGCS
from irsim.camera.agc import (
    MEMORY_TIME_CONSTANTS,
    AdaptiveAgc,
    Agc,
    AgcSequence,
    Linear,
    Picture,
    Plateau,
    Statistics,
    weighted_mean,
)
from irsim.camera.agc_local import Clahe, Unsharp
from irsim.recording import Recording, open_recording, record
from irsim.render.stream import Rendering
from irsim.types import Frame

SLOW = {
    "linear": Linear(time_constant_frames=0.9),
    "plateau": Plateau(time_constant_frames=0.9),
    "unsharp": Unsharp(base=Clahe(base=Plateau(time_constant_frames=0.9))),
}
"""AGCs with a memory of nine frames."""

Counts = npt.NDArray[np.uint16]


def frames(count: int) -> list[Counts]:
    """Return noise on a level that moves by steps."""
    rng = np.random.default_rng(4)
    levels = np.repeat(rng.integers(3000, 9000, count), 3)[:count]
    return [np.rint(rng.normal(level, 80, (24, 32))).astype(np.uint16) for level in levels]


def in_order(agc: Agc, sequence: Sequence[Counts]) -> list[Picture]:
    def none(index: int) -> Counts:
        raise AssertionError("in order no counts are fetched")

    display = AgcSequence(agc, 14, none)
    return [display.picture(counts, index) for index, counts in enumerate(sequence)]


def test_every_adaptive_kind_is_tested_here() -> None:
    assert {word for word, kind in AGCS if issubclass(kind, AdaptiveAgc)} <= set(SLOW)


@pytest.mark.parametrize("word", SLOW)
def test_a_frame_alone_is_the_one_in_sequence(word: str) -> None:
    sequence = frames(30)
    expected = in_order(SLOW[word], sequence)
    fetched: list[int] = []

    def counts(index: int) -> Counts:
        fetched.append(index)
        return sequence[index]

    for index in (29, 0, 3, 17, 10, 9):
        alone = AgcSequence(SLOW[word], 14, counts).picture(sequence[index], index)
        np.testing.assert_array_equal(alone, expected[index])
    display = AgcSequence(SLOW[word], 14, counts)
    for index in (12, 13, 14, 2, 29, 28):
        np.testing.assert_array_equal(display.picture(sequence[index], index), expected[index])
    fetched.clear()
    display = AgcSequence(SLOW[word], 14, counts)
    for index in (20, 21, 22):
        display.picture(sequence[index], index)
    assert fetched == list(range(11, 20)), "each predecessor once, within the memory"


def test_frames_of_another_thread_change_no_picture() -> None:
    """The other frame is displayed just before the picture is made."""
    sequence = frames(30)

    class Interrupted(Linear):
        def __getattribute__(self, name: str) -> object:
            if name == "picture" and others:
                display.picture(sequence[others[0]], others.pop())
            return super().__getattribute__(name)

    others: list[int] = []
    display = AgcSequence(Interrupted(time_constant_frames=0.9), 14, lambda index: sequence[index])
    expected = in_order(SLOW["linear"], sequence)
    others.append(3)
    np.testing.assert_array_equal(display.picture(sequence[25], 25), expected[25])
    assert not others


@pytest.mark.parametrize("word", SLOW)
def test_memory_is_finite(word: str) -> None:
    agc, sequence = SLOW[word], frames(30)
    assert agc.memory == 9
    pictures = in_order(agc, sequence)
    assert any((agc.display(counts, 14) != picture).any() for counts, picture in zip(sequence, pictures, strict=True))
    after = in_order(agc, [frames(40)[-1], *sequence[1:]])
    differs = [bool((a != b).any()) for a, b in zip(pictures, after, strict=True)]
    assert differs[1]
    assert not any(differs[10:])


@pytest.mark.parametrize("word", AGCS.kinds)
def test_without_a_time_constant_there_is_no_memory(word: str) -> None:
    agc = AGCS.parse({"kind": word})
    assert isinstance(agc, Agc)
    assert agc.memory == 0
    for counts, picture in zip(frames(4), in_order(agc, frames(4)), strict=True):
        np.testing.assert_array_equal(picture, agc.display(counts, 14))


@pytest.mark.parametrize("time_constant", [0.5, 12.0])
def test_the_weighted_mean_is_the_first_order_filter(time_constant: float) -> None:
    """y += (1 - r)(x - y) from the same beginning, up to its memory of older frames."""
    statistics: list[Statistics] = list(np.random.default_rng(7).uniform(0, 1, (400, 5)))
    r, filtered = math.exp(-1 / time_constant), statistics[0]
    for each in statistics[1:]:
        filtered = filtered + (1 - r) * (each - filtered)
    window = math.ceil(MEMORY_TIME_CONSTANTS * time_constant) + 1
    found = weighted_mean(statistics[-window:], time_constant)
    np.testing.assert_allclose(found, filtered, atol=2 * math.exp(-MEMORY_TIME_CONSTANTS))


# A hot body enters and leaves


def entrant(index: int, enters: int, leaves: int) -> Counts:
    """Return a slope from 4000 to 4400 counts; between two frames a quarter of it is hot."""
    counts = np.repeat(np.linspace(4000, 4400, 41)[np.newaxis], 40, axis=0).astype(np.uint16)
    if enters <= index < leaves:
        counts[10:30, 10:30] = 12_000
    return counts


@pytest.mark.parametrize("time_constant", [4.0, 10.0])
@pytest.mark.parametrize("wrap", [lambda base: base, lambda base: Unsharp(base=base, amount=0)])
def test_the_background_darkens_and_recovers_exponentially(time_constant: float, wrap: Callable[[Linear], Agc]) -> None:
    """The white point goes from 4400 to 12,000 and back as 1 - exp(-t / time constant); the background's grey level is
    255 (c - black) / (white - black)."""
    enters, leaves = 110, 220
    pictures = in_order(
        wrap(Linear(time_constant_frames=time_constant)), [entrant(k, enters, leaves) for k in range(330)]
    )
    grey = np.array([float(picture[0, 40]) for picture in pictures])  # of count 4400
    assert (grey[:enters] == 255).all()
    assert (np.diff(grey[enters:leaves]) <= 0).all()
    assert (np.diff(grey[leaves:]) >= 0).all()
    assert grey[-1] == 255

    def predicted(time_constant: float) -> npt.NDArray[np.float64]:
        after = np.arange(1, 111)
        hot = np.exp(-after / time_constant)
        return 255 * 400 / (400 + 7600 * np.concatenate([1 - hot, hot]))

    np.testing.assert_allclose(grey[enters:], predicted(time_constant), atol=1)
    for wrong in (0.9, 1.1):
        assert np.abs(grey[enters:] - predicted(wrong * time_constant)).max() > 3


def test_plateau_equalisation_follows_slowly_too() -> None:
    agc = Plateau(plateau=1, time_constant_frames=4, gain_limit=None)
    pictures = in_order(agc, [entrant(k, 50, 100) for k in range(160)])
    grey = np.array([float(picture[0, 30:].mean()) for picture in pictures])
    assert grey[99] < grey[52] < grey[49]
    assert (np.diff(grey[50:86]) <= 0).all()
    assert grey[-1] == grey[49]


# Sources


@pytest.fixture(scope="module")
def scene() -> Rendering:
    """A hot body enters; each AGC displays the same counts."""
    return Rendering(
        irsim.loads(
            "frames: 40\n"
            "camera: {size: [48, 40], ifov_mrad: 1}\n"
            "background: {kind: sky}\n"
            "targets: [{id: fire, shape: {kind: hot_spot, size_m: [0.8, 0.8], temperature_k: 390},\n"
            "  path: {kind: straight, start: [-15, 20], speed: 2, range_m: 60}}]\n"
        )
    )


def displayed_by(scene: Rendering, agc: Agc) -> Rendering:
    camera = scene.scenario.camera.model_copy(update={"agc": agc})
    return Rendering(scene.scenario.model_copy(update={"camera": camera}), scene.name)


def images(shown: Sequence[Frame]) -> npt.NDArray[np.unsignedinteger]:
    assert all(frame.bits == 8 for frame in shown)
    return np.stack([frame.image for frame in shown])


@pytest.mark.parametrize("word", SLOW)
def test_renderings_and_recordings_display_the_same(scene: Rendering, word: str, tmp_path: Path) -> None:
    rendering = displayed_by(scene, SLOW[word])
    expected = images(list(rendering.frames("display")))
    assert (images(list(rendering.frames("display", 15, 25))) == expected[15:25]).all()
    assert (images([frame for frame, _ in rendering.pairs(22, 24, input="display")]) == expected[22:24]).all()
    for index in (31, 4):
        assert (displayed_by(scene, SLOW[word]).frame(index, "display").image == expected[index]).all()
        assert (rendering.frame(index, "display").image == expected[index]).all()

    recording = open_recording(record(rendering, tmp_path / "a.mcap"))
    assert recording.header.agc == SLOW[word]
    assert (images(list(recording.frames("display"))) == expected).all()
    assert (images(list(recording.frames("display", 15, 25))) == expected[15:25]).all()
    assert (recording.frame(31, "display").image == expected[31]).all()
    assert (previews(recording)[[0, 20, 39]] == [jpeg(expected[k]) for k in (0, 20, 39)]).all()


def test_imported_frames_are_displayed_slowly_too(tmp_path: Path) -> None:
    folder = tmp_path / "clip"
    folder.mkdir()
    sequence = frames(20)
    for index, counts in enumerate(sequence):
        cv2.imwrite(str(folder / f"{index:02}.png"), counts)
    path = irsim.import_frames(folder, tmp_path / "a.mcap", bits=14, agc=SLOW["plateau"])
    recording = open_recording(path)
    expected = np.stack(in_order(SLOW["plateau"], sequence))
    assert (images(list(recording.frames("display"))) == expected).all()
    assert (recording.frame(13, "display").image == expected[13]).all()


def test_a_cut_recording_begins_anew(scene: Rendering, tmp_path: Path) -> None:
    """It holds no frames before its first: pictures settle from there, also in the preview."""
    rendering = displayed_by(scene, SLOW["linear"])
    cut = open_recording(record(rendering, tmp_path / "cut.mcap", 10, 30))
    counts = [frame.image.astype(np.uint16) for frame in rendering.frames(start=10, stop=30)]
    expected = np.stack(in_order(SLOW["linear"], counts))
    assert (images(list(cut.frames("display"))) == expected).all()
    assert (previews(cut)[3] == jpeg(expected[3])).all()
    settled = images(list(rendering.frames("display", 10, 30)))
    assert (expected[0] != settled[0]).any()
    assert (expected[9:] == settled[9:]).all()


def test_worker_processes_display_the_same(scene: Rendering) -> None:
    rendering = displayed_by(scene, SLOW["linear"])
    found = images([frame for frame, _ in rendering.pairs(7, 40, jobs=2, input="display")])
    assert (found == images(list(rendering.frames("display", 7)))).all()


def previews(recording: Recording) -> npt.NDArray[np.uint8]:
    container = recording.mcap
    lane = container.topics["/ir/preview"]
    with container.open() as file:
        packets = itertools.chain.from_iterable(container.packets(file, lane, k) for k in range(len(lane.chunks)))
        found = [CompressedImage.FromString(bytes(packet.data)).data for packet in packets]
    return np.stack([decoded(data) for data in found])


def jpeg(picture: npt.NDArray[np.unsignedinteger]) -> npt.NDArray[np.uint8]:
    _, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 85])
    return decoded(data.tobytes())


def decoded(data: bytes) -> npt.NDArray[np.uint8]:
    return np.asarray(cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_GRAYSCALE), dtype=np.uint8)
