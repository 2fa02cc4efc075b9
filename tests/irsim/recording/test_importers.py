"""Import of pictures, TIFF, arrays and videos: counts bit for bit, or one line for wrong input."""

from __future__ import annotations

import struct
import zipfile
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from frame_folders import folder_of, pictures

from irsim.camera import AGCS
from irsim.errors import InputError
from irsim.recording import images, open_recording, record
from irsim.recording.images import read_stack
from irsim.recording.importers import import_frames

STACK = np.random.default_rng(0).integers(0, 1 << 14, (5, 12, 16)).astype(np.uint16)
LINEAR = AGCS.parse({"kind": "linear"})


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return folder_of(tmp_path / "clip", pictures())


def write_video(path: Path, images: list[np.ndarray]) -> Path:
    rows, columns = images[0].shape[:2]
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 12.5, (columns, rows))
    for image in images:
        writer.write(image)
    writer.release()
    return path


def saved(path: Path, **arrays: npt.NDArray[np.generic]) -> Path:
    """Write a .npy of one array or a compressed .npz of any number."""
    if path.suffix.lower() == ".npy":
        with path.open("wb") as file:  # numpy would append an ending to a name
            (array,) = arrays.values()
            np.save(file, array)
    else:
        np.savez_compressed(path, **arrays)  # type: ignore[arg-type]  # mypy takes an array's name for another parameter's
    return path


@pytest.mark.parametrize(("dtype", "bits", "agc"), [(np.uint8, 8, "none"), (np.uint16, 16, "linear")])
def test_png_folders_are_imported_bit_for_bit(tmp_path: Path, dtype: type, bits: int, agc: str) -> None:
    images = pictures(12, dtype)
    folder = folder_of(tmp_path / "flight.2", images)  # frame_2 comes before frame_10
    recording = open_recording(import_frames(folder, tmp_path / "r.mcap", rate_hz=25))
    assert (recording.bits, recording.size, recording.rate_hz) == (bits, (32, 24), 25.0)
    assert (recording.header.name, recording.header.input) == ("flight.2", "imported")
    assert recording.agc == AGCS.parse({"kind": agc})
    assert not recording.has_truth
    for index, frame in enumerate(recording.frames()):
        assert frame.time == index / 25
        assert frame.image.dtype == dtype
        assert np.array_equal(frame.image, images[index])
    assert recording.contents.notes == ()
    assert record(recording, tmp_path / "b.mcap").exists()


def test_bit_depth_of_16_bit_pictures(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "clip", [image >> 2 for image in pictures(2, np.uint16)])
    numbers: dict[str, Any] = {"bits": np.int64(14), "rate_hz": np.float32(25)}
    header = open_recording(import_frames(folder, tmp_path / "r.mcap", **numbers)).header
    assert (header.bits, header.rate_hz) == (14, 25.0)
    with pytest.raises(InputError, match=r"frame_0\.png: has the count 16\d\d\d; allowed: 13 bits"):
        import_frames(folder, tmp_path / "s.mcap", bits=13)
    with pytest.raises(InputError, match="17 bits do not fit; allowed: 1 to 16"):
        import_frames(folder, tmp_path / "s.mcap", bits=17)


def test_agc_and_default_rate(tmp_path: Path, folder: Path) -> None:
    recording = open_recording(import_frames(folder, tmp_path / "r.mcap", agc=LINEAR))  # type: ignore[arg-type]  # AGCS.parse gives any Kind
    wanted = LINEAR.display(pictures()[1], 8)  # type: ignore[attr-defined]  # AGCS.parse gives any Kind
    assert np.array_equal(recording.frame(1, "display").image, wanted)
    assert recording.rate_hz == 30
    assert recording.contents.notes == ("no rate was given: 30 Hz assumed",)


def test_colours_become_grey_with_a_note(tmp_path: Path) -> None:
    grey = pictures(1)[0]
    green = np.zeros((24, 32, 3), np.uint8)
    green[..., 1] = 100
    folder = folder_of(tmp_path / "clip", [np.dstack([grey] * 3), green])
    recording = open_recording(import_frames(folder, tmp_path / "r.mcap", rate_hz=30))
    assert np.array_equal(recording.frame(0).image, grey)
    assert (recording.frame(1).image == 59).all()  # BT.601 luma: 0.587 * 100
    note = "1 of 2 pictures had colours: made grey by luma (ITU-R BT.601)"
    assert recording.contents.notes == (note,)


