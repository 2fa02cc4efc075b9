"""Frames of point targets in white noise, and small ONNX files, for the tests of detectors."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from irsim.types import Floats, Frame
from irtrack.types import Detections

NOISE, LEVEL = 20.0, 5000.0
"""Counts."""
PLACES = ((20.3, 30.7), (60.0, 21.4), (44.6, 58.2))
"""(x, y) px of three targets, in frames of 96x80."""


def noise_frame(
    seed: int, scr: float = 0.0, places: tuple[tuple[float, float], ...] = PLACES, shape: tuple[int, int] = (80, 96)
) -> Frame:
    """A frame of 14 bits: targets of standard deviation 1 px, their peak `scr` times the noise."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[: shape[0], : shape[1]]
    light = sum((np.exp(-((x - cx) ** 2 + (y - cy) ** 2) / 2) for cx, cy in places), np.zeros(shape))
    image = LEVEL + NOISE * (scr * light + rng.standard_normal(shape))
    return Frame(np.rint(image).astype(np.uint16), 0, 0.0, 14)


def last(detector: Any, *frames: Frame) -> Detections:
    """Detections in the last of some frames."""
    state, found = None, Detections.of([])
    for frame in frames:
        state, found = detector.step(state, frame)
    return found


def offsets(found: Detections, places: Any) -> Floats:
    """(n, 2) px from each place to the nearest detection; far away where there is none."""
    if len(found) == 0:
        return np.full((len(places), 2), 1e3)
    apart = found.centers[None] - np.asarray(places)[:, None]
    nearest: Floats = apart[np.arange(len(apart)), (apart**2).sum(axis=-1).argmin(axis=1)]
    return nearest


def write_onnx(path: Path, kernel: Floats, size: tuple[int, int] | None = None) -> str:
    """A network of one convolution with a kernel (k, k), edges repeated; its input is of any size, or (w, h)."""
    import onnx
    from onnx import TensorProto, helper

    rows, columns = ("rows", "columns") if size is None else (size[1], size[0])
    side, pad = len(kernel), len(kernel) // 2
    weights = helper.make_tensor("k", TensorProto.FLOAT, [1, 1, side, side], kernel.astype(np.float32).ravel().tolist())
    rim = helper.make_tensor("p", TensorProto.INT64, [8], [0, 0, pad, pad] * 2)
    nodes = [
        helper.make_node("Pad", ["x", "p"], ["wide"], mode="edge"),
        helper.make_node("Conv", ["wide", "k"], ["y"]),
    ]
    ends = [helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, 1, rows, columns]) for name in "xy"]
    graph = helper.make_graph(nodes, "one", ends[:1], ends[1:], [weights, rim])
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)], ir_version=8)
    onnx.save(model, str(path))
    return str(path)


def write_onnx_boxes(path: Path, boxes: Floats) -> str:
    """A network that gives the same boxes (n, 5) for any image."""
    import onnx
    from onnx import TensorProto, helper

    given = helper.make_tensor("b", TensorProto.FLOAT, boxes.shape, boxes.astype(np.float32).ravel().tolist())
    node = helper.make_node("Identity", ["b"], ["y"])
    x = helper.make_tensor_value_info("x", TensorProto.FLOAT, [1, 1, "rows", "columns"])
    y = helper.make_tensor_value_info("y", TensorProto.FLOAT, list(boxes.shape))
    graph = helper.make_graph([node], "boxes", [x], [y], [given])
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)], ir_version=8)
    onnx.save(model, str(path))
    return str(path)
