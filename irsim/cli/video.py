"""Moving pictures of a source: WebM for browsers and slides, GIF for wherever nothing else plays."""

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
"""A picture of colours of PALETTE, (rows, cols)."""

WHITE, BLACK, AMBER = 253, 254, 255
PALETTE: npt.NDArray[np.uint8] = np.repeat(np.linspace(0, 255, 256)[:, np.newaxis], 3, axis=1).astype(np.uint8)
"""(256, 3) red, green, blue: greys from 0 to WHITE, and two colours to draw with."""
PALETTE[: WHITE + 1] = np.rint(np.linspace(0, 255, WHITE + 1))[:, np.newaxis]
PALETTE[BLACK] = 0
PALETTE[AMBER] = (255, 176, 0)  # legible on black, grey and white; told apart by the colour-blind too

LEAST_COLUMNS = {".webm": 640, ".gif": 320}
"""Smaller pictures are enlarged by a whole number until they are so wide; a GIF of noise is large as it is."""

MARGIN_PX = 3.0
"""Boxes are drawn larger by this on each side, or they would hide what they show."""

VP9 = {"crf": "20", "b": "0", "deadline": "realtime", "cpu-used": "6", "row-mt": "1"}
"""Constant quality, noise kept for the most part, at some 40 frames of 640 x 480 a second (libvpx-vp9)."""

GIF_LEAST_CS = 2
"""Shortest time of a GIF's frame, hundredths of a second: browsers slow down what is shorter."""


def moving_picture(
    source: Source,
    path: str | Path,
    start: int = 0,
    stop: int | None = None,
    progress: Callable[[int], None] | None = None,
) -> Path:
    """Write frames start .. stop-1 of a source as they are displayed, with their truth boxes, and return the path.

    The ending says what: .webm (VP9) or .gif. Every frame is shown for one period of the source's rate, also
    around frames that were dropped. `progress` is called with the number of frames done. InputError where the
    ending is another, the file cannot be written or is one that the source is read from, or PyAV is missing, which
    WebM takes.
    """
    path = path_of(path)
    ending = path.suffix.lower()
    if ending not in LEAST_COLUMNS:
        raise InputError(f"{path}: unknown kind of moving picture; allowed: {', '.join(LEAST_COLUMNS)}")
    check_output(path, *source.needs)
    stop = len(source) if stop is None else stop
    if not 0 <= start < stop <= len(source):
        raise InputError(f"{source.name}: there are no frames {start}:{stop}; allowed: within 0:{len(source)}")
    factor = -(-LEAST_COLUMNS[ending] // source.size[0])
    pictures = _pictures(source, start, stop, factor, progress)
    with atomic_file(path) as file:
        if ending == ".webm":
            _write_webm(file, pictures, source.rate_hz)
        else:
            _write_gif(file, pictures, stop - start, source.rate_hz)
    return path


def drawn(frame: Frame, truth: Truth | None, factor: int = 1) -> Palette:
    """A frame of 8 bits, enlarged by a whole number, its targets' boxes and its number and time drawn over it.

    A target of which more than half is hidden has only the corners of its box.
    """
    greys = np.rint(frame.image * (WHITE / 255)).astype(np.uint8)
    picture: Palette = np.repeat(np.repeat(greys, factor, axis=0), factor, axis=1)
    for target in truth.targets if truth is not None else ():
        left, top = _draw_box(picture, target.box, target.hidden, factor)
        _write(picture, target.id, (left, top - 4), factor)
    _write(picture, f"frame {frame.index}, {frame.time:.2f} s", (4, picture.shape[0] - 5), factor)
    return picture


def _pictures(
    source: Source, start: int, stop: int, factor: int, progress: Callable[[int], None] | None
) -> Iterator[Palette]:
    for done, (frame, truth) in enumerate(source.pairs(start, stop, input="display"), start=1):
        yield drawn(frame, truth, factor)
        if progress is not None:
            progress(done)


def _draw_box(picture: Palette, box: Box, hidden: bool, factor: int) -> tuple[int, int]:
    """Draw a box; its top left corner in the picture's pixels."""
    edges = (box.left - MARGIN_PX, box.top - MARGIN_PX, box.right + MARGIN_PX, box.bottom + MARGIN_PX)
    far = 2 * max(picture.shape)  # OpenCV's integers end; what lies beyond is not seen anyway
    left, top, right, bottom = (round(min(max((edge + 0.5) * factor, -far), far)) for edge in edges)
    if not hidden:
        cv2.rectangle(picture, (left, top), (right, bottom), AMBER, factor)
        return left, top
    arm = max((right - left) // 4, 1), max((bottom - top) // 4, 1)
    for x, inwards in ((left, 1), (right, -1)):
        for y, down in ((top, 1), (bottom, -1)):
            cv2.line(picture, (x, y), (x + inwards * arm[0], y), AMBER, factor)
            cv2.line(picture, (x, y), (x, y + down * arm[1]), AMBER, factor)
    return left, top


def _write(picture: Palette, text: str, at: tuple[int, int], factor: int) -> None:
    """Write a text with its left end at (x, y), rimmed so that it stands out from any grey."""
    letters = np.zeros_like(picture)
    cv2.putText(letters, text, at, cv2.FONT_HERSHEY_PLAIN, 0.8 + 0.2 * min(factor, 2), 255, 1)
    # A letter's soft edge would be other colours of the palette.
    solid = (letters > 100).astype(np.uint8)
    picture[cv2.dilate(solid, np.ones((3, 3), np.uint8)) > 0] = BLACK
    picture[solid > 0] = AMBER


def _write_webm(file: BinaryIO, pictures: Iterator[Palette], rate_hz: float) -> None:
    try:
        import av
    except ImportError:
        raise InputError("WebM takes PyAV: pip install 'irtrack[video]'; allowed without: .gif") from None
    first = next(pictures)
    with av.open(file, "w", format="webm") as container:
        stream = container.add_stream("libvpx-vp9", rate=Fraction(rate_hz).limit_denominator(10_000), options=VP9)
        stream.height, stream.width = (-(-side // 2) * 2 for side in first.shape)  # chroma takes even sides
        stream.pix_fmt = "yuv420p"
        for picture in chain([first], pictures):
            even = np.pad(picture, [(0, side % 2) for side in picture.shape], mode="edge")
            frame = av.VideoFrame.from_ndarray(PALETTE[even], format="rgb24")
            # Greys as 16 to 235: browsers take those for black and white, whatever the file says.
            container.mux(stream.encode(frame.reformat(format="yuv420p", dst_color_range="MPEG")))
        container.mux(stream.encode())


def _write_gif(file: BinaryIO, pictures: Iterator[Palette], count: int, rate_hz: float) -> None:
    from PIL import Image

    def images() -> Iterator[Image.Image]:
        for picture in pictures:
            image = Image.fromarray(picture)
            image.putpalette(PALETTE.tobytes())
            yield image

    begins = (round(100 * index / rate_hz) for index in range(count + 1))
    lasts_ms = [10 * max(end - begin, GIF_LEAST_CS) for begin, end in pairwise(begins)]
    all_images = images()
    next(all_images).save(file, "GIF", save_all=True, append_images=all_images, duration=lasts_ms, loop=0)