def test_video(tmp_path: Path) -> None:
    images = [cv2.GaussianBlur(image, (0, 0), 3) for image in pictures(6, size=(64, 48))]
    path = write_video(tmp_path / "clip.avi", [cv2.cvtColor(image, cv2.COLOR_GRAY2BGR) for image in images])
    recording = open_recording(import_frames(path, tmp_path / "r.mcap"))
    assert (recording.size, recording.bits, recording.rate_hz, len(recording)) == ((64, 48), 8, 12.5, 6)
    for frame, image in zip(recording.frames(), images, strict=True):
        assert np.abs(frame.image.astype(int) - image).mean() < 3  # MJPG is lossy
    assert recording.contents.notes == ()  # the codec's rounding is not taken for colours
    assert open_recording(import_frames(path, tmp_path / "s.mcap", rate_hz=50)).rate_hz == 50
    past = tmp_path / "gt.csv"
    past.write_text("frame,x,y,w,h\n6,1,1,2,2\n")
    with pytest.raises(InputError, match=r"gt\.csv:2: frame 6 is past the end; allowed: 0 to 5"):
        import_frames(path, tmp_path / "t.mcap", truth=past)
    assert not (tmp_path / "t.mcap").exists()


def test_pictures_of_one_size_and_type(tmp_path: Path) -> None:
    sizes = folder_of(tmp_path / "sizes", [*pictures(2), *pictures(1, size=(30, 24))])
    with pytest.raises(InputError, match=r"frame_2\.png: is 30x24, 8 bit but .*frame_0\.png is 32x24, 8 bit; allowed"):
        import_frames(sizes, tmp_path / "r.mcap")
    types = folder_of(tmp_path / "types", [*pictures(1), *pictures(1, np.uint16)])
    with pytest.raises(InputError, match=r"frame_1\.png: is 32x24, 16 bit"):
        import_frames(types, tmp_path / "r.mcap")
    assert not list(tmp_path.glob("*.mcap"))


def test_sources_without_pictures(tmp_path: Path, folder: Path) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "text.mp4").write_text("hello " * 100)
    for source, message in (
        (tmp_path / "empty", r"holds no \.png"),
        (tmp_path / "nowhere", "no such file or folder"),
        (tmp_path / "text.mp4", "cannot be opened as a video"),
        (folder / "frame_0.png", "is one picture"),
    ):
        with pytest.raises(InputError, match=message) as error:
            import_frames(source, tmp_path / "r.mcap")
        assert str(source) in str(error.value)
    with pytest.raises(InputError, match=r"the folder .*nowhere does not exist"):  # the output is checked first
        import_frames(tmp_path / "missing", tmp_path / "nowhere" / "r.mcap")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"bits": 12.5}, "bits 12.5: allowed: a whole number, 1 or more"),
        ({"bits": 0}, "bits 0: allowed: 1 or more"),
        ({"rate_hz": "30"}, "rate '30': allowed: a number from 0.001 to 10000 Hz"),
        ({"rate_hz": float("nan")}, "rate nan: allowed: a number from 0.001 to 10000 Hz"),
        ({"accuracy_px": float("inf"), "truth": "gt.csv"}, "accuracy inf: allowed: a number, 0 px or more"),
        ({"name": 3}, "name 3: is no text; allowed: text"),
        ({"follow": 3, "truth": "gt.csv"}, "follow 3: is no text; allowed: text"),
        ({"agc": "linear"}, "agc 'linear': is not an AGC; allowed: a value of irsim.camera.AGCS.parse"),
        ({"compression": "zip"}, "compression 'zip': allowed: none, lz4, zstd, archive"),
    ],
)
def test_wrong_options(tmp_path: Path, folder: Path, given: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError) as caught:
        import_frames(folder, tmp_path / "r.mcap", **given)
    assert str(caught.value) == message
    assert not (tmp_path / "r.mcap").exists()


