"""A tracker on vot-trax, the reference implementation of TraX: `python vot_tracker.py REGION PICTURE`.

It follows the brightest pixel, and tells the sum of what it was shown as its confidence.
"""

from __future__ import annotations

import sys
from typing import Any

import cv2
import numpy as np
import trax


def shown(picture: Any) -> Any:
    if picture.type() == "path":
        return cv2.imread(picture.path(), cv2.IMREAD_UNCHANGED)
    if picture.type() == "buffer":
        return cv2.imdecode(np.frombuffer(picture.buffer(), np.uint8), cv2.IMREAD_UNCHANGED)
    return picture.array()[:, :, 0]


def around(region: Any) -> tuple[float, float]:
    """Width and height."""
    if region.type == "rectangle":
        return tuple(region.bounds()[2:])
    if region.type == "polygon":
        points = np.array([region.get(k) for k in range(region.size())])
        return tuple(np.ptp(points, axis=0).tolist())
    rows, columns = np.nonzero(region.array())
    return float(np.ptp(columns) + 1), float(np.ptp(rows) + 1)


def told(kind: str, center: tuple[int, int], size: tuple[float, float], shape: tuple[int, int]) -> Any:
    (x, y), (w, h) = center, size
    left, top = x - (w - 1) / 2, y - (h - 1) / 2
    if kind == "rectangle":
        return trax.Rectangle.create(left, top, w, h)
    if kind == "polygon":
        return trax.Polygon.create([(left, top + h / 2), (left + w / 2, top), (left + w, top + h / 2), (x, top + h)])
    mask = np.zeros(shape, np.uint8)
    mask[max(round(top), 0) : round(top + h), max(round(left), 0) : round(left + w)] = 1
    return trax.Mask.create(mask)


def main(kind: str, pictures: str) -> None:
    size = (0.0, 0.0)
    with trax.Server([kind], [pictures], tracker_name="brightest") as server:
        while True:
            request = server.wait()
            if request.type in ("quit", "error"):
                return
            image = shown(request.image["color"])
            if request.objects:
                size = around(request.objects[0][0])
            row, column = np.unravel_index(image.argmax(), image.shape)
            region = told(kind, (int(column), int(row)), size, image.shape)
            server.status([(region, {"confidence": int(image.sum())})])


if __name__ == "__main__":
    main(*sys.argv[1:])
