"""Importing pictures and videos."""

from __future__ import annotations

import zlib
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from frame_folders import folder_of, pictures

from irsim.camera import AGCS
from irsim.errors import InputError
from irsim.recording import open_recording, record
from irsim.recording.importers import import_frames


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return folder_of(tmp_path / "clip", pictures())


@pytest.mark.parametrize(("dtype", "bits", "agc"), [(np.uint8, 8, "none"), (np.uint16, 16, "linear")])
def test_a_folder_comes_in_bit_for_bit(tmp_path: Path, dtype: type, bits: int, agc: str) -> None:
    images = pictures(12, dtype)
    folder = folder_of(tmp_path / "clip", images)  # frame_2 must come before frame_10
    recording = open_recording(import_frames(folder, tmp_path / "r.mcap", rate_hz=25))
    assert (recording.bits, recording.size, recording.rate_hz) == (bits, (32, 24), 25.0)
    assert recording.agc == AGCS.parse({"kind": agc})
    assert not recording.has_truth
    for index, frame in enumerate(recording.frames()):
        assert frame.time == index / 25
        assert frame.image.dtype == dtype
        assert np.array_equal(frame.image, images[index])
    assert recording.contents.notes == ()


def test_an_import_can_be_recorded_again(tmp_path: Path, folder: Path) -> None:
    first = import_frames(folder, tmp_path / "a.mcap")
    assert record(open_recording(first), tmp_path / "b.mcap").exists()
    assert open_recording(tmp_path / "b.mcap").header.input == "imported"


def test_true_depth_of_16_bit_pictures(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "clip", [image >> 2 for image in pictures(2, np.uint16)])
    assert open_recording(import_frames(folder, tmp_path / "r.mcap", bits=14)).bits == 14
    with pytest.raises(InputError, match=r"frame_0\.png: has the count 16\d\d\d; allowed: 13 bits"):
        import_frames(folder, tmp_path / "s.mcap", bits=13)
    with pytest.raises(InputError, match="17 bits do not fit; allowed: 1 to 16"):
        import_frames(folder, tmp_path / "s.mcap", bits=17)


def test_an_agc_may_be_chosen(tmp_path: Path, folder: Path) -> None:
    linear = AGCS.parse({"kind": "linear"})
    recording = open_recording(import_frames(folder, tmp_path / "r.mcap", agc=linear))  # type: ignore[arg-type]  # AGCS.parse gives any Kind
    wanted = linear.display(pictures()[1], 8)  # type: ignore[attr-defined]  # AGCS.parse gives any Kind
    assert np.array_equal(recording.frame(1, "display").image, wanted)


def test_without_a_rate_the_assumption_is_noted(tmp_path: Path, folder: Path) -> None:
    recording = open_recording(import_frames(folder, tmp_path / "r.mcap"))
    assert recording.rate_hz == 30
    assert recording.contents.notes == ("no rate was given: 30 Hz assumed",)


def test_colours_become_grey_and_grey_stored_as_colour_is_kept(tmp_path: Path) -> None:
    grey = pictures(1)[0]
    green = np.zeros((24, 32, 3), np.uint8)
    green[..., 1] = 100
    folder = folder_of(tmp_path / "clip", [np.dstack([grey] * 3), green])
    recording = open_recording(import_frames(folder, tmp_path / "r.mcap", rate_hz=30))
    assert np.array_equal(recording.frame(0).image, grey)
    assert (recording.frame(1).image == 59).all()  # BT.601 luma: 0.587 * 100
    assert recording.contents.notes == ("1 of 2 pictures had colours: made grey by luma (ITU-R BT.601)",)


def test_a_video_in_colours_is_told(tmp_path: Path) -> None:
    path = tmp_path / "clip.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 12.5, (64, 48))
    for greens in (100, 130):  # of the second picture the greens are 30 above the others
        writer.write(np.dstack([np.full((48, 64), grey, np.uint8) for grey in (100, greens, 100)]))
    writer.release()
    recording = open_recording(import_frames(path, tmp_path / "r.mcap"))
    assert recording.contents.notes == ("1 of 2 pictures had colours: made grey by luma (ITU-R BT.601)",)


