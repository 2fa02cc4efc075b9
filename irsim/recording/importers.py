"""Import of pictures, arrays, videos, raw files, bags and damaged recordings to a recording."""

from __future__ import annotations

import os
import reprlib
import sys
from collections.abc import Callable, Iterator, Mapping
from itertools import chain
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from irsim import __version__
from irsim.camera.agc import Agc
from irsim.config.paths import begins_as_recording, check_input, path_of
from irsim.errors import InputError, counted, expect_text, is_number, one_line, whole_number
from irsim.recording import recover
from irsim.recording.formats.base import PictureSet
from irsim.recording.header import Header
from irsim.recording.image_topics import has_topics, open_topic
from irsim.recording.images import ALLOWED, Picture, Pictures, open_pictures
from irsim.recording.labels import Labels, read_labels
from irsim.recording.mcap_writer import Compression
from irsim.recording.output import check_output
from irsim.recording.raw_files import open_raw, parse_layout
from irsim.recording.writer import RecordingWriter, default_agc, writing
from irsim.types import Frame

DEFAULT_ACCURACY_PX = 1.0
"""Default error of imported centres, px. In three sequences of the drone detection dataset of Svanstrom,
Alonso-Fernandez and Englund (Data in Brief, 2021), boxes drawn by hand and partly interpolated were 0.65 to 1.3 px
(median) from the bright blob."""

RATES_HZ = (0.001, 10_000.0)
"""Least and greatest allowed frame rate, Hz, as for cameras."""
DEFAULT_RATE_HZ = 30.0
"""Default frame rate of pictures, Hz."""


def import_frames(
    source: str | Path,
    out: str | Path,
    truth: str | Path | None = None,
    rate_hz: float | None = None,
    name: str | None = None,
    agc: Agc | None = None,
    bits: int | None = None,
    accuracy_px: float | None = None,
    follow: str | None = None,
    truth_format: str | None = None,
    compression: Compression | None = None,
    progress: Callable[[int], None] | None = None,
    topic: str | None = None,
    layout: str | None = None,
) -> Path:
    """Write pictures as a recording and return its path.

    source       folder of PNG or TIFF (8 or 16 bit, in natural order of names), TIFF of several pages, numpy array of
                 frames x rows x columns (.npy, .npz), video, raw file with a layout, ROS 2 bag, MCAP file of
                 another program, or damaged recording
    truth        labels in a format of `formats.READERS`, see `labels.read_labels`; other truth, such as velocity, is
                 None
    rate_hz      frame rate, Hz; default: the video's own, the times of messages, 30 for pictures
    agc          AGC of the 8-bit display; default: none for 8-bit pictures, linear for 16-bit ones
    bits         bit depth of counts in 16-bit pictures; default: 16
    accuracy_px  error of the truth's centres, px; default: DEFAULT_ACCURACY_PX
    follow       id of the target to track, in the labels or in the recording; default: the first
    truth_format  format of the labels; default: the one recognised from the labels
    compression  compression of the recording's chunks; default: none
    progress     called with the number of frames done
    topic        topic of the images in a bag or an MCAP file; default: the only one
    layout       layout of a raw file, see `raw_files.parse_layout`

    Colours are converted to grey. Intact frames of a damaged recording are copied (`recording.recover`), with no option
    but `progress`. Wrong input raises InputError, one line with its position; no file is written then.
    """
    source, out = path_of(source), path_of(out)
    check_output(out, source, None if truth is None else path_of(truth))
    check_input(source, ALLOWED)
    options = {
        "truth": truth,
        "rate": rate_hz,
        "name": name,
        "agc": agc,
        "bits": bits,
        "accuracy": accuracy_px,
        "follow": follow,
        "truth_format": truth_format,
        "compression": compression,
        "topic": topic,
        "layout": layout,
    }
    given = {key: value for key, value in options.items() if value is not None}
    of_topic = has_topics(source)
    if begins_as_recording(source) and not of_topic:
        if given:
            raise InputError(f"{source}: is a recording and is kept as it is; allowed: no {', no '.join(given)}")
        return recover(source, out, progress)
    _check_given(source, given)
    bits = None if bits is None else whole_number("bits", bits, 1)
    accuracy = DEFAULT_ACCURACY_PX if accuracy_px is None else float(accuracy_px)

    pictures = _opened(source, topic, layout, of_topic)
    reading = pictures.read()
    first = next(reading)
    found = PictureSet(first.image.shape[::-1], pictures.count, pictures.files)
    labels = None if truth is None else read_labels(Path(truth), accuracy, follow, found, truth_format)
    if labels is not None and pictures.count is not None:
        labels.check_end(pictures.count)
    rate, notes = _rate(source, pictures, rate_hz)
    stored = 8 * first.image.itemsize
    if bits is not None and bits > stored:
        raise InputError(f"{first.place}: {bits} bits do not fit; allowed: 1 to {stored}")
    header = Header(
        version=__version__,
        name=name_of(source) if name is None else name,
        input="imported",
        size=first.image.shape[::-1],
        bits=bits or stored,
        rate_hz=rate,
        follow=None if labels is None else labels.follow,
        has_truth=labels is not None,
        accuracy_px=0.0 if labels is None else accuracy,
        agc=agc or default_agc(stored),
    )
    with writing(out, header, compression="none" if compression is None else compression) as writer:
        done, with_colours = _write_pictures(writer, header, labels, first, reading, progress, rate_hz is not None)
        if labels is not None:
            labels.check_end(done)
        writer.finish((*notes, *_notes(pictures, header, labels, done, with_colours)))
    return out


