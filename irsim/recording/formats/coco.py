"""COCO: one JSON file a split. bbox is [x, y, w, h], px from the picture's corner; masks are run lengths (RLE).

The first pixel reaches from 0 to 1, so x is the number of the first column, counted from 0. Lin et al., "Microsoft
COCO", ECCV 2014; cocodataset.org, "Data format". Boxes are cut at the picture's edges. `track_id` numbers a target
through its clip.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from irsim.errors import InputError, is_number
from irsim.recording.formats.base import (
    Clip,
    LabelledFrame,
    LabelRow,
    PictureSet,
    class_of,
    clipped,
    json_value,
    numbered_by_class,
    sized,
)
from irsim.recording.formats.folder import DatasetFolder
from irsim.types import Bools

_IDS = ("name", "track_id", "instance_id")
"""Keys of an annotation that say which target it is, the first that is there."""


def read(path: Path, pictures: PictureSet) -> Iterator[LabelRow]:
    """Yield the boxes of the pictures, found by file name; annotations of other pictures are left out."""
    value = json_value(path)
    if not isinstance(value, dict) or not all(isinstance(value.get(key), list) for key in ("images", "annotations")):
        raise InputError(f"{path}: allowed: a mapping with the lists images, annotations and categories")
    classes = _classes(value.get("categories") or [], path)
    frames = _frames(value["images"], pictures, path)
    for frame in frames.values():
        yield LabelRow(str(path), "images", frame, None)
    by_frame: dict[int, list[tuple[int, Mapping[str, Any]]]] = {}
    for number, each in enumerate(value["annotations"]):
        place = f"{path}: annotations[{number}]"
        if not isinstance(each, dict) or "image_id" not in each or "bbox" not in each:
            raise InputError(f"{place}: allowed: a mapping with image_id, bbox and category_id")
        if each["image_id"] in frames:
            by_frame.setdefault(frames[each["image_id"]], []).append((number, each))
    for frame, found in sorted(by_frame.items()):
        named = [(classes.get(each.get("category_id")), (number, each)) for number, each in found]
        for fallback, (number, each) in numbered_by_class(named):
            place, bbox = f"{path}: annotations[{number}]", each["bbox"]
            if not isinstance(bbox, list) or len(bbox) != 4 or not all(map(is_number, bbox)):
                raise InputError(f"{place}: bbox {bbox!r}: allowed: [x, y, w, h], px")
            name = next((str(each[key]) for key in _IDS if each.get(key) is not None), fallback)
            box, cls = sized(list(map(float, bbox)), place), classes.get(each.get("category_id"))
            yield LabelRow(place, f"annotations[{number}]", frame, box, name, cls)


def _classes(categories: Any, path: Path) -> dict[Any, str]:
    classes: dict[Any, str] = {}
    for number, each in enumerate(categories):
        if not isinstance(each, dict) or not isinstance(each.get("name"), str) or not is_number(each.get("id")):
            raise InputError(f"{path}: categories[{number}]: allowed: a mapping with id and name")
        taken = next((id for id, name in classes.items() if name == each["name"]), None)
        if taken is not None or each["id"] in classes:
            raise InputError(
                f"{path}: categories {taken or each['id']} and {each['id']} collide ({each['name']!r}); "
                "allowed: a number and a name once"
            )
        classes[each["id"]] = each["name"]
    return classes


def _frames(images: Sequence[Any], pictures: PictureSet, path: Path) -> dict[Any, int]:
    """Return the number of the frame of each image of the file that is among the pictures, by its id."""
    stems, frames = pictures.frames_by_stem(path), dict[Any, int]()
    for number, each in enumerate(images):
        if not isinstance(each, dict) or not isinstance(each.get("file_name"), str) or "id" not in each:
            raise InputError(f"{path}: images[{number}]: allowed: a mapping with id and file_name")
        name = Path(each["file_name"])
        frame = stems.get(name.stem)
        if frame is None or pictures.files[frame].name != name.name:
            continue
        stated = each.get("width", pictures.size[0]), each.get("height", pictures.size[1])
        if stated != pictures.size:
            raise InputError(
                f"{path}: images[{number}]: {name} is {stated[0]}x{stated[1]} px there, {pictures.size[0]}x"
                f"{pictures.size[1]} in the folder; allowed: the pictures that were labelled"
            )
        frames[each["id"]] = frame
    if not frames:
        raise InputError(f"{path}: names none of the pictures, such as {pictures.files[0].name}; allowed: their labels")
    return frames


def run_lengths(mask: Bools) -> list[int]:
    """Return the lengths of runs of 0, 1, 0, ... of a mask read down its columns, the first one perhaps 0."""
    flat = mask.T.reshape(-1)
    edges = np.flatnonzero(np.diff(flat)) + 1
    runs = np.diff(np.concatenate(([0], edges, [flat.size]))).tolist()
    return [0, *runs] if flat[0] else runs


def write(folder: DatasetFolder, clip: Clip, frames: Iterator[LabelledFrame]) -> list[tuple[str, int, list[Any]]]:
    """Write the pictures of a clip; return the file name, number and annotations of each."""
    written = []
    for frame in frames:
        name = f"{clip.name}_{frame.number:06}.png"
        folder.picture(f"images/{clip.split_or_train}/{name}", frame.image)
        written.append((name, frame.number, [_annotation(target, frame, clip) for target in frame.targets]))
    return written


def _annotation(target: Any, frame: LabelledFrame, clip: Clip) -> dict[str, Any]:
    box = clipped(target.box, clip.size)
    found: dict[str, Any] = {
        "category_id": clip.classes.index(class_of(target)) + 1,
        "bbox": list(box.pixels),
        "area": box.w * box.h,
        "iscrowd": 0,
        "segmentation": [],
        "name": target.id,
    }
    mask = None if frame.masks is None else frame.masks.get(target.id)
    if mask is not None:
        found["segmentation"] = {"size": list(mask.shape), "counts": run_lengths(mask)}
        found["area"] = int(mask.sum())
    if target.visible is not None:
        found["visibility"] = target.visible
    return found


def finish(folder: DatasetFolder, parts: Sequence[tuple[Clip, list[tuple[str, int, list[Any]]]]]) -> None:
    """Write annotations/SPLIT.json. Numbers of images, annotations and tracks begin at 1 in each."""
    classes = [{"id": number, "name": name} for number, name in enumerate(parts[0][0].classes, 1)]
    for split in dict.fromkeys(clip.split_or_train for clip, _ in parts):
        images, annotations, tracks = list[Any](), list[Any](), dict[Any, int]()
        for clip, written in parts:
            if clip.split_or_train == split:
                for name, number, found in written:
                    facts = {"file_name": name, "width": clip.size[0], "height": clip.size[1]}
                    images.append({"id": len(images) + 1, **facts, "video": clip.name, "frame_index": number})
                    for each in found:
                        track = tracks.setdefault((clip.name, each["name"]), len(tracks) + 1)
                        own = {"id": len(annotations) + 1, "image_id": len(images), "track_id": track}
                        annotations.append({**own, **each})
        value = {"images": images, "annotations": annotations, "categories": classes}
        folder.text(f"annotations/{split}.json", json.dumps(value, ensure_ascii=False) + "\n")
