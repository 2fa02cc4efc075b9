"""Names in a recording, and the viewer's layout attached to it: it opens with boxes and a fitting contrast."""

from __future__ import annotations

import json

import numpy as np

from irsim.types import Image

IMAGE, PREVIEW, CAMERA = "/ir/image", "/ir/preview", "/ir/camera_info"
TRUTH_BOXES, TRUTH = "/truth/annotations", "/truth/targets"
"""Topics."""

SCENARIO, LAYOUT = "scenario.yaml", "layout.json"
"""Attachments: the scenario as rendered, and the layout."""


def display_range(image: Image, bits: int) -> tuple[int, int]:
    """Counts to show as black and white: the middle 99 % of a frame and half as much again each side."""
    low, high = np.percentile(image, (0.5, 99.5))
    margin = max((high - low) / 2, 1.0)
    return max(int(low - margin), 0), min(int(high + margin), 2**bits - 1)


def viewer_layout(black: int, white: int, has_truth: bool) -> bytes:
    """JSON that Foxglove and Lichtblick import: counts beside the 8-bit preview, truth boxes on both."""
    annotations = {TRUTH_BOXES: {"visible": True}} if has_truth else {}
    counts = {"imageTopic": IMAGE, "annotations": annotations, "minValue": black, "maxValue": white}
    preview = {"imageTopic": PREVIEW, "annotations": annotations}
    layout = {
        "configById": {"Image!counts": {"imageMode": counts}, "Image!preview": {"imageMode": preview}},
        "globalVariables": {},
        "userNodes": {},
        "layout": {"first": "Image!counts", "second": "Image!preview", "direction": "row"},
    }
    return json.dumps(layout, indent=2).encode()
