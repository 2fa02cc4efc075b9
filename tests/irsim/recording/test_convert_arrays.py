"""Importing arrays that numpy saved."""

from __future__ import annotations

import contextlib
import os
import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from irsim.errors import InputError
from irsim.recording import open_recording
from irsim.recording.images import read_stack
from irsim.recording.importers import import_frames

STACK = np.random.default_rng(0).integers(0, 1 << 14, (5, 12, 16)).astype(np.uint16)


def saved(path: Path, **arrays: npt.NDArray[np.generic]) -> Path:
    """A .npy of one array, a .npz of any number, compressed."""
    if path.suffix.lower() == ".npy":
        with path.open("wb") as file:  # or numpy adds an ending
            (array,) = arrays.values()
            np.save(file, array)
    else:
        np.savez_compressed(path, **arrays)  # type: ignore[arg-type]  # mypy takes an array's name for another parameter's
    return path


@pytest.mark.parametrize("name", ["clip.npy", "clip.npz", "CLIP.NPY"])
@pytest.mark.parametrize("dtype", ["uint8", "<u2", ">u2"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_an_array_comes_in_bit_for_bit(tmp_path: Path, name: str, dtype: str, order: str) -> None:
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
        (STACK[None], r"is an array of 1 x 5 x 12 x 16; allowed: frames x rows x columns"),
        (STACK[:0], r"is an array of 0 x 12 x 16; allowed"),
        (np.uint16(3), r"is an array of a single number; allowed"),
        (STACK.astype(np.float32), r"has pixels of type float32; allowed: unsigned, 8 or 16 bit"),
        (STACK.astype(np.int16), r"has pixels of type int16; allowed: unsigned, 8 or 16 bit"),
        (np.zeros((2, 3, 4), [("a", "u2")]), r"has pixels of type .*; allowed: unsigned"),
        (np.full((2, 3, 4), None), r"is no array of numbers that numpy saved"),
    ],
)
def test_other_arrays_are_told_in_one_line(tmp_path: Path, array: npt.NDArray[np.generic], message: str) -> None:
    path = tmp_path / "clip.npy"
    np.save(path, array)
    with pytest.raises(InputError, match=message):
        import_frames(path, tmp_path / "r.mcap")
    assert [each.name for each in tmp_path.iterdir()] == ["clip.npy"]


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({}, r"holds the arrays \[\]; allowed: one"),
        ({"frames": STACK, "boxes": STACK[0]}, r"holds the arrays \['frames', 'boxes'\]; allowed: one"),
    ],
)
def test_an_archive_holds_one_array(
    tmp_path: Path, arrays: Mapping[str, npt.NDArray[np.generic]], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        import_frames(saved(tmp_path / "clip.npz", **arrays), tmp_path / "r.mcap")


@pytest.mark.parametrize("name", ["clip.npy", "clip.npz"])
def test_a_file_that_is_cut_anywhere_is_told_in_one_line(tmp_path: Path, name: str) -> None:
    path = saved(tmp_path / name, frames=STACK)
    whole = path.read_bytes()
    for left in [*range(0, len(whole), len(whole) // 60), len(whole) - 1]:
        path.write_bytes(whole[:left])
        with pytest.raises(InputError, match=r"clip\.np[yz]: .*cut short or damaged"):
            import_frames(path, tmp_path / "r.mcap")
    assert not (tmp_path / "r.mcap").exists()


def flipped(path: Path, place: int, bits: int) -> None:
    whole = path.read_bytes()
    path.write_bytes(whole[:place] + bytes([whole[place] ^ bits]) + whole[place + 1 :])


def test_a_flipped_byte_of_an_archive_is_told_in_one_line(tmp_path: Path) -> None:
    path = saved(tmp_path / "clip.npz", frames=STACK)
    length = path.stat().st_size
    told = []
    for place in range(0, length, length // 80):
        flipped(path, place, 0x55)
        try:
            recording = open_recording(import_frames(path, tmp_path / "r.mcap"))
        except InputError as error:
            told.append(str(error))
        else:  # a date, or an attribute
            np.testing.assert_array_equal([frame.image for frame in recording.frames()], STACK)
        flipped(path, place, 0x55)
    assert len(told) > 60
    assert not any("\n" in message for message in told)


def test_a_flipped_bit_of_a_head_is_told_in_one_line_or_is_another_array(tmp_path: Path) -> None:
    """The rest of a .npy has no checksum; its head is Python, which ends in many ways."""
    path = saved(tmp_path / "clip.npy", frames=STACK)
    told = []
    for place in range(128):
        for bit in (1, 4, 32, 128):
            flipped(path, place, bit)
            with contextlib.suppress(InputError):
                told.append(read_stack(path))
            flipped(path, place, bit)
    assert 0 < len(told) < 128
    assert all(each.ndim == 3 for each in told)


@pytest.mark.parametrize(
    ("head", "says"),
    [
        ("{'descr': '<u2', 'fortran_order': False, 'shape': (True, 4, 4)}", "is no array of numbers that numpy saved"),
        ("-" * 9000, "is damaged|is no array of numbers"),  # as the version of Python ends it
    ],
)
def test_a_head_that_says_nonsense_is_told_in_one_line(tmp_path: Path, head: str, says: str) -> None:
    path = tmp_path / "clip.npy"
    text = head.encode() + b"\n"
    path.write_bytes(b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + bytes(64))
    with pytest.raises(InputError, match=says):
        read_stack(path)


def test_other_files_may_lie_in_an_archive_and_none_is_an_array(tmp_path: Path) -> None:
    path = saved(tmp_path / "clip.npz", frames=STACK)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("readme.txt", "frames of a camera")
        archive.mkdir("notes")
    np.testing.assert_array_equal(read_stack(path), STACK)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("frames.npy", "frames of a camera")
    with pytest.raises(InputError, match="is no array of numbers that numpy saved"):
        read_stack(path)


def test_a_name_that_is_no_text_is_taken_for_one(tmp_path: Path) -> None:
    path = Path(os.fsdecode(os.fsencode(tmp_path) + b"/half-\xff.npy"))
    saved(path, frames=STACK)
    recording = open_recording(import_frames(path, tmp_path / "r.mcap"))
    assert recording.header.name == "half-\N{REPLACEMENT CHARACTER}"
