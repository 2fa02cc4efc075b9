"""Recordings are read as written; a failed one leaves no file."""

from __future__ import annotations

import json
import pickle
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from recording_fakes import Noise, same_frames

import irsim
from irsim.camera import AGCS
from irsim.camera.agc import Fixed
from irsim.errors import InputError
from irsim.recording import open_recording, record, recover
from irsim.recording.messages import EPOCH_NS, from_ns, to_ns
from irsim.types import Band, CameraFacts, Frame, Input, Source

SCENE = """
frames: 4
camera: {size: [64, 48]}
background: {kind: sky}
targets: [{id: jet, shape: {kind: point, area_m2: 9}, path: {kind: straight, start: [8, 20], speed: 2, range_m: 900}}]
"""


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(Noise(), tmp_path_factory.mktemp("rec") / "noise.mcap")


@pytest.mark.parametrize(("bits", "compression"), [(8, "none"), (14, "lz4"), (16, "zstd"), (16, "none")])
def test_frames_and_truth_are_read_bit_for_bit(tmp_path: Path, bits: int, compression: str) -> None:
    source = Noise(bits=bits)
    recording = open_recording(record(source, tmp_path / "r.mcap", compression=compression))  # type: ignore[arg-type]  # one of its words, to mypy any str
    assert isinstance(recording, Source)
    assert (recording.size, recording.bits, recording.rate_hz, len(recording)) == ((32, 24), bits, 30.0, 7)
    assert same_frames(recording.frames(), source.frames())
    assert list(recording.truths()) == list(source.truths())


def test_a_frame_alone_equals_the_frame_in_sequence(recorded: Path) -> None:
    recording, source = open_recording(recorded), Noise()
    for index in (6, 0, 3, 2):
        assert same_frames(iter([recording.frame(index)]), iter([source.frame(index)]))
    assert same_frames(recording.frames(start=3, stop=6), source.frames(start=3, stop=6))
    assert list(recording.truths(3, 6)) == list(source.truths(3, 6))
    assert list(recording.frames(start=5, stop=99))[-1].index == 6
    for index in (7, -1):
        with pytest.raises(IndexError, match="frames 0 to 6"):
            recording.frame(index)


def test_display_is_the_recorded_agc_of_the_counts(tmp_path: Path, recorded: Path) -> None:
    recording = open_recording(recorded)
    linear = AGCS.parse({"kind": "linear"})
    for counts, display in zip(recording.frames("counts"), recording.frames("display"), strict=True):
        assert display.bits == 8
        assert display.image.dtype == np.uint8
        assert np.array_equal(display.image, linear.display(counts.image, 14))  # type: ignore[attr-defined]  # AGCS.parse gives any Kind
    shallow = open_recording(record(Noise(bits=8), tmp_path / "r.mcap"))
    assert same_frames(shallow.frames("display"), shallow.frames("counts"))

    @dataclass(frozen=True)
    class Shown(Noise):
        agc = Fixed(low=1000, high=9000)

    recording = open_recording(record(Shown(), tmp_path / "s.mcap"))
    assert recording.agc == Shown.agc
    wanted = Shown.agc.display(Noise().frame(2).image, 14)
    assert np.array_equal(recording.frame(2, "display").image, wanted)


def test_without_truth(tmp_path: Path) -> None:
    recording = open_recording(record(Noise(has_truth=False, follow=None), tmp_path / "r.mcap"))
    assert not recording.has_truth
    assert list(recording.truths()) == []
    assert recording.targets == ()
    assert recording.follow is None
    assert len(list(recording.frames())) == 7


def test_targets_and_the_followed_one(tmp_path: Path, recorded: Path) -> None:
    recording = open_recording(recorded)
    assert recording.targets == ("jet", "dot")
    assert recording.follow == "dot"
    jet, _ = recording.contents.targets
    assert (jet.cls, jet.first, jet.frames) == ("body", 0, 5)  # absent in frames 2 and 5
    assert open_recording(record(Noise(follow=None), tmp_path / "r.mcap")).follow == "jet"


def test_a_part_of_a_source_keeps_its_times(tmp_path: Path) -> None:
    recording = open_recording(record(Noise(), tmp_path / "r.mcap", start=2, stop=5))
    assert [frame.index for frame in recording.frames()] == [0, 1, 2]
    assert [frame.time for frame in recording.frames()] == [2 / 30, 3 / 30, 4 / 30]
    assert [truth.time for truth in recording.truths()] == [2 / 30, 3 / 30, 4 / 30]
    assert np.array_equal(recording.frame(0).image, Noise().frame(2).image)
    assert recording.header.first_frame == 2


