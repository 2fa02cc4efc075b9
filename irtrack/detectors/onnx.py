"""`onnx`: a person's own neural network from an ONNX file, run by onnxruntime (extra `onnx`)."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from irsim.config.base import Several
from irsim.types import Frame
from irtrack.detectors.base import DetectorPart, checked_picture
from irtrack.detectors.peaks import Picture, maxima, measured, vertices
from irtrack.errors import InputError, TrackerError, error_line
from irtrack.types import Detections
from irtrack.validity import fault_of_detections

Pixels = Annotated[int, Field(ge=1, le=16_384)]


class Onnx(DetectorPart):
    """Neural network on single images, from an ONNX file.

    Input: float32 (1, 1, rows, cols), counts / (2^bits - 1). Frames are not resized, which would change small targets.
    Output, the network's first: `heatmap` (1, 1, rows, cols), whose maxima above the threshold are detections, or
    `boxes` (n, 5) or (1, n, 5) of cx, cy, w, h in px and a score. Each process reads the file once. The network runs on
    one thread, since the order of sums on several may vary.
    """

    source: ClassVar[str] = "ONNX, https://onnx.ai"

    file: str = Field(min_length=1, max_length=4096)
    """Path of the ONNX file."""
    size: Annotated[Several[Pixels] | None, Field(min_length=2, max_length=2)] = None
    """Width and height of the network's input, px; by default those in the file."""
    output: Literal["heatmap", "boxes"] = "heatmap"
    """Kind of the first output."""
    threshold: float = Field(default=0.5, ge=-1e6, le=1e6)
    """Least score of a detection, in the network's own scale."""
    separation: int = Field(default=2, ge=1, le=100)
    """heatmap: half side of the square in which a detection is the only maximum, px."""
    most: int = Field(default=100, ge=1, le=100_000)
    """Largest number of detections in a frame; the highest scores stay."""

    def step(self, state: Any, frame: Frame) -> tuple[None, Detections]:
        session = self.session()
        picture = checked_picture(frame)
        wanted = self._input_size(session)
        size = picture.shape[1], picture.shape[0]
        if any(w is not None and w != s for w, s in zip(wanted, size, strict=True)):
            raise InputError(f"{self.file}: takes {_text(wanted)} px; the frame has {_text(size)}")
        values = (picture / np.float32(2**frame.bits - 1))[None, None]
        try:
            output = np.asarray(session.run(None, {session.get_inputs()[0].name: values})[0], dtype=np.float32)
        except Exception as error:  # onnxruntime's exceptions share no base
            raise TrackerError(f"{self.file}: {error_line(error)}") from None
        found = self._of_boxes(output) if self.output == "boxes" else self._of_heatmap(output, picture)
        fault = fault_of_detections(found)
        if fault:
            raise TrackerError(f"{self.file}: frame {frame.index}: {fault}")
        return None, found.take(np.argsort(-found.scores, kind="stable")[: self.most])

    @property
    def weights(self) -> tuple[str, ...]:
        """Files whose content decides the detections, for the key of a run."""
        return (self.file,)

    def session(self) -> Any:
        """Return onnxruntime's session of the file; InputError, one line, where it cannot be used."""
        path = Path(self.file)
        if not path.is_file():
            raise InputError(f"{self.file}: there is no such file; allowed: an ONNX file")
        session = _session(str(path.resolve()), path.stat().st_mtime_ns)
        inputs = session.get_inputs()
        shape = inputs[0].shape if inputs else []
        if len(inputs) != 1 or len(shape) != 4 or shape[1] != 1 or inputs[0].type != "tensor(float)":
            given = ", ".join(f"{each.type} {each.shape}" for each in inputs)
            raise InputError(f"{self.file}: its input is {given}; allowed: one tensor(float) (1, 1, rows, cols)")
        known = tuple(n if isinstance(n, int) else None for n in (shape[3], shape[2]))
        if self.size is not None and any(n is not None and n != s for n, s in zip(known, self.size, strict=True)):
            raise InputError(f"{self.file}: size {_text(self.size)}; allowed: {_text(known)}, the network's input")
        return session

    def _input_size(self, session: Any) -> tuple[int | None, ...]:
        rows, columns = session.get_inputs()[0].shape[2:]
        return self.size or tuple(n if isinstance(n, int) else None for n in (columns, rows))

    def _of_heatmap(self, output: Picture, picture: Picture) -> Detections:
        if output.ndim < 2 or output.shape[-2:] != picture.shape or output.size != picture.size:
            raise InputError(f"{self.file}: output of shape {output.shape}; allowed: (1, 1, rows, cols) of the input")
        heights = np.ascontiguousarray(output.reshape(picture.shape))
        if not np.isfinite(heights).all():
            raise TrackerError(f"{self.file}: the output is not finite")
        rows, columns = maxima(heights, self.separation, self.threshold, self.most)
        sizes, _ = measured(heights, rows, columns, 4) if len(rows) else (np.empty((0, 2)), None)
        return Detections(vertices(heights, rows, columns), sizes, heights[rows, columns].astype(np.float64))

    def _of_boxes(self, output: Picture) -> Detections:
        if output.ndim not in (2, 3) or output.shape[-1] != 5 or output.size != 5 * output.shape[-2]:
            raise InputError(f"{self.file}: output of shape {output.shape}; allowed: (n, 5) or (1, n, 5)")
        boxes = output.reshape(-1, 5).astype(np.float64)
        boxes = boxes[~(boxes[:, 4] < self.threshold)]  # NaN is an error, not a low score
        return Detections(boxes[:, :2], boxes[:, 2:4], boxes[:, 4])


@lru_cache(maxsize=8)
def _session(path: str, changed_ns: int) -> Any:
    """Return the session of a file, loaded once a process and anew where the file has changed."""
    try:
        import onnxruntime
    except ImportError:
        raise InputError("onnx: onnxruntime is not installed; allowed: after pip install 'irtrack[onnx]'") from None
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 4  # no messages on standard error: its exceptions hold them
    try:
        return onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])
    except Exception as error:  # onnxruntime's exceptions share no base
        raise InputError(f"{path}: is no ONNX file that onnxruntime reads: {error_line(error)}") from None


def _text(size: Any) -> str:
    return "x".join("any" if n is None else str(n) for n in size)
