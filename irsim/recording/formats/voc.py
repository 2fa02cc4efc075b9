"""PASCAL VOC: an XML file a picture, with whole pixels counted from 1, xmax and ymax inside the box.

Everingham et al., "The PASCAL VOC Challenge 2012 Development Kit", section 3.3. It is read only.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

from irsim.errors import InputError
from irsim.recording.formats.base import LabelRow, PictureSet, file_text, finite, numbered_by_class, sized
from irsim.recording.formats.yolo import label_files
from irsim.types import Box

_EDGES = ("xmin", "ymin", "xmax", "ymax")


def read(path: Path, pictures: PictureSet) -> Iterator[LabelRow]:
    """Yield the objects of a folder of XML files with the names of the pictures."""
    for file, frame in label_files(path, ".xml", pictures):
        yield LabelRow(str(file), file.name, frame, None)
        found = [(cls, box) for cls, box in _objects(file, pictures.size)]
        classes = iter([cls for cls, _ in found])
        for name, box in numbered_by_class(found):
            yield LabelRow(str(file), f"{file.name}", frame, box, name, next(classes))


def _objects(file: Path, size: tuple[int, int]) -> Iterator[tuple[str, Box]]:
    text = file_text(file, "allowed: XML")
    if "<!" in text.replace("<!--", ""):  # a document type may define entities without end
        raise InputError(f"{file}: has a document type; allowed: XML without one")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise InputError(f"{file}:{error.position[0]}: is not XML: {error}") from None
    stated = tuple(root.findtext(f"size/{side}", "").strip() for side in ("width", "height"))
    if all(stated) and stated != tuple(map(str, size)):
        raise InputError(f"{file}: is of a picture of {'x'.join(stated)} px; allowed: {size[0]}x{size[1]}")
    for number, each in enumerate(root.iter("object"), 1):
        place = f"{file}: object {number}"
        left, top, right, bottom = (finite(each.findtext(f"bndbox/{edge}", "").strip(), place) for edge in _EDGES)
        yield (
            (each.findtext("name") or "").strip(),
            sized((left - 1, top - 1, right - left + 1, bottom - top + 1), place),
        )