def test_import_of_a_damaged_recording(tmp_path: Path, folder: Path) -> None:
    whole = import_frames(folder, tmp_path / "r.mcap", rate_hz=10)
    cut, foreign = tmp_path / "cut.mcap", tmp_path / "foreign"
    cut.write_bytes(whole.read_bytes()[:-2000])
    foreign.write_bytes(b"\x89MCAP9\r\n" + whole.read_bytes()[8:])
    with pytest.raises(InputError, match="foreign: is not an MCAP file; allowed: a recording"):
        import_frames(foreign, tmp_path / "none.mcap")
    with pytest.raises(InputError, match=r"cut\.mcap: is a recording and is kept as it is; allowed: no rate, no bits$"):
        import_frames(cut, tmp_path / "none.mcap", rate_hz=5.0, bits=12)
    recording = open_recording(import_frames(cut, tmp_path / "recovered.mcap"))
    assert 0 < len(recording) <= 4
    assert np.array_equal(recording.frame(0).image, pictures()[0])
    assert not (tmp_path / "none.mcap").exists()


@pytest.mark.parametrize(
    ("name", "dtype", "order"),
    [("clip.npy", "uint8", "C"), ("clip.npz", "<u2", "F"), ("CLIP.NPY", ">u2", "C"), ("clip.npy", ">u2", "F")],
)
def test_arrays_are_imported_bit_for_bit(tmp_path: Path, name: str, dtype: str, order: str) -> None:
    stack = (STACK >> 6 if dtype == "uint8" else STACK).astype(dtype)
    stack = np.asfortranarray(stack) if order == "F" else stack
    path = saved(tmp_path / name, frames=stack)
    recording = open_recording(import_frames(path, tmp_path / "r.mcap", rate_hz=60))
    assert (recording.size, recording.rate_hz, len(recording), recording.header.name) == ((16, 12), 60, 5, path.stem)
    for frame, wanted in zip(recording.frames(), stack, strict=True):
        assert frame.image.dtype == np.dtype(dtype).newbyteorder("=")
        np.testing.assert_array_equal(frame.image, wanted)


@pytest.mark.parametrize(
    ("array", "message"),
    [
        (STACK[0], r"is an array of 12 x 16; allowed: frames x rows x columns"),
        (STACK.astype(np.float32), r"has pixels of type float32; allowed: unsigned, 8 or 16 bit"),
        (np.full((2, 3, 4), None), r"is not an array of numbers saved by numpy"),
    ],
)
def test_arrays_that_are_not_frames(tmp_path: Path, array: npt.NDArray[np.generic], message: str) -> None:
    path = tmp_path / "clip.npy"
    np.save(path, array)
    with pytest.raises(InputError, match=message):
        import_frames(path, tmp_path / "r.mcap")
    assert [each.name for each in tmp_path.iterdir()] == ["clip.npy"]


def damages(whole: bytes) -> list[bytes]:
    """Contents of damaged files: empty, text, cut short and with a flipped bit."""
    middle = len(whole) // 2
    flipped = whole[:middle] + bytes([whole[middle] ^ 4]) + whole[middle + 1 :]
    return [b"", b"text", whole[:middle], whole[:-20], flipped]


