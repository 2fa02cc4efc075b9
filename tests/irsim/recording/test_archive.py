"""Archived recordings: images bit for bit, near the noise bound, and one line where they cannot be read."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from recording_fakes import Noise, same_frames

import irsim
from irsim.errors import InputError
from irsim.recording import damages, open_recording, record, recover
from irsim.recording.archive import decode_archived
from irsim.recording.messages import decode_image, encode_archived_image
from irsim.types import Image


@pytest.mark.parametrize("bits", [8, 14, 16])
def test_frames_and_truth_are_read_bit_for_bit(tmp_path: Path, bits: int) -> None:
    pytest.importorskip("imagecodecs")
    source = Noise(bits=bits)
    recording = open_recording(record(source, tmp_path / "r.mcap", compression="archive"))
    assert same_frames(recording.frames(), source.frames())
    assert not list(damages(recording))
    assert not recording.frame(3).image.flags.writeable
    assert recording.info()["topics"]["/ir/image"] == len(source)


def gaussian(sigma: float) -> Image:
    found: Image = np.rint(np.random.default_rng(3).normal(5000, sigma, (256, 320))).astype(np.uint16)
    return found


@pytest.mark.parametrize("sigma", [1.5, 6, 40])
def test_noise_takes_few_bits_more_than_its_entropy(sigma: float) -> None:
    """The codec predicts from neighbours, whose noise adds: within .5 bit a pixel of log2(sigma sqrt(2 pi e))."""
    pytest.importorskip("imagecodecs")
    image = gaussian(sigma)
    taken = 8 * len(encode_archived_image(image, 0)) / image.size
    bound = math.log2(sigma * math.sqrt(2 * math.pi * math.e))
    print(f"sigma {sigma}: {taken:.2f} bits a pixel, bound {bound:.2f}")
    assert bound - 0.05 < taken < bound + 0.5


def test_scene_is_smaller_than_with_other_compressions(tmp_path: Path) -> None:
    pytest.importorskip("imagecodecs")
    source = irsim.Rendering(irsim.load("sky", ["frames=4"]))
    words: list[Any] = ["none", "zstd", "archive"]
    none, zstd, archive = (record(source, tmp_path / f"{w}.mcap", compression=w).stat().st_size for w in words)
    assert archive < 0.7 * zstd < 0.7 * none


def test_images_of_other_sizes_are_refused() -> None:
    pytest.importorskip("imagecodecs")
    data = encode_archived_image(gaussian(3), 0)
    assert decode_image(memoryview(data), (320, 256)).shape == (256, 320)
    assert decode_image(memoryview(data)).shape == (256, 320)
    with pytest.raises(ValueError, match="format"):
        decode_image(memoryview(data), (256, 320))
    message = CompressedImage.FromString(data)
    for form in ("jxl; 319x256 mono16", "jxl; 320x256 mono8", "jxl; 99999x99999 mono16", "jxl; 0x256 mono16", "jxl"):
        message.format = form
        with pytest.raises(ValueError, match=r"out\.|format"):
            decode_archived(message)


def test_damage_is_one_line_and_the_rest_is_recovered(tmp_path: Path) -> None:
    pytest.importorskip("imagecodecs")
    source = Noise(count=8)
    path = record(source, tmp_path / "r.mcap", compression="archive")
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 16
    path.write_bytes(data)
    assert list(damages(open_recording(path)))
    kept = open_recording(recover(path, tmp_path / "whole.mcap"))
    assert 5 <= len(kept) < 8
    indices = [round(frame.time * source.rate_hz) for frame in kept.frames()]
    for frame, index in zip(kept.frames(), indices, strict=True):
        assert np.array_equal(frame.image, source.frame(index).image)


def test_missing_package_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("imagecodecs")
    path = record(Noise(), tmp_path / "r.mcap", compression="archive")
    monkeypatch.setattr("irsim.recording.archive.importlib.util.find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"compression archive: needs imagecodecs: pip install 'irtrack\[archive\]'"):
        record(Noise(), tmp_path / "s.mcap", compression="archive")
    assert not (tmp_path / "s.mcap").exists()
    with pytest.raises(InputError, match="needs imagecodecs"):
        open_recording(path).frame(0)
