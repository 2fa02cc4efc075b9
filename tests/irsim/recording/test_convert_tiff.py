"""Importing TIFF: counts come in bit for bit or not at all, and not all at once."""

from __future__ import annotations

import struct
import tracemalloc
from pathlib import Path

import cv2
import numpy as np
import pytest
from frame_folders import pictures

from irsim.errors import InputError
from irsim.recording import open_recording
from irsim.recording.images import page_sizes, read_pages
from irsim.recording.importers import import_frames


@pytest.mark.parametrize("compression", [1, 5, 8], ids=["none", "lzw", "deflate"])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_tiff_comes_in_bit_for_bit(tmp_path: Path, dtype: type, compression: int) -> None:
    images, way = pictures(12, dtype), [cv2.IMWRITE_TIFF_COMPRESSION, compression]
    folder, many = tmp_path / "clip", tmp_path / "clip.tiff"
    folder.mkdir()
    for index, image in enumerate(images):
        cv2.imwrite(str(folder / f"frame_{index}.tif"), image, way)
    assert cv2.imwritemulti(str(many), images, way)
    for source in (folder, many):
        recording = open_recording(import_frames(source, tmp_path / f"{source.name}.mcap", rate_hz=25))
        assert recording.header.name == "clip"
        assert np.array_equal([frame.image for frame in recording.frames()], images)