def test_damaged_files_are_named(tmp_path: Path, folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """A .npy and a TIFF have no checksums."""
    third, pages, arrays = folder / "frame_2.png", tmp_path / "clip.tif", saved(tmp_path / "clip.npz", frames=STACK)
    cv2.imwritemulti(str(pages), pictures(5, np.uint16))
    raw = saved(tmp_path / "clip.npy", frames=STACK)
    for file, source, whole in (
        (third, folder, third.read_bytes()),
        (arrays, arrays, arrays.read_bytes()),
        (pages, pages, pages.read_bytes()),
        (raw, raw, raw.read_bytes()),
    ):
        for damaged in damages(whole)[: 5 if file in (third, arrays) else 4]:
            file.write_bytes(damaged)
            with pytest.raises(InputError, match="cut short or damaged") as error:
                import_frames(source, tmp_path / "r.mcap")
            assert str(file) in str(error.value)
    assert not list(tmp_path.glob("*.mcap"))
    assert capfd.readouterr() == ("", "")  # OpenCV and libtiff print nothing


def test_archives_hold_one_array(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"holds the arrays \['frames', 'boxes'\]; allowed: one"):
        import_frames(saved(tmp_path / "two.npz", frames=STACK, boxes=STACK[0]), tmp_path / "r.mcap")
    path = saved(tmp_path / "clip.npz", frames=STACK)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("readme.txt", "frames of a camera")
    np.testing.assert_array_equal(read_stack(path), STACK)


def test_a_small_archive_does_not_unpack_to_a_large_array(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(images, "_LARGE_ARRAY", 1 << 20)
    path = tmp_path / "bomb.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("a.npy", "w") as file:
        np.lib.format.write_array_header_1_0(file, {"descr": "|u1", "fortran_order": False, "shape": (2, 1024, 1024)})
        file.write(bytes(2 << 20))
    with pytest.raises(InputError, match=r"bomb\.npz: unpacks to 2 MB, \d+ times its size"):
        read_stack(path)


def test_folders_and_files_hold_the_pictures_of_one_kind(tmp_path: Path, folder: Path) -> None:
    file = folder / "0.tif"
    cv2.imwritemulti(str(file), pictures(2))
    with pytest.raises(InputError, match=r"clip: holds \.png and \.tif; allowed: pictures of one kind"):
        import_frames(folder, tmp_path / "r.mcap")
    for png in folder.glob("*.png"):
        png.unlink()
    with pytest.raises(InputError, match=r"0\.tif: holds 2 pictures; allowed: one in each file of a folder"):
        import_frames(folder, tmp_path / "r.mcap")
    cv2.imwrite(str(file), np.zeros((24, 32), np.float32))
    floats = r"0\.tif: page 0 has floating-point numbers \(SampleFormat\); allowed: unsigned whole numbers"
    with pytest.raises(InputError, match=floats):
        import_frames(folder, tmp_path / "r.mcap")
    cv2.imwrite(str(file), pictures(1)[0])
    with pytest.raises(InputError, match=r"0\.tif: is one picture; allowed: the folder"):
        import_frames(file, tmp_path / "r.mcap")


@pytest.mark.parametrize(("dtype", "compression"), [(np.uint16, 1), (np.uint8, 5), (np.uint16, 8)])
def test_tiff_is_imported_bit_for_bit(tmp_path: Path, dtype: type, compression: int) -> None:
    """Uncompressed, LZW and deflate; one picture a file, and all in one file."""
    images, options = pictures(12, dtype), [cv2.IMWRITE_TIFF_COMPRESSION, compression]
    folder, pages = tmp_path / "clip", tmp_path / "clip.tiff"
    folder.mkdir()
    for index, image in enumerate(images):
        cv2.imwrite(str(folder / f"frame_{index}.tif"), image, options)
    assert cv2.imwritemulti(str(pages), images, options)
    for source in (folder, pages):
        recording = open_recording(import_frames(source, tmp_path / f"{source.name}.mcap", rate_hz=25))
        assert recording.header.name == "clip"
        assert np.array_equal([frame.image for frame in recording.frames()], images)


@pytest.mark.parametrize(
    ("tag", "value", "kind", "message"),
    [
        (258, 12, 3, r"page 0 has 1 sample of 12 bits a pixel; allowed: 8 or 16 bit"),
        (277, 2, 3, r"page 0 has 2 samples of 16 bits a pixel; allowed: 8 or 16 bit, grey or colours"),
        (339, 2, 3, r"page 0 has signed whole numbers \(SampleFormat\); allowed: unsigned whole numbers"),
        (339, 2, 8, r"page 0: has pixels of type int16; allowed: unsigned, 8 or 16 bit"),  # a tag of signed type
        (262, 0, 3, r"page 0: 0 is white in it \(PhotometricInterpretation\); allowed: 0 is black"),
    ],
)
def test_tiff_with_other_pixels_is_refused(tmp_path: Path, tag: int, value: int, kind: int, message: str) -> None:
    path = tmp_path / "clip.tif"
    cv2.imwritemulti(str(path), pictures(3, np.uint16))
    data = bytearray(path.read_bytes())
    (first,) = struct.unpack_from("<I", data, 4)
    (entries,) = struct.unpack_from("<H", data, first)
    positions = range(first + 2, first + 2 + 12 * entries, 12)
    (entry,) = (at for at in positions if data[at : at + 2] == struct.pack("<H", tag))
    struct.pack_into("<HIH", data, entry + 2, kind, 1, value)
    path.write_bytes(data)
    with pytest.raises(InputError, match=message):
        import_frames(path, tmp_path / "r.mcap")
