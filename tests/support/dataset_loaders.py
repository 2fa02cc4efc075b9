"""Labels of exported data sets as other people's unmodified loaders read them, as JSON: run by .venv-oracles.

.venv-oracles/bin/python tests/support/dataset_loaders.py FOLDER > VALUES.json; FOLDER holds coco/, yolo/, mot/, ...
"""

from __future__ import annotations

import contextlib
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np


def of_pycocotools(folder: Path) -> dict[str, Any]:
    """Return [class, box, pixels of the mask (columns and rows)] of each picture."""
    from pycocotools.coco import COCO

    labels, found = COCO(str(folder / "annotations" / "train.json")), {}
    for image in labels.loadImgs(labels.getImgIds()):
        each = labels.loadAnns(labels.getAnnIds(image["id"]))
        names = [labels.loadCats(one["category_id"])[0]["name"] for one in each]
        masks = [np.argwhere(labels.annToMask(one)).tolist() for one in each]
        found[image["file_name"]] = [[n, one["bbox"], m] for n, one, m in zip(names, each, masks, strict=True)]
    return found


def of_supervision(folder: Path, format: str) -> dict[str, Any]:
    """Return [class, [left, top, right, bottom]] of each picture; the first pixel reaches from 0 to 1."""
    import supervision as sv

    pictures = str(folder / "images" / "train")
    if format == "coco":
        data = sv.DetectionDataset.from_coco(pictures, str(folder / "annotations" / "train.json"))
    else:
        data = sv.DetectionDataset.from_yolo(pictures, str(folder / "labels" / "train"), str(folder / "data.yaml"))
    found = {}
    for path, image, labels in data:
        assert image.shape[:2] == (40, 48)
        rows = zip(labels.class_id, labels.xyxy, strict=True)
        found[Path(path).name] = [[data.classes[number], np.asarray(box, float).tolist()] for number, box in rows]
    return found


def of_trackeval(folder: Path) -> dict[str, Any]:
    """Return [id, box] of each frame of class 1, frames of the sequence, and HOTA of the labels as a track."""
    from trackeval.datasets import MotChallenge2DBox
    from trackeval.metrics import HOTA

    tracks = folder / "tracks" / "labels" / "data"
    tracks.mkdir(parents=True, exist_ok=True)
    (tracks / "two.txt").write_text((folder / "train" / "two" / "gt" / "gt.txt").read_text())
    settings = {"GT_FOLDER": str(folder / "train"), "TRACKERS_FOLDER": str(folder / "tracks"), "SKIP_SPLIT_FOL": True}
    settings |= {"SEQMAP_FILE": str(folder / "seqmaps" / "train.txt"), "PRINT_CONFIG": False, "DO_PREPROC": False}
    data = MotChallenge2DBox(settings)
    raw = data.get_raw_seq_data("labels", "two")
    rows = [
        [[int(id), box.tolist()] for id, box in zip(ids, boxes, strict=True)]
        for ids, boxes in zip(raw["gt_ids"], raw["gt_dets"], strict=True)
    ]
    figures = HOTA().eval_sequence(data.get_preprocessed_seq_data(raw, "pedestrian"))
    return {"rows": rows, "frames": raw["num_timesteps"], "hota": float(np.mean(figures["HOTA"]))}


def of_pyirstdmetrics(folder: Path) -> dict[str, float]:
    """Return Pd and Fa of the masks as predictions of themselves, and of nothing."""
    import cv2
    import py_irstd_metrics as theirs

    found = {}
    for name, factor in (("same", 1), ("nothing", 0)):
        figures = theirs.ProbabilityDetectionAndFalseAlarmRate()
        for path in sorted((folder / "masks").glob("*.png")):
            mask = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
            assert mask is not None
            figures.update(factor * (mask / 255.0), mask > 0)
        values = figures.get()
        found[f"{name}_pd"] = float(np.ravel(values["probability_detection"])[0])
        found[f"{name}_fa"] = float(np.ravel(values["false_alarm"])[0])
    return found


def of_rosbags(folder: Path) -> dict[str, Any]:
    """Return the boxes [id, cx, cy, w, h], counts and times of a bag."""
    from rosbags.highlevel import AnyReader

    times, boxes, pictures = [], [], []
    with AnyReader([folder / "two"]) as reader:
        for connection, time, data in reader.messages():
            message: Any = reader.deserialize(data, connection.msgtype)
            if connection.topic == "/ir/image":
                times.append(time)
                pictures.append([message.encoding, message.width, message.height, int(message.data.sum())])
            else:
                each = [(one.id, one.bbox) for one in message.detections]
                boxes.append([[id, b.center.position.x, b.center.position.y, b.size_x, b.size_y] for id, b in each])
    return {"times": times, "boxes": boxes, "pictures": pictures}


def main() -> None:
    root = Path(sys.argv[1])
    with contextlib.redirect_stdout(sys.stderr):
        values = {
            "pycocotools": of_pycocotools(root / "coco"),
            "supervision coco": of_supervision(root / "coco", "coco"),
            "supervision yolo": of_supervision(root / "yolo", "yolo"),
            "trackeval": of_trackeval(root / "mot"),
            "pyirstdmetrics": of_pyirstdmetrics(root / "sirst"),
            "rosbags": of_rosbags(root / "ros2"),
        }
    json.dump(values, sys.stdout)


if __name__ == "__main__":
    main()