def test_broken_tiff_is_named(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    many = tmp_path / "clip.tif"
    cv2.imwritemulti(str(many), pictures(5, np.uint16))
    whole = many.read_bytes()
    circle = bytearray(whole)
    (first,) = struct.unpack_from("<I", whole, 4)
    (entries,) = struct.unpack_from("<H", whole, first)
    struct.pack_into("<I", circle, first + 2 + 12 * entries, first)
    far = b"II" + struct.pack("<HHHQ", 43, 8, 0, 2**63) + bytes(64)  # BigTIFF: its first page, or a tag, far away
    tag = struct.pack("<QHHQQQ", 1, 258, 3, 2**63, 2**64 - 5, 0)
    far_tag = b"II" + struct.pack("<HHHQ", 43, 8, 0, 16) + tag
    for broken in (b"", b"text", b"II*\0", whole[:-20], whole[: len(whole) // 2], bytes(circle), far, far_tag):
        many.write_bytes(broken)
        with pytest.raises(InputError, match=r"clip\.tif: is not a TIFF picture, or is cut short or damaged"):
            import_frames(many, tmp_path / "r.mcap")
    strips = bytearray(whole)
    place = strips.index(struct.pack("<HH", 273, 4)) + 8  # StripOffsets of a page, made to lie behind the end
    struct.pack_into("<I", strips, place, 2**31)
    many.write_bytes(strips)
    with pytest.raises(InputError, match=r"clip\.tif: page \d: is not a TIFF picture, or is cut short or damaged"):
        import_frames(many, tmp_path / "r.mcap")
    cv2.imwrite(str(many), pictures(1)[0])
    with pytest.raises(InputError, match=r"clip\.tif: is one picture; allowed: the folder"):
        import_frames(many, tmp_path / "r.mcap")
    (tmp_path / "celsius").mkdir()
    cv2.imwrite(str(tmp_path / "celsius" / "0.tif"), np.zeros((24, 32), np.float32))
    floats = r"0\.tif: page 0 has floating-point numbers \(SampleFormat\); allowed: unsigned whole numbers"
    with pytest.raises(InputError, match=floats):
        import_frames(tmp_path / "celsius", tmp_path / "r.mcap")
    cv2.imwritemulti(str(tmp_path / "celsius" / "0.tif"), pictures(2))
    with pytest.raises(InputError, match=r"0\.tif: holds 2 pictures; allowed: one in each file of a folder"):
        import_frames(tmp_path / "celsius", tmp_path / "r.mcap")
    cv2.imwrite(str(tmp_path / "celsius" / "0.png"), pictures(1)[0])
    with pytest.raises(InputError, match=r"celsius: holds \.png and \.tif; allowed: pictures of one kind"):
        import_frames(tmp_path / "celsius", tmp_path / "r.mcap")
    assert not list(tmp_path.glob("*.mcap"))
    assert capfd.readouterr() == ("", "")  # OpenCV and libtiff are silent


def write_tag(path: Path, tag: int, value: int, kind: int = 3) -> None:
    """Write another value, of the given type, into a tag of a TIFF's first page."""
    data = bytearray(path.read_bytes())
    (first,) = struct.unpack_from("<I", data, 4)
    (entries,) = struct.unpack_from("<H", data, first)
    (entry,) = (
        at for at in range(first + 2, first + 2 + 12 * entries, 12) if data[at : at + 2] == struct.pack("<H", tag)
    )
    struct.pack_into("<HIH", data, entry + 2, kind, 1, value)
    path.write_bytes(data)


@pytest.mark.parametrize(
    ("tag", "value", "message"),
    [
        (258, 12, r"page 0 has 1 sample of 12 bits a pixel; allowed: 8 or 16 bit"),
        (258, 1, r"page 0 has 1 sample of 1 bit a pixel; allowed: 8 or 16 bit"),
        (277, 2, r"page 0 has 2 samples of 16 bits a pixel; allowed: 8 or 16 bit, grey or colours"),
        (258, 32, r"page 0 has 1 sample of 32 bits a pixel; allowed: 8 or 16 bit"),
        (339, 2, r"page 0 has signed whole numbers \(SampleFormat\); allowed: unsigned whole numbers"),
        (339, 6, r"page 0 has complex numbers \(SampleFormat\); allowed: unsigned whole numbers"),
        (262, 0, r"page 0: 0 is white in it \(PhotometricInterpretation\); allowed: 0 is black"),
    ],
)
def test_tiff_of_which_other_counts_would_be_made_is_refused(
    tmp_path: Path, tag: int, value: int, message: str
) -> None:
    many = tmp_path / "clip.tif"
    cv2.imwritemulti(str(many), pictures(3, np.uint16))
    write_tag(many, tag, value)
    with pytest.raises(InputError, match=message):
        import_frames(many, tmp_path / "r.mcap")


def test_pixels_of_another_type_than_was_told_are_refused(tmp_path: Path) -> None:
    """A SampleFormat that is itself a signed number, which the standard has not and the decoder takes."""
    many = tmp_path / "clip.tif"
    cv2.imwritemulti(str(many), pictures(3, np.uint16))
    write_tag(many, 339, 2, kind=8)
    with pytest.raises(InputError, match=r"page 0: has pixels of type int16; allowed: unsigned, 8 or 16 bit"):
        import_frames(many, tmp_path / "r.mcap")


def test_pages_are_read_some_at_a_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In groups of four and a rest of two, and each alone where none fits."""
    images = pictures(150, np.uint16)
    cv2.imwritemulti(str(tmp_path / "clip.tif"), images)
    for room in (4 * images[0].nbytes, 1):
        monkeypatch.setattr("irsim.recording.tiff._TOGETHER_BYTES", room)
        recording = open_recording(import_frames(tmp_path / "clip.tif", tmp_path / "r.mcap"))
        assert np.array_equal([frame.image for frame in recording.frames()], images)


def test_large_pages_are_not_read_all_at_once(tmp_path: Path) -> None:
    """24 pages of 8 MB are 192 MB."""
    path = tmp_path / "large.tif"
    cv2.imwritemulti(str(path), [np.full((2000, 2000), k, np.uint16) for k in range(24)])
    sizes = page_sizes(path)
    tracemalloc.start()
    try:
        assert [int(page[0, 0]) for page in read_pages(path, sizes)] == list(range(24))
        assert tracemalloc.get_traced_memory()[1] < 80e6
    finally:
        tracemalloc.stop()