def test_a_video(tmp_path: Path) -> None:
    path = tmp_path / "clip.avi"
    images = [cv2.GaussianBlur(image, (0, 0), 3) for image in pictures(6, size=(64, 48))]
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 12.5, (64, 48))
    for image in images:
        writer.write(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR))
    writer.release()
    recording = open_recording(import_frames(path, tmp_path / "r.mcap"))
    assert (recording.size, recording.bits, recording.rate_hz, len(recording)) == ((64, 48), 8, 12.5, 6)
    for frame, image in zip(recording.frames(), images, strict=True):
        assert np.abs(frame.image.astype(int) - image).mean() < 3  # MJPG is lossy
    assert recording.contents.notes == ()  # the codec leaves channels some greys apart, and no colours
    assert open_recording(import_frames(path, tmp_path / "s.mcap", rate_hz=50)).rate_hz == 50
    past = tmp_path / "gt.csv"
    past.write_text("frame,x,y,w,h\n6,1,1,2,2\n")
    with pytest.raises(InputError, match=r"gt\.csv:2: frame 6 is past the end; allowed: 0 to 5"):
        import_frames(path, tmp_path / "t.mcap", truth=past)
    assert not (tmp_path / "t.mcap").exists()


def test_a_folder_gives_its_whole_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = folder_of(tmp_path / "flight.2", pictures(1))
    assert open_recording(import_frames(made, tmp_path / "a.mcap")).header.name == "flight.2"
    monkeypatch.chdir(made)
    assert open_recording(import_frames(".", tmp_path / "b.mcap")).header.name == "flight.2"


def test_pictures_must_be_alike(tmp_path: Path) -> None:
    sizes = folder_of(tmp_path / "sizes", [*pictures(2), *pictures(1, size=(30, 24))])
    with pytest.raises(InputError, match=r"frame_2\.png: is 30x24, 8 bit but .*frame_0\.png is 32x24, 8 bit; allowed"):
        import_frames(sizes, tmp_path / "r.mcap")
    types = folder_of(tmp_path / "types", [*pictures(1), *pictures(1, np.uint16)])
    with pytest.raises(InputError, match=r"frame_1\.png: is 32x24, 16 bit"):
        import_frames(types, tmp_path / "r.mcap")
    assert not list(tmp_path.glob("*.mcap"))


def test_broken_pictures_are_named(tmp_path: Path, folder: Path) -> None:
    third = folder / "frame_2.png"
    whole = third.read_bytes()
    huge = bytearray(whole)
    huge[16:20] = (2**31 - 1).to_bytes(4, "big")  # IHDR: columns; its CRC made right again
    huge[29:33] = zlib.crc32(huge[12:29]).to_bytes(4, "big")
    flipped = bytearray(whole)
    flipped[len(whole) // 2] ^= 4
    for broken in (b"", b"text", whole[:-20], whole[: len(whole) // 2], bytes(flipped), bytes(huge)):
        third.write_bytes(broken)
        with pytest.raises(InputError, match=r"frame_2\.png: is not a PNG picture, or is cut short or damaged"):
            import_frames(folder, tmp_path / "r.mcap")
    assert not list(tmp_path.glob("*.mcap"))


def test_sources_that_are_none(tmp_path: Path, folder: Path) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "text.mp4").write_text("hello " * 100)
    for source, says in (
        (tmp_path / "empty", r"holds no \.png"),
        (tmp_path / "nowhere", "no such file or folder"),
        (tmp_path / "text.mp4", "cannot be opened as a video"),
        (folder / "frame_0.png", "is one picture"),
    ):
        with pytest.raises(InputError, match=says) as error:
            import_frames(source, tmp_path / "r.mcap")
        assert str(source) in str(error.value)


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan"), float("inf")])
def test_impossible_rates(tmp_path: Path, folder: Path, rate: float) -> None:
    with pytest.raises(InputError, match=r"^rate \S+: allowed: a number from 0\.001 to 10000 Hz$"):
        import_frames(folder, tmp_path / "r.mcap", rate_hz=rate)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"bits": 12.5}, "bits 12.5: allowed: a whole number, 1 or more"),
        ({"bits": True}, "bits True: allowed: a whole number, 1 or more"),
        ({"bits": "12"}, "bits '12': allowed: a whole number, 1 or more"),
        ({"bits": 0}, "bits 0: allowed: 1 or more"),
        ({"rate_hz": "30"}, "rate '30': allowed: a number from 0.001 to 10000 Hz"),
        ({"rate_hz": True}, "rate True: allowed: a number from 0.001 to 10000 Hz"),
        ({"accuracy_px": "1", "truth": "gt.csv"}, "accuracy '1': allowed: a number, 0 px or more"),
        ({"name": 3}, "name 3: is no text; allowed: text"),
        ({"name": "half \ud800"}, r"name 'half \ud800': is no text; allowed: text"),
        ({"follow": 3, "truth": "gt.csv"}, "follow 3: is no text; allowed: text"),
        ({"agc": "linear"}, "agc 'linear': is no AGC; allowed: one such as irsim.display.AGCS.parse gives"),
        ({"compression": "zip"}, "compression 'zip': allowed: none, lz4, zstd"),
        ({"compression": 3}, "compression 3: allowed: none, lz4, zstd"),
        ({"compression": ""}, "compression '': allowed: none, lz4, zstd"),
    ],
)
def test_what_is_asked_of_another_type_is_told_in_a_line(
    tmp_path: Path, folder: Path, given: dict[str, Any], says: str
) -> None:
    with pytest.raises(InputError) as caught:
        import_frames(folder, tmp_path / "r.mcap", **given)
    assert str(caught.value) == says
    assert not (tmp_path / "r.mcap").exists()


