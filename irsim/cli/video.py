"""Videos of a source with its truth boxes, as WebM (VP9) or GIF."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from itertools import chain, pairwise
from pathlib import Path
from typing import BinaryIO

import cv2
import numpy as np
import numpy.typing as npt

from irsim.config.paths import path_of
from irsim.errors import InputError
from irsim.recording.output import atomic_file, check_output
from irsim.types import Box, Frame, Source, Truth

Palette = npt.NDArray[np.uint8]
"""Picture of indices into PALETTE, (rows, cols)."""

WHITE, BLACK, AMBER = 253, 254, 255
PALETTE: npt.NDArray[np.uint8] = np.repeat(np.linspace(0, 255, 256)[:, np.newaxis], 3, axis=1).astype(np.uint8)
"""Red, green and blue of each index, (256, 3): greys from 0 to WHITE, and two colours for boxes and text."""
PALETTE[: WHITE + 1] = np.rint(np.linspace(0, 255, WHITE + 1))[:, np.newaxis]
PALETTE[BLACK] = 0
PALETTE[AMBER] = (255, 176, 0)  # legible on black, grey and white, also for the colour-blind

MIN_COLUMNS = {".webm": 640, ".gif": 320}
"""Least width of a video, px. Smaller frames are enlarged by a whole number. The least width of a GIF is smaller, as
noise makes its file large."""

MARGIN_PX = 3.0
"""Distance of a drawn box from the target's box on each side, px, so that its outline does not cover the target."""

VP9 = {"crf": "20", "b": "0", "deadline": "realtime", "cpu-used": "6", "row-mt": "1"}
"""Options of libvpx-vp9: constant quality that keeps most of the noise. A frame of 640 x 480 takes 25 ms."""

GIF_MIN_CS = 2
"""Shortest duration of a GIF frame, hundredths of a second. Browsers slow down shorter ones."""


def write_video(
    source: Source,
    path: str | Path,
    start: int = 0,
    stop: int | None = None,
    progress: Callable[[int], None] | None = None,
) -> Path:
    """Write frames start .. stop-1 of a source's 8-bit display with their truth boxes and return the path.

    The file's ending is .webm (VP9) or .gif. Every frame is shown for one frame period of the source, so that dropped
    frames leave no gap. `progress` is called with the number of frames done. Raises InputError for another ending,
    where the file cannot be written or is read by the source, or where PyAV, which WebM needs, is not installed.
    """
    path = path_of(path)
    ending = path.suffix.lower()
    if ending not in MIN_COLUMNS:
        raise InputError(f"{path}: unknown kind of video; allowed: {', '.join(MIN_COLUMNS)}")
    check_output(path, *source.needs)
    stop = len(source) if stop is None else stop
    if not 0 <= start < stop <= len(source):
        raise InputError(f"{source.name}: there are no frames {start}:{stop}; allowed: within 0:{len(source)}")
    factor = -(-MIN_COLUMNS[ending] // source.size[0])
    pictures = _pictures(source, start, stop, factor, progress)
    with atomic_file(path) as file:
        if ending == ".webm":
            _write_webm(file, pictures, source.rate_hz)
        else:
            _write_gif(file, pictures, stop - start, source.rate_hz)
    return path


def annotated(frame: Frame, truth: Truth | None, factor: int = 1) -> Palette:
    """Return an 8-bit frame enlarged by a whole number `factor`, with boxes of its targets, its number and its time.

    Of a target that is more than half hidden only the corners of the box are drawn.
    """
    greys = np.rint(frame.image * (WHITE / 255)).astype(np.uint8)
    picture: Palette = np.repeat(np.repeat(greys, factor, axis=0), factor, axis=1)
    for target in truth.targets if truth is not None else ():
        left, top = _draw_box(picture, target.box, target.hidden, factor)
        _put_text(picture, target.id, (left, top - 4), factor)
    _put_text(picture, f"frame {frame.index}, {frame.time:.2f} s", (4, picture.shape[0] - 5), factor)
    return picture


def _pictures(
    source: Source, start: int, stop: int, factor: int, progress: Callable[[int], None] | None
) -> Iterator[Palette]:
    for done, (frame, truth) in enumerate(source.pairs(start, stop, input="display"), start=1):
        yield annotated(frame, truth, factor)
        if progress is not None:
            progress(done)


def _draw_box(picture: Palette, box: Box, hidden: bool, factor: int) -> tuple[int, int]:
    """Draw a box and return its top left corner in pixels of the enlarged picture."""
    edges = (box.left - MARGIN_PX, box.top - MARGIN_PX, box.right + MARGIN_PX, box.bottom + MARGIN_PX)
    limit = 2 * max(picture.shape)  # OpenCV takes 32-bit integers; nothing beyond is visible
    left, top, right, bottom = (round(min(max((edge + 0.5) * factor, -limit), limit)) for edge in edges)
    if not hidden:
        cv2.rectangle(picture, (left, top), (right, bottom), AMBER, factor)
        return left, top
    arm = max((right - left) // 4, 1), max((bottom - top) // 4, 1)
    for x, inward in ((left, 1), (right, -1)):
        for y, down in ((top, 1), (bottom, -1)):
            cv2.line(picture, (x, y), (x + inward * arm[0], y), AMBER, factor)
            cv2.line(picture, (x, y), (x, y + down * arm[1]), AMBER, factor)
    return left, top


def _put_text(picture: Palette, text: str, at: tuple[int, int], factor: int) -> None:
    """Draw text in amber with a black outline, legible on any grey, from `at` (x, y) on."""
    letters = np.zeros_like(picture)
    cv2.putText(letters, text, at, cv2.FONT_HERSHEY_PLAIN, 0.8 + 0.2 * min(factor, 2), 255, 1)
    # Antialiased edges would take other colours of the palette.
    solid = (letters > 100).astype(np.uint8)
    picture[cv2.dilate(solid, np.ones((3, 3), np.uint8)) > 0] = BLACK
    picture[solid > 0] = AMBER


def _write_webm(file: BinaryIO, pictures: Iterator[Palette], rate_hz: float) -> None:
    try:
        import av
    except ImportError:
        raise InputError("WebM needs PyAV: pip install 'irtrack[video]'; allowed without it: .gif") from None
    first = next(pictures)
    with av.open(file, "w", format="webm") as container:
        stream = container.add_stream("libvpx-vp9", rate=Fraction(rate_hz).limit_denominator(10_000), options=VP9)
        stream.height, stream.width = (-(-side // 2) * 2 for side in first.shape)  # chroma needs even sides
        stream.pix_fmt = "yuv420p"
        for picture in chain([first], pictures):
            even = np.pad(picture, [(0, side % 2) for side in picture.shape], mode="edge")
            frame = av.VideoFrame.from_ndarray(PALETTE[even], format="rgb24")
            # Greys from 16 to 235: browsers show these as black and white, whatever range the file states.
            container.mux(stream.encode(frame.reformat(format="yuv420p", dst_color_range="MPEG")))
        container.mux(stream.encode())


def _write_gif(file: BinaryIO, pictures: Iterator[Palette], count: int, rate_hz: float) -> None:
    from PIL import Image

    def images() -> Iterator[Image.Image]:
        for picture in pictures:
            image = Image.fromarray(picture)
            image.putpalette(PALETTE.tobytes())
            yield image

    starts = (round(100 * index / rate_hz) for index in range(count + 1))
    durations_ms = [10 * max(end - begin, GIF_MIN_CS) for begin, end in pairwise(starts)]
    all_images = images()
    next(all_images).save(file, "GIF", save_all=True, append_images=all_images, duration=durations_ms, loop=0)
