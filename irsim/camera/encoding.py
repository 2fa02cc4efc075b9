"""Encoding of a camera's video: pictures as they are after H.264.

A frame is the same alone as in sequence: groups of pictures are closed, and each is encoded by a new encoder without
look-ahead and without B-frames, so that a picture depends on its group up to itself only.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import TYPE_CHECKING, Annotated

import numpy as np
import numpy.typing as npt
from pydantic import Field

from irsim.config.base import Part
from irsim.errors import InputError

if TYPE_CHECKING:
    from av import VideoFrame

Picture = npt.NDArray[np.uint8]
_NOMINAL_HZ = 30
"""Frame rate that the encoder is given: its rate control depends on bits per frame only."""
_GREY = 128


class H264(Part):
    """H.264 at a constant rate or quality, by x264 through PyAV (the extra `video`).

    Twenty clips of an uncooled core have 0.007 to 0.5 bits per pixel, median 0.03.
    """

    bits_per_pixel: Annotated[float, Field(ge=0.005, le=8)] = 0.1
    """Mean rate, or with `crf` the greatest: 0.1 is 246 kbit/s at 320x256 px and 30 Hz."""
    crf: Annotated[float, Field(ge=1, le=51)] | None = None
    """Constant quality of x264, higher is coarser; null keeps the rate constant."""
    group_frames: Annotated[int, Field(ge=1, le=600)] = 30
    """Frames from one key frame to the next."""


class EncodedSequence:
    """Decoded pictures of a sequence; a picture does not depend on the order of the calls."""

    def __init__(self, settings: H264) -> None:
        self._settings = settings
        self._next = 0
        """Frame that the open group takes next; the first of a group opens a new one."""
        self._group: _Group | None = None
        self._last: tuple[int, Picture] | None = None

    def frame(self, index: int, pictures: Callable[[int], Picture]) -> Picture:
        """Return picture `index` encoded and decoded; `pictures` returns a picture by its index.

        InputError where PyAV is not installed.
        """
        if self._last is not None and self._last[0] == index:
            return self._last[1]
        first = index - index % self._settings.group_frames
        if self._group is None or not first < self._next <= index:
            self._next = first
        for k in range(self._next, index + 1):
            picture = pictures(k)
            if k == first:
                self._group = _Group(self._settings, picture.shape)
            assert self._group is not None
            self._last = k, self._group.coded(picture)
            self._next = k + 1
        assert self._last is not None
        return self._last[1]


class _Group:
    """Encoder and decoder of one group of pictures."""

    def __init__(self, settings: H264, shape: tuple[int, ...]) -> None:
        try:
            import av
        except ImportError:
            raise InputError(
                "camera.agc.encoding needs PyAV: pip install 'irtrack[video]'; allowed without it: no encoding"
            ) from None
        self._even = [(0, side % 2) for side in shape]  # chroma needs even sides
        rows, columns = (side + side % 2 for side in shape)
        bits = settings.bits_per_pixel * rows * columns
        kbit_s = max(round(bits * _NOMINAL_HZ / 1000), 1)
        encoder = av.CodecContext.create("libx264", "w")
        encoder.width, encoder.height, encoder.pix_fmt = columns, rows, "yuv420p"
        encoder.time_base, encoder.framerate = Fraction(1, _NOMINAL_HZ), Fraction(_NOMINAL_HZ)
        encoder.thread_count = 1
        buffer = max(round(bits * min(settings.group_frames, _NOMINAL_HZ) / 1000), 1)
        aim = f"bitrate={kbit_s}" if settings.crf is None else f"crf={settings.crf:g}"
        encoder.options = {
            "preset": "veryfast",
            "tune": "zerolatency",
            "x264-params": f"{aim}:vbv-maxrate={kbit_s}:vbv-bufsize={buffer}:keyint=infinite:scenecut=0:"
            "bframes=0:rc-lookahead=0:threads=1:log-level=none",
        }
        decoder = av.CodecContext.create("h264", "r")
        decoder.thread_count = 1
        decoder.options = {"flags": "low_delay"}
        self._encoder, self._decoder, self._new = encoder, decoder, av.VideoFrame.from_ndarray
        self._chroma = np.full((rows // 2, columns), _GREY, np.uint8)
        self._count = 0
        self.bytes = 0
        """Bytes of the pictures so far."""

    def coded(self, picture: Picture) -> Picture:
        """Return the next picture, (rows, cols) uint8, as it is decoded."""
        frame = self._frame(np.pad(picture, self._even, mode="edge"))
        packets = self._encoder.encode(frame)
        self.bytes += sum(packet.size for packet in packets)
        decoded = [found for packet in packets for found in self._decoder.decode(packet)]
        if len(decoded) != 1:
            raise RuntimeError(f"x264 gave {len(decoded)} pictures for one")
        rows, columns = picture.shape
        return np.array(decoded[0].to_ndarray()[:rows, :columns], np.uint8)

    def _frame(self, even: Picture) -> VideoFrame:
        """Return a frame whose luma is the picture as it is, from 0 to 255."""
        frame = self._new(np.concatenate([even, self._chroma]), format="yuv420p")
        frame.pts, self._count = self._count, self._count + 1
        return frame