def test_a_recording_of_a_recording_is_the_same_file(tmp_path: Path, recorded: Path) -> None:
    copy = record(open_recording(recorded), tmp_path / "copy.mcap")
    assert copy.read_bytes() == recorded.read_bytes()
    assert open_recording(copy).hash == open_recording(recorded).hash
    assert open_recording(record(Noise(seed=1), tmp_path / "other.mcap")).hash != open_recording(recorded).hash


@pytest.mark.parametrize("rate", [9.0, 29.97, 1000 / 7, 10_000.0])
def test_times_survive_rounding_to_nanoseconds(rate: float) -> None:
    for index in (0, 1, 2, 3, 7, 1000, 999_999):
        assert from_ns(to_ns(index / rate), rate) == index / rate
    assert from_ns(to_ns(0.123456789), rate) == 0.123456789
    assert to_ns(0.0) == EPOCH_NS


def test_pickling(recorded: Path) -> None:
    again = pickle.loads(pickle.dumps(open_recording(recorded)))
    assert same_frames(again.frames(), Noise().frames())
    assert again.agc == open_recording(recorded).agc


def test_a_file_that_was_changed_is_refused(tmp_path: Path) -> None:
    path = record(Noise(), tmp_path / "r.mcap")
    recording = open_recording(path)
    record(Noise(seed=1), path)
    with pytest.raises(InputError, match="changed after it was opened"):
        recording.frame(0)


def test_a_scene_is_rendered_again_from_its_recording(tmp_path: Path) -> None:
    scene = irsim.open_source(irsim.loads(SCENE, overrides=["seed=5"]))
    recording = open_recording(record(scene, tmp_path / "sky.mcap"))
    for input in ("counts", "display"):
        assert same_frames(recording.frames(input), scene.frames(input))
    assert list(recording.truths()) == list(scene.truths())
    assert recording.header.source_hash == scene.hash
    (tmp_path / "again.yaml").write_text(recording.scenario_text or "")
    again = irsim.open_source(tmp_path / "again.yaml")
    assert again.hash == scene.hash
    assert same_frames(again.frames(), recording.frames())


def test_info_is_json(recorded: Path) -> None:
    facts = json.loads(json.dumps(open_recording(recorded).info()))
    assert facts["frames"] == 7
    assert facts["duration_s"] == pytest.approx(7 / 30)
    assert facts["source_hash"] == "abc"


@pytest.mark.parametrize(("band", "words"), [("mwir", "mwir"), ((8.0, 1 / 3 + 9), "8.0 to 9.333333333333334 um")])
def test_bands_are_read_as_written(tmp_path: Path, band: Band, words: str) -> None:
    @dataclass(frozen=True)
    class Seen(Noise):
        camera = CameraFacts(band=band)

    recording = open_recording(record(Seen(), tmp_path / "r.mcap"))
    assert recording.header.band == words
    assert recording.camera.band == band


def test_inputs_are_not_overwritten(recorded: Path) -> None:
    before = recorded.read_bytes()
    with pytest.raises(InputError, match="would replace"):
        record(open_recording(recorded), recorded)
    with pytest.raises(InputError, match="would replace"):
        recover(recorded, recorded)
    assert recorded.read_bytes() == before


def test_outputs_are_checked_before_any_work(tmp_path: Path) -> None:
    class Untouched(Noise):
        def frames(self, input: Input = "counts", start: int = 0, stop: int | None = None) -> Iterator[Frame]:
            raise AssertionError("worked before the output was checked")

    with pytest.raises(InputError, match="does not exist"):
        record(Untouched(), tmp_path / "nowhere" / "r.mcap")
    for start, stop, allowed in ((0, 8, "within 0:7"), (3, 3, "within 0:7"), (-1, 2, "0 or more")):
        with pytest.raises(InputError, match=f"allowed: {allowed}"):
            record(Untouched(), tmp_path / "r.mcap", start, stop)
    assert list(tmp_path.iterdir()) == []


def test_a_failed_recording_keeps_the_old_file(tmp_path: Path) -> None:
    class Changes(Noise):
        def frame(self, index: int, input: Input = "counts") -> Frame:
            return replace(super().frame(index), image=np.zeros((24, 30 + 2 * (index < 3)), np.uint16))

    path = tmp_path / "r.mcap"
    path.write_bytes(b"old")
    with pytest.raises(ValueError, match="expected a 32x24"):
        record(Changes(), path)
    assert list(tmp_path.iterdir()) == [path]
    assert path.read_bytes() == b"old"
