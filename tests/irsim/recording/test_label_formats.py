"""Labels of other projects: conventions against values worked by hand, guesses, and wrong files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from irsim.errors import InputError
from irsim.recording import open_recording
from irsim.recording.formats import READERS, possible_formats
from irsim.recording.importers import import_frames
from irsim.types import Box

COLUMNS, ROWS = 40, 20
BOX = Box(11.5, 6.0, 4.0, 3.0)
"""The pixels of columns 10 to 13 and rows 5 to 7, counted from 0."""

COCO: dict[str, Any] = {
    "images": [{"id": 7 + index, "file_name": f"f{index}.png", "width": 40, "height": 20} for index in range(2)],
    "categories": [{"id": 3, "name": "jet"}],
    "annotations": [{"id": 1, "image_id": 7, "category_id": 3, "bbox": [10, 5, 4, 3], "track_id": 2}],
}
VOC = (
    "<annotation><size><width>40</width><height>20</height></size><object><name>jet</name><bndbox>"
    "<xmin>11</xmin><ymin>6</ymin><xmax>14</xmax><ymax>8</ymax></bndbox></object></annotation>"
)
MASK = np.zeros((ROWS, COLUMNS), np.uint8)
MASK[5:8, 10:14] = 255

# Each format's text for BOX in frame 0 of two. Of a whole picture of 40x20, (11.5 + .5)/40 = .3, (6 + .5)/20 = .325.
BY_HAND: dict[str, dict[str, str | np.ndarray]] = {
    "csv": {"gt.csv": "frame,x,y,w,h,id,cls\n0,10,5,4,3,2,jet\n1,,,,,2,\n"},
    "mot": {"gt.txt": "1,2,11,6,4,3,1,1,0.5\n"},
    "vot": {"gt.txt": "10,5,4,3\nnan,nan,nan,nan\n"},
    "vot polygon": {"gt.txt": "10,5,14,5,14,8,10,8\n0\n"},
    "vot turned": {"gt.txt": "12,5,14,6.5,12,8,10,6.5\n1\n"},
    "coco": {"gt.json": json.dumps(COCO)},
    "yolo": {"gt/f0.txt": "0 .3 .325 .1 .15\n", "gt/f1.txt": "", "gt/classes.txt": "jet\n"},
    "voc": {"gt/f0.xml": VOC, "gt/f1.xml": "<annotation></annotation>"},
    "anti-uav": {"gt.json": '{"exist": [1, 0], "gt_rect": [[10, 5, 4, 3], []]}'},
    "sirst": {"gt/f0.png": MASK, "gt/f1.png": np.zeros_like(MASK)},
}


def laid(folder: Path, files: dict[str, str | np.ndarray]) -> Path:
    """Write label files; return the file or folder that holds them."""
    for name, content in files.items():
        (folder / name).parent.mkdir(exist_ok=True)
        if isinstance(content, str):
            (folder / name).write_text(content)
        else:
            cv2.imwrite(str(folder / name), content)
    return folder / next(iter(files)).split("/")[0]


@pytest.fixture
def clip(tmp_path: Path) -> Path:
    (tmp_path / "clip").mkdir()
    for index in range(2):
        cv2.imwrite(str(tmp_path / "clip" / f"f{index}.png"), np.full((ROWS, COLUMNS), index, np.uint8))
    return tmp_path / "clip"


@pytest.mark.parametrize("name", BY_HAND)
def test_conventions_against_values_by_hand(name: str, clip: Path, tmp_path: Path) -> None:
    labels, format = laid(tmp_path, BY_HAND[name]), name.split()[0]
    assert possible_formats(labels)[0] == format
    for given in (None, format):
        read = open_recording(import_frames(clip, tmp_path / "r.mcap", truth=labels, truth_format=given, rate_hz=30))
        first, second = read.truths()
        (target,) = first.targets
        assert (target.box.cx, target.box.cy, target.box.w, target.box.h) == pytest.approx((11.5, 6.0, 4.0, 3.0))
        assert target.center == pytest.approx((11.5, 6.0))
        assert second.targets == ()
        assert target.visible == (0.5 if format == "mot" else None)
        assert target.cls == ("jet" if format in ("csv", "coco", "yolo", "voc") else None)
        numbered = {"yolo": "jet-1", "voc": "jet-1", "sirst": "target-1", "vot": "target", "anti-uav": "target"}
        assert target.id == numbered.get(format, "target-2")


def test_a_half_box_shift_would_show() -> None:
    """A centre taken for a corner moves a box of 4 px by 2 px: its IoU falls to 1/3 and below."""
    assert BOX.iou(Box(BOX.cx + 2, BOX.cy, BOX.w, BOX.h)) == pytest.approx(1 / 3)


@pytest.mark.parametrize("names", ["names: [sky, jet]", "names:\n  1: jet\n  0: sky", "names:\n- sky\n- 'jet'"])
def test_classes_of_yolo_from_its_data_file(names: str, clip: Path, tmp_path: Path) -> None:
    (tmp_path / "data.yaml").write_text(f"train: images\n{names}\nnc: 2\n")
    labels = laid(tmp_path, {"gt/f0.txt": "1 .3 .325 .1 .15\n"})
    read = open_recording(import_frames(clip, tmp_path / "r.mcap", truth=labels))
    assert [target.cls for target in next(read.truths()).targets] == ["jet"]


def test_names_of_labels_for_the_user(clip: Path, tmp_path: Path) -> None:
    labels = laid(tmp_path, BY_HAND["yolo"])
    notes = open_recording(import_frames(clip, tmp_path / "r.mcap", truth=labels, rate_hz=30)).contents.notes
    assert notes[0] == "gt is read as yolo: a folder of .txt files"
    assert notes[1].startswith("labels without ids: ")


def changed(**keys: Any) -> dict[str, str | np.ndarray]:
    return {"gt.json": json.dumps(COCO | keys)}


def annotation(**keys: Any) -> dict[str, str | np.ndarray]:
    return changed(annotations=[COCO["annotations"][0] | keys])


TWICE = [COCO["annotations"][0], COCO["annotations"][0] | {"id": 2}]
WRONG: list[tuple[str | None, dict[str, str | np.ndarray], str]] = [
    ("coco", BY_HAND["mot"], r"gt\.txt: looks like mot \(lines of 6 to 10 numbers .*\), not coco; allowed: mot"),
    ("mot", BY_HAND["anti-uav"], r"looks like anti-uav \(JSON with exist and gt_rect\), not mot"),
    ("yolo", BY_HAND["voc"], r"gt: looks like voc \(a folder of \.xml files\), not yolo"),
    ("csv", BY_HAND["vot"], r"looks like vot \(a line of 4, 6, 8, \.\.\. numbers a frame\), not csv"),
    ("pascal", BY_HAND["voc"], "format 'pascal': allowed: csv, mot, vot, coco, yolo, voc, anti-uav, sirst"),
    (None, {"gt/a.doc": ""}, r"gt: holds no labels; allowed: a folder of \.txt"),
    (None, {"gt.txt": "1,1,11,6,4,3\n3,1,11,6,4,3\n"}, r"gt\.txt:2: frame 3 is past the end; allowed: 1 to 2, counted"),
    (None, {"gt.txt": "1,1,11,6,4,3\n1,1,12,6,4,3\n"}, r"gt\.txt:2: frame 1 has 'target-1' in line 1 already"),
    ("mot", {"gt.txt": "0,1,11,6,4,3\n"}, r"gt\.txt:1: frame 0, id 1: allowed: whole numbers, frames counted from 1"),
    (None, {"gt.txt": "1,1,11,6,0,3\n"}, r"gt\.txt:1: a box of 0 x 3 px; allowed: more than 0 px"),
    (
        None,
        {"gt.txt": "1,1,11,6,4,3,1,2\n", "labels.txt": "jet\n"},
        "class 2 has no name in labels.txt; allowed: 1 to",
    ),
    (None, {"gt.txt": "1,1,1,1,1,1,1,1\n", "labels.txt": "a\na\n"}, "two classes are called 'a'"),
    (
        None,
        {"gt.txt": "1,2,3,4\n1,2,3,4\n1,2,3,4\n"},
        r"gt\.txt:3: frame 2 is past the end; allowed: 0 to 1, counted from 0",
    ),
    (None, {"gt.txt": "m5,5,2,2,1,3\n"}, r"gt\.txt:1: is a mask; allowed: rectangles"),
    ("vot", {"gt.txt": "1,2,3,4\n1,2,3,4,5\n"}, "looks like csv"),
    (None, {"gt.json": '{"exist": [1], "gt_rect": []}'}, "allowed: two lists of the same length"),
    (None, {"gt.json": '{"exist": [2], "gt_rect": [[1, 2, 3, 4]]}'}, r"gt_rect\[0\]: exist is 2; allowed: 0 or 1"),
    (None, {"gt.json": '{"exist": [1],'}, r"gt\.json:1:15: is not JSON"),
    (None, annotation(bbox=[1, 2, 3]), r"annotations\[0\]: bbox \[1, 2, 3\]: allowed: \[x, y, w, h\], px"),
    (None, annotation(bbox=[1, 2, -3, 4]), r"annotations\[0\]: a box of -3 x 4 px"),
    (None, changed(annotations=TWICE), r"annotations\[1\]: frame 0 has 'target-2' in annotations\[0\] already"),
    (
        None,
        changed(images=[COCO["images"][0] | {"width": 41}]),
        r"images\[0\]: f0\.png is 41x20 px there, 40x20 in the",
    ),
    (None, changed(images=[COCO["images"][0] | {"file_name": "g.png"}]), "names none of the pictures, such as f0.png"),
    (None, changed(categories=[{"id": 1, "name": "a"}, {"id": 2, "name": "a"}]), r"categories 1 and 2 collide \('a'\)"),
    (None, {"gt/f0.txt": "0 .3 1.2 .1 .1\n"}, r"f0\.txt:1: \.3 1\.2 \.1 \.1: allowed: shares of the picture, 0 to 1"),
    (None, {"gt/f0.txt": "1 .3 .2 .1 .1\n", "gt/classes.txt": "jet\n"}, "class 1 has no name; allowed: 0 to 0"),
    (None, {"gt/f0.txt": "0 .3 .2 .1 .1\n", "gt/classes.txt": "a\na\n"}, "two classes are called 'a'"),
    (None, {"gt/f5.txt": "0 .3 .2 .1 .1\n"}, r"f5\.txt: there is no picture f5; allowed: labels of the imported"),
    (None, {"gt/f0.xml": VOC.replace(">40<", ">41<")}, r"f0\.xml: is of a picture of 41x20 px; allowed: 40x20"),
    (None, {"gt/f0.xml": "<!DOCTYPE a [<!ENTITY b 'c'>]><annotation/>"}, "has a document type; allowed: XML without"),
    (None, {"gt/f0.xml": "<annotation>"}, r"f0\.xml:1: is not XML"),
    (None, {"gt/f0.png": MASK[:10]}, r"f0\.png: is 40x10 px, its picture 40x20"),
]


@pytest.mark.parametrize(("format", "files", "message"), WRONG)
def test_wrong_labels(
    format: str | None, files: dict[str, str | np.ndarray], message: str, clip: Path, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=message) as error:
        import_frames(clip, tmp_path / "r.mcap", truth=laid(tmp_path, files), truth_format=format)
    assert "\n" not in str(error.value)
    assert not (tmp_path / "r.mcap").exists()


@pytest.mark.parametrize("name", ["coco", "yolo", "voc", "sirst"])
def test_labels_that_name_pictures_need_a_folder(name: str, tmp_path: Path) -> None:
    np.save(tmp_path / "clip.npy", np.zeros((2, ROWS, COLUMNS), np.uint8))
    with pytest.raises(InputError, match="names pictures; allowed with a folder of pictures only"):
        import_frames(tmp_path / "clip.npy", tmp_path / "r.mcap", truth=laid(tmp_path, BY_HAND[name]))


def test_every_reader_is_tested_by_hand() -> None:
    """The bag, which is no text, in test_image_topics.py."""
    assert {name.split()[0] for name in BY_HAND} == set(READERS) - {"ros2"}


def test_boxes_outside_are_noted(clip: Path, tmp_path: Path) -> None:
    labels = laid(tmp_path, {"gt.txt": "1,1,11,6,4,3\n2,1,60,6,4,3\n"})
    notes = open_recording(import_frames(clip, tmp_path / "r.mcap", truth=labels, rate_hz=30)).contents.notes
    assert "boxes outside the picture of 40x20 px: 1 of 2, first in frame 1" in notes


def test_jpeg_pictures_are_imported(tmp_path: Path) -> None:
    (tmp_path / "clip").mkdir()
    even = np.full((ROWS, COLUMNS), 77, np.uint8)
    cv2.imwrite(str(tmp_path / "clip" / "0.jpg"), even, [cv2.IMWRITE_JPEG_QUALITY, 100])
    read = open_recording(import_frames(tmp_path / "clip", tmp_path / "r.mcap"))
    assert np.array_equal(next(read.frames()).image, even)
    (tmp_path / "clip" / "0.jpg").write_bytes((tmp_path / "clip" / "0.jpg").read_bytes()[:-30])
    with pytest.raises(InputError, match=r"0\.jpg: is not a JPEG picture, or is cut short or damaged"):
        import_frames(tmp_path / "clip", tmp_path / "r.mcap")
