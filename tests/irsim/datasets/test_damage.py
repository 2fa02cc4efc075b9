"""Real damage: disks that fill while a data set is written, and labels cut and flipped anywhere."""

from __future__ import annotations

import json
import multiprocessing
import resource
import shutil
import sys
from collections.abc import Iterator
from multiprocessing.connection import Connection
from pathlib import Path

import cv2
import numpy as np
import pytest

import irsim
from irsim.datasets import CARD, export_dataset
from irsim.errors import InputError
from irsim.recording.formats import WRITERS
from irsim.recording.formats.base import PictureSet
from irsim.recording.labels import read_labels

SCENE = """\
seed: 3
frames: 6
camera: {size: [160, 128], netd_mk: 200, noise: [{kind: white}]}
background: {kind: sky}
targets:
  - {id: jet, shape: {kind: fighter}, path: {kind: straight, start: [40, 60], speed: 1.5, range_m: 1500}}
  - {id: car, shape: {kind: point, temperature_k: 400, area_m2: 0.5},
     path: {kind: straight, start: [90, 80], speed: 1.7, range_m: 2000}}
"""


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("scene") / "two.yaml"
    path.write_text(SCENE)
    return path


def on_a_full_disk(scene: Path, out: Path, format: str, room: int, answer: Connection) -> None:
    """Export where no file can grow beyond `room` bytes, as at a quota, also for writers in C."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, resource.RLIM_INFINITY))
    try:
        export_dataset([scene], out, format, seeds=2)
        answer.send("")
    except BaseException as error:
        answer.send(f"{type(error).__name__}: {error}")


@pytest.mark.skipif(sys.platform != "linux", reason="file size limits of Linux")
@pytest.mark.parametrize("format", [name for name in WRITERS if name != "rrd"])
def test_a_full_disk_leaves_no_half_file(format: str, scene: Path, tmp_path: Path) -> None:
    """One line, no file of the clip that failed beside whole ones, and a card without it."""
    if (needs := WRITERS[format].needs) is not None:
        pytest.importorskip(needs[0])
    ours, theirs = multiprocessing.Pipe(duplex=False)
    child = multiprocessing.get_context("fork").Process(
        target=on_a_full_disk, args=(scene, tmp_path / "set", format, 6_000, theirs)
    )
    child.start()
    assert ours.poll(60)
    message = ours.recv()
    child.join()
    assert message.startswith("InputError: "), message
    assert "cannot be written: " in message
    assert "\n" not in message
    written = [path for path in (tmp_path / "set").rglob("*") if path.is_file()]
    assert [path for path in written if path.name.startswith(".") or path.stat().st_size >= 6_000] == []
    card = json.loads((tmp_path / "set" / CARD).read_text())
    assert (card["complete"], card["whole"], card["missing"]) == (False, [], ["two-s0", "two-s1"])
    for path in written:
        if path.suffix in (".png", ".jpg"):
            assert cv2.imread(str(path), cv2.IMREAD_UNCHANGED) is not None


LABELS = {
    "coco": "annotations/train.json",
    "yolo": "labels/train",
    "mot": "train/two/gt/gt.txt",
    "vot": "sequences/two",
    "anti-uav": "two/IR_label.json",
    "sirst": "masks",
    "png": "two/truth.csv",
}


def damaged(data: bytes, rng: np.random.Generator) -> Iterator[bytes]:
    """Yield data cut anywhere, with a flipped bit anywhere, and with foreign bytes in it."""
    for at in rng.integers(0, len(data), 12).tolist():
        yield data[:at]
        yield data[:at] + bytes([data[at] ^ 1 << int(rng.integers(8))]) + data[at + 1 :]
        yield data[:at] + rng.bytes(5) + data[at:]


@pytest.mark.parametrize("format", LABELS)
def test_damaged_labels_are_one_line_or_still_labels(format: str, scene: Path, tmp_path: Path) -> None:
    out = export_dataset([scene], tmp_path / "set", format)
    labels = out / LABELS[format]
    pictures = PictureSet((160, 128), 6, tuple(sorted(out.rglob("*_00000?.png"))[:6]) or (Path("f0.png"),) * 6)
    files = [labels] if labels.is_file() else sorted(path for path in labels.iterdir() if path.is_file())
    rng = np.random.default_rng(5)
    refused: list[str] = []
    for file in (files[0], files[-1]):
        whole = file.read_bytes()
        for data in damaged(whole, rng) if whole else ():
            file.write_bytes(data)
            try:
                found = read_labels(labels, 1.0, None, pictures)
            except InputError as error:
                refused.append(str(error))
                continue
            boxes = [target.box for there in found.targets.values() for target in there]
            assert all(np.isfinite([box.cx, box.cy, box.w, box.h]).all() and min(box.w, box.h) > 0 for box in boxes)
        file.write_bytes(whole)
    assert len(refused) > 10
    assert not [text for text in refused if "\n" in text or not text.startswith(str(tmp_path))]
    assert read_labels(labels, 1.0, None, pictures).targets


def test_mixed_sizes_stop_the_import(scene: Path, tmp_path: Path) -> None:
    out = export_dataset([scene], tmp_path / "set", "png")
    shutil.copy(out / "two" / "000000.png", tmp_path / "first.png")
    odd = cv2.imread(str(tmp_path / "first.png"), cv2.IMREAD_UNCHANGED)
    assert odd is not None
    cv2.imwrite(str(out / "two" / "000004.png"), odd[:-1])
    with pytest.raises(InputError, match=r"000004\.png: is 160x127, 16 bit but .*000000\.png is 160x128, 16 bit"):
        irsim.import_frames(out / "two", tmp_path / "r.mcap")
    assert not (tmp_path / "r.mcap").exists()
