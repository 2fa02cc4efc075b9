"""Adapter of a user's detectors: a function of an image, or a class with ``detect(image)``."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, ClassVar

import numpy as np

from irsim.types import Box, Frame
from irtrack.errors import TrackerError
from irtrack.types import Detection, Detections, plain_view
from irtrack.validity import fault_of_detections

ALLOWED = (
    "Detections, an array (n, 4) of cx, cy, w, h in px or (n, 5) with a score, "
    "or a list of boxes, (box, score) or Detection"
)
"""Allowed answers of a plain detector; a box is a `Box` or cx, cy, w, h; the default score is 1."""


@dataclass(frozen=True, eq=False)
class PlainDetector:
    """User's function or class as an `irtrack.types.Detector`; every run has an object of its own.

    kind        the function, or the class;  name  in messages;  parameters  keyword arguments
    again       returns the function, or a new object with `detect`

    The function or method is called with a writable copy of the image (rows, cols), or with the `Frame` (image, index,
    time, bits) where its first argument is annotated so or its attribute `needs` is
    ("pose",). It returns one of the answers in `ALLOWED`.
    """

    kind: Any
    name: str
    parameters: Mapping[str, Any]
    again: Callable[[], Any] = field(repr=False)
    resumable: ClassVar[bool] = False
    task: ClassVar[str] = "detect"

    @classmethod
    def of(cls, given: Any, parameters: Mapping[str, Any] | None = None) -> PlainDetector:
        """Return the adapter of a function, of a class and its arguments, or of an object, copied for each run."""
        values = dict(parameters or {})
        if isinstance(given, type):
            return cls(given, _name(given), values, partial(given, **values))
        if hasattr(given, "detect"):
            return cls(type(given), _name(type(given)), values, partial(copy.deepcopy, given))
        function = partial(given, **values) if values else given
        return cls(given, _name(given), values, partial(_returned, function))

    def step(self, state: Any, frame: Frame) -> tuple[Any, Detections]:
        """Return the object of this run, and its answer as detections; TrackerError, one line, for an invalid
        answer."""
        detector = self.again() if state is None else state
        call = getattr(detector, "detect", detector)
        answer = call(plain_view(call, frame))
        try:
            return detector, read_detections(answer, frame.image.shape)
        except (TypeError, ValueError) as error:
            raise TrackerError(f"{self.name}: frame {frame.index}: {error}") from None

    def detect(self, frame: Frame | np.ndarray) -> Detections:
        """Return the detections of a single frame, or of an image (rows, cols)."""
        if isinstance(frame, np.ndarray):
            frame = Frame(frame, 0, 0.0, 8 * frame.itemsize)
        return self.step(None, frame)[1]


def _returned(function: Any) -> Any:
    return function


def is_plain(given: object) -> bool:
    """Return whether an object or class is a plain detector: `detect` without `step`, or a function."""
    if hasattr(given, "step"):
        return False
    return hasattr(given, "detect") or (callable(given) and not isinstance(given, type))


def read_detections(answer: object, shape: tuple[int, ...]) -> Detections:
    """Return the detections of an answer to an image of a shape; ValueError or TypeError, one line, for any other."""
    if isinstance(answer, np.ndarray):
        found = _of_array(answer, shape)
    elif isinstance(answer, list | tuple):
        found = Detections.of(_of_item(item, k) for k, item in enumerate(answer))
    elif isinstance(answer, Detections):
        found = answer
    else:
        raise TypeError(f"detect gave {type(answer).__name__}; allowed: {ALLOWED}")
    error = fault_of_detections(found)
    if error:
        raise ValueError(error)
    return found


def _of_array(values: np.ndarray, shape: tuple[int, ...]) -> Detections:
    if values.size == 0:
        values = np.empty((0, 4))
    if values.shape[:2] == shape[:2] and values.shape not in ((shape[0], 4), (shape[0], 5)):
        raise ValueError(f"detect gave an image, {values.dtype} of shape {values.shape}; allowed: {ALLOWED}")
    if values.ndim != 2 or values.shape[1] not in (4, 5) or values.dtype.kind not in "fiu":
        raise ValueError(f"detect gave an array of {values.dtype}, shape {values.shape}; allowed: {ALLOWED}")
    numbers = values.astype(np.float64)
    return Detections(
        numbers[:, :2], numbers[:, 2:4], numbers[:, 4] if numbers.shape[1] == 5 else np.ones(len(numbers))
    )


def _of_item(item: Any, index: int) -> Detection:
    """Return the detection of an item: a Detection, a box, (box, score), or four or five numbers."""
    if isinstance(item, Detection):
        return item
    try:
        if isinstance(item, Box):
            return Detection(item, 1.0)
        if isinstance(item, Sequence | np.ndarray) and not isinstance(item, str | bytes):
            if len(item) == 2:
                box, score = item
                return Detection(box if isinstance(box, Box) else _box(box), float(score))
            return Detection(_box(item[:4]), float(item[4]) if len(item) == 5 else 1.0)
    except (TypeError, ValueError):
        pass
    raise ValueError(f"detection {index} is {' '.join(repr(item).split())[:80]}; allowed: {ALLOWED}")


def _box(numbers: Any) -> Box:
    cx, cy, w, h = map(float, numbers)
    return Box(cx, cy, w, h)


def _name(given: Any) -> str:
    return f"{getattr(given, '__module__', '?')}:{getattr(given, '__qualname__', type(given).__qualname__)}"
