"""AGCs with a time constant: a frame alone is the one in sequence, and the curve follows the scene exponentially."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

import irsim
from irsim.camera.agc import (
    Agc,
    AgcSequence,
    Linear,
    Picture,
    Plateau,
)
from irsim.camera.agc_local import Clahe, Unsharp
from irsim.recording import open_recording, record
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


@pytest.mark.parametrize("word", SLOW)
def test_a_frame_alone_is_the_one_in_sequence(word: str) -> None:
    sequence = frames(30)
    expected = in_order(SLOW[word], sequence)
    fetched: list[int] = []

    def counts(index: int) -> Counts:
        fetched.append(index)
        return sequence[index]

    display = AgcSequence(SLOW[word], 14, counts)
    for index in (12, 13, 2, 29, 28):
        np.testing.assert_array_equal(display.picture(sequence[index], index), expected[index])
        alone = AgcSequence(SLOW[word], 14, counts).picture(sequence[index], index)
        np.testing.assert_array_equal(alone, expected[index])
    fetched.clear()
    display = AgcSequence(SLOW[word], 14, counts)
    for index in (20, 21, 22):
        display.picture(sequence[index], index)
    assert fetched == list(range(11, 20)), "each predecessor once, within the memory"


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


# A hot body enters and leaves


def entrant(index: int, enters: int, leaves: int) -> Counts:
    """Return a slope from 4000 to 4400 counts; between two frames a quarter of it is hot."""
    counts = np.repeat(np.linspace(4000, 4400, 41)[np.newaxis], 40, axis=0).astype(np.uint16)
    if enters <= index < leaves:
        counts[10:30, 10:30] = 12_000
    return counts


def test_the_background_darkens_and_recovers_exponentially() -> None:
    """The white point goes from 4400 to 12,000 and back as 1 - exp(-t / time constant); the background's grey level is
    255 (c - black) / (white - black)."""
    pictures = in_order(Linear(time_constant_frames=10), [entrant(k, 110, 220) for k in range(330)])
    grey = np.array([float(picture[0, 40]) for picture in pictures])  # of count 4400
    assert (grey[:110] == 255).all()
    hot = np.exp(-np.arange(1, 111) / 10)
    predicted = 255 * 400 / (400 + 7600 * np.concatenate([1 - hot, hot]))
    np.testing.assert_allclose(grey[110:], predicted, atol=1)


# Sources


@pytest.fixture(scope="module")
def scene() -> Rendering:
    """A hot body enters; each AGC displays the same counts."""
    return Rendering(
        irsim.loads(
            "frames: 25\n"
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


def test_renderings_and_recordings_display_the_same(scene: Rendering, tmp_path: Path) -> None:
    rendering = displayed_by(scene, SLOW["unsharp"])
    expected = images(list(rendering.frames("display")))
    assert (images(list(rendering.frames("display", 15, 25))) == expected[15:25]).all()
    assert (images([frame for frame, _ in rendering.pairs(22, 24, input="display")]) == expected[22:24]).all()
    assert (displayed_by(scene, SLOW["unsharp"]).frame(18, "display").image == expected[18]).all()
    recording = open_recording(record(rendering, tmp_path / "a.mcap"))
    assert recording.header.agc == SLOW["unsharp"]
    assert (images(list(recording.frames("display"))) == expected).all()
    assert (recording.frame(21, "display").image == expected[21]).all()


def test_a_cut_recording_begins_anew(scene: Rendering, tmp_path: Path) -> None:
    """It holds no frames before its first: pictures settle from there."""
    rendering = displayed_by(scene, SLOW["linear"])
    cut = open_recording(record(rendering, tmp_path / "cut.mcap", 10, 25))
    expected = np.stack(in_order(SLOW["linear"], [frame.image.astype(np.uint16) for frame in cut.frames()]))
    assert (images(list(cut.frames("display"))) == expected).all()
    settled = images(list(rendering.frames("display", 10, 25)))
    assert (expected[0] != settled[0]).any()
    assert (expected[9:] == settled[9:]).all()