def test_numbers_of_numpy_are_taken(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "clip", [image >> 2 for image in pictures(2, np.uint16)])
    table = tmp_path / "gt.csv"
    table.write_text("frame,x,y,w,h\n1,1,1,2,2\n")
    asked: dict[str, Any] = {"bits": np.int64(14), "rate_hz": np.float32(25), "accuracy_px": np.int64(2)}
    header = open_recording(import_frames(folder, tmp_path / "r.mcap", truth=table, **asked)).header
    assert (header.bits, header.rate_hz, header.accuracy_px) == (14, 25.0, 2.0)


def test_the_output_is_checked_first(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"the folder .*nowhere does not exist"):
        import_frames(tmp_path / "no source either", tmp_path / "nowhere" / "r.mcap")


def test_a_damaged_recording_is_imported_for_what_is_whole(tmp_path: Path, folder: Path) -> None:
    whole = import_frames(folder, tmp_path / "r.mcap", rate_hz=10)
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole.read_bytes()[:-2000])
    foreign = tmp_path / "foreign"
    foreign.write_bytes(b"\x89MCAP9\r\n" + whole.read_bytes()[8:])
    with pytest.raises(InputError, match="foreign: is not an MCAP file; allowed: a recording"):
        import_frames(foreign, tmp_path / "none.mcap")
    recording = open_recording(import_frames(cut, tmp_path / "rescued.mcap"))
    assert 0 < len(recording) <= 4
    assert np.array_equal(recording.frame(0).image, pictures()[0])


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"rate_hz": 5.0}, "no rate"),
        ({"truth": "gt.csv"}, "no truth"),
        ({"name": "x"}, "no name"),
        ({"bits": 12, "agc": AGCS.parse({"kind": "linear"})}, "no agc, no bits"),
        ({"accuracy_px": 1.0}, "no accuracy"),
        ({"compression": "none"}, "no compression"),
        ({"follow": "jet"}, "no follow"),
    ],
)
def test_what_a_recording_has_of_its_own_is_not_silently_ignored(
    tmp_path: Path, folder: Path, given: dict[str, Any], says: str
) -> None:
    whole = import_frames(folder, tmp_path / "r.mcap", rate_hz=10)
    with pytest.raises(InputError, match=rf"r\.mcap: is a recording and is kept as it is; allowed: {says}$"):
        import_frames(whole, tmp_path / "again.mcap", **given)
    assert not (tmp_path / "again.mcap").exists()