def _opened(source: Path, topic: str | None, layout: str | None, of_topic: bool) -> Pictures:
    """Return the pictures of a source. InputError for a topic or a layout of a source that has none."""
    if topic is not None and (layout is not None or not of_topic):
        raise InputError(f"{source}: topic {one_line(topic)}: allowed for a ROS 2 bag or an MCAP file only")
    if layout is not None:
        return open_raw(source, parse_layout(layout))
    return open_topic(source, topic) if of_topic else open_pictures(source)


def name_of(source: Path) -> str:
    """Return the name of a folder, or of a file without its ending; U+FFFD for bytes that are not UTF-8."""
    real = source.resolve()
    return os.fsencode(real.name if real.is_dir() else real.stem).decode("utf-8", "replace")


def _check_given(source: Path, given: Mapping[str, Any]) -> None:
    """Raise InputError for an option of a wrong type or value, and for an option of the truth without a truth."""
    low, high = RATES_HZ
    if "rate" in given and not (is_number(given["rate"]) and low <= given["rate"] <= high):
        raise InputError(f"rate {reprlib.repr(given['rate'])}: allowed: a number from {low:g} to {high:g} Hz")
    if "accuracy" in given and not (is_number(given["accuracy"]) and 0 <= given["accuracy"] <= sys.float_info.max):
        raise InputError(f"accuracy {reprlib.repr(given['accuracy'])}: allowed: a number, 0 px or more")
    for key in ("name", "follow", "topic", "layout"):
        if key in given:
            expect_text(key, given[key])
    if "agc" in given and not isinstance(given["agc"], Agc):
        agc = reprlib.repr(given["agc"])
        raise InputError(f"agc {agc}: is not an AGC; allowed: a value of irsim.camera.AGCS.parse")
    if "truth" not in given and "accuracy" in given:
        raise InputError(f"{source}: accuracy describes ground truth; allowed only with truth=LABELS")
    if "truth" not in given and "truth_format" in given:
        raise InputError(f"{source}: truth_format describes ground truth; allowed only with truth=LABELS")
    if "truth" not in given and "follow" in given:
        raise InputError(f"{source}: follow names a target of the ground truth; allowed only with truth=LABELS")


def _rate(source: Path, pictures: Pictures, given: float | None) -> tuple[float, list[str]]:
    """Return the frame rate, Hz, and notes about assumptions on it."""
    if given is not None:
        return float(given), []
    if pictures.rate_hz is not None:
        return pictures.rate_hz, [*pictures.notes]
    if pictures.is_video:
        raise InputError(f"{source}: states no frame rate; give one (rate_hz=HZ)")
    return DEFAULT_RATE_HZ, [f"no rate was given: {DEFAULT_RATE_HZ:g} Hz assumed"]


def _write_pictures(
    writer: RecordingWriter,
    header: Header,
    labels: Labels | None,
    first: Picture,
    others: Iterator[Picture],
    progress: Callable[[int], None] | None,
    constant_rate: bool,
) -> tuple[int, int]:
    """Write all pictures; return their number and the number of those with colours.

    constant_rate  True: times are those of the frame rate, also where pictures have times
    """
    done, with_colours = 0, 0
    last = -inf
    for picture in chain([first], others):
        _check_picture(picture, first, header.bits)
        time = done / header.rate_hz if constant_rate or picture.time is None else picture.time
        if time <= last:
            raise InputError(f"{picture.place}: is not later than the one before; allowed: a frame rate (rate_hz=HZ)")
        last = time
        truth = None if labels is None else labels.truth(done, time, header.size)
        writer.add(Frame(picture.image, done, time, header.bits), truth)
        done, with_colours = done + 1, with_colours + picture.had_colours
        if progress is not None:
            progress(done)
    return done, with_colours


def _check_picture(picture: Picture, first: Picture, bits: int) -> None:
    """Raise InputError for a picture whose size or type differs from the first, or with a count above `bits` bits."""
    image = picture.image
    if image.shape != first.image.shape or image.dtype != first.image.dtype:
        raise InputError(
            f"{picture.place}: is {_described(picture)} but {first.place} is {_described(first)}; "
            "allowed: one size and type for all"
        )
    if bits < 8 * image.itemsize and (highest := int(np.max(image))) >= 2**bits:
        raise InputError(f"{picture.place}: has the count {highest}; allowed: {bits} bits")


def _described(picture: Picture) -> str:
    rows, columns = picture.image.shape
    return f"{columns}x{rows}, {8 * picture.image.itemsize} bit"


def _notes(pictures: Pictures, header: Header, labels: Labels | None, done: int, with_colours: int) -> Iterator[str]:
    """Yield notes about the assumptions made on the pictures and the truth."""
    if labels is not None:
        yield from (*labels.notes, *labels.outside_note(header.size), *labels.gap_note(done))
    if with_colours:
        yield f"{with_colours} of {counted(done, 'picture')} had colours: made grey by luma (ITU-R BT.601)"
    if pictures.stated not in (None, done):
        yield f"the video states {counted(pictures.stated, 'frame')}; {done} could be decoded"
