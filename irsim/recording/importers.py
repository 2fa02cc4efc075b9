"""`irsim import`: a folder of pictures, a TIFF, an array, a video or a damaged recording becomes a recording."""

from __future__ import annotations

import os
import reprlib
import sys
from collections.abc import Callable, Iterator, Mapping
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from irsim import __version__
from irsim.camera.agc import Agc
from irsim.config.paths import begins_as_recording, check_input, path_of
from irsim.errors import InputError, counted, expect_text, is_number, whole_number
from irsim.recording import recover
from irsim.recording.chunks import Compression
from irsim.recording.header import Header
from irsim.recording.images import ALLOWED, Picture, Pictures, Video, open_pictures
from irsim.recording.labels import Labels, read_labels
from irsim.recording.output import check_output
from irsim.recording.writer import RecordingWriter, default_agc, writing
from irsim.types import Frame

ACCURACY_PX = 1.0
"""How far an imported centre may be off where the user does not say: boxes drawn by hand and partly
interpolated lay 0.65 to 1.3 px (median) off the bright blob in three sequences of the drone detection
dataset of Svanstrom, Alonso-Fernandez and Englund (Data in Brief, 2021)."""

RATES_HZ = (0.001, 10_000.0)
"""Frames a second that may be asked for, as of a camera."""
RATE_HZ = 30.0
"""Frames a second of pictures where the user does not say."""


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
    compression: Compression | None = None,
    progress: Callable[[int], None] | None = None,
) -> Path:
    """Write a folder of PNG or TIFF (8 or 16 bit, natural order of names), the pages of a TIFF, an array of frames x
    rows x columns that numpy saved (.npy, .npz) or a video as a recording.

    truth        CSV of boxes, see `labels.read_labels`; velocity, visibility and the like stay None
    rate_hz      default: the video's own, 30 for pictures
    agc          counts to the 8-bit picture; default: none for 8-bit pictures, linear for 16-bit ones
    bits         true depth of 16-bit pictures, default 16
    accuracy_px  how far the truth's centres may be off, default ACCURACY_PX
    follow       id of the target to follow, as the CSV or the recording calls it; default: its first
    compression  of the recording's chunks, default none
    progress     called with the number of frames done

    A recording that is damaged is taken too: what is whole in it is kept as it is (`recording.recover`),
    and none of the above but `progress` is for it. Colours are made grey. InputError, one line with its
    place, for anything wrong; nothing is left behind then.
    """
    source, out = path_of(source), path_of(out)
    check_output(out, source, None if truth is None else path_of(truth))
    check_input(source, ALLOWED)
    asked = {
        "truth": truth,
        "rate": rate_hz,
        "name": name,
        "agc": agc,
        "bits": bits,
        "accuracy": accuracy_px,
        "follow": follow,
        "compression": compression,
    }
    given = {key: value for key, value in asked.items() if value is not None}
    if begins_as_recording(source):
        _refuse_given(source, given)
        return recover(source, out, progress)
    _check_given(source, given)
    bits = None if bits is None else whole_number("bits", bits, 1)
    accuracy = ACCURACY_PX if accuracy_px is None else float(accuracy_px)

    pictures = open_pictures(source)
    labels = None if truth is None else read_labels(Path(truth), accuracy, follow)
    if labels is not None and pictures.count is not None:
        labels.check_end(pictures.count)
    rate, notes = _rate(source, pictures, rate_hz)
    reading = iter(pictures)
    first = next(reading)
    header = _header(name_of(source) if name is None else name, first, rate, labels, accuracy, agc, bits)
    with writing(out, header, compression="none" if compression is None else compression) as writer:
        done, coloured = _write(writer, header, labels, first, reading, progress)
        if labels is not None:
            labels.check_end(done)
        writer.finish((*notes, *_notes(pictures, header, labels, done, coloured)))
    return out


def name_of(source: Path) -> str:
    """What a folder or a video is called: the folder's name, or the file's without its ending; what is no letter in it
    becomes the sign for that."""
    real = source.resolve()
    return os.fsencode(real.name if real.is_dir() else real.stem).decode("utf-8", "replace")


def _check_given(source: Path, given: Mapping[str, Any]) -> None:
    """InputError where what was given, each by its name, is not of its type or range, or is nothing without a truth."""
    low, high = RATES_HZ
    if "rate" in given and not (is_number(given["rate"]) and low <= given["rate"] <= high):
        raise InputError(f"rate {reprlib.repr(given['rate'])}: allowed: a number from {low:g} to {high:g} Hz")
    if "accuracy" in given and not (is_number(given["accuracy"]) and 0 <= given["accuracy"] <= sys.float_info.max):
        raise InputError(f"accuracy {reprlib.repr(given['accuracy'])}: allowed: a number, 0 px or more")
    for key in ("name", "follow"):
        if key in given:
            expect_text(key, given[key])
    if "agc" in given and not isinstance(given["agc"], Agc):
        what = f"agc {reprlib.repr(given['agc'])}"
        raise InputError(f"{what}: is no AGC; allowed: one such as irsim.camera.AGCS.parse gives")
    if "truth" not in given and "accuracy" in given:
        raise InputError(f"{source}: an accuracy is that of the truth; allowed with truth only (truth=CSV)")
    if "truth" not in given and "follow" in given:
        raise InputError(f"{source}: whom to follow is told by the truth; allowed with truth only (truth=CSV)")


def _refuse_given(source: Path, given: Mapping[str, Any]) -> None:
    """InputError where something was given that a recording has of its own."""
    if given:
        raise InputError(f"{source}: is a recording and is kept as it is; allowed: no {', no '.join(given)}")


def _rate(source: Path, pictures: Pictures, asked: float | None) -> tuple[float, list[str]]:
    """The rate to use, and a note where nobody gave it."""
    if asked is not None:
        return float(asked), []
    if pictures.rate_hz is not None:
        return pictures.rate_hz, []
    if isinstance(pictures, Video):
        raise InputError(f"{source}: this video states no frame rate; give one (rate_hz=HZ)")
    return RATE_HZ, [f"no rate was given: {RATE_HZ:g} Hz assumed"]


def _header(
    name: str,
    first: Picture,
    rate_hz: float,
    labels: Labels | None,
    accuracy_px: float,
    agc: Agc | None,
    bits: int | None,
) -> Header:
    """What is known of pictures like the first; InputError where its counts are not as deep as `bits`."""
    stored = 8 * first.image.itemsize
    if bits is not None and bits > stored:
        raise InputError(f"{first.place}: {bits} bits do not fit; allowed: 1 to {stored}")
    return Header(
        version=__version__,
        name=name,
        input="imported",
        size=(first.image.shape[1], first.image.shape[0]),
        bits=bits or stored,
        rate_hz=rate_hz,
        follow=None if labels is None else labels.follow,
        has_truth=labels is not None,
        accuracy_px=0.0 if labels is None else accuracy_px,
        agc=agc or default_agc(stored),
    )


def _write(
    writer: RecordingWriter,
    header: Header,
    labels: Labels | None,
    first: Picture,
    others: Iterator[Picture],
    progress: Callable[[int], None] | None,
) -> tuple[int, int]:
    """(how many pictures were written, how many of them had colours)."""
    done, coloured = 0, 0
    for picture in chain([first], others):
        _add(writer, header, labels, picture, first, done)
        done, coloured = done + 1, coloured + picture.had_colours
        if progress is not None:
            progress(done)
    return done, coloured


def _add(
    writer: RecordingWriter, header: Header, labels: Labels | None, picture: Picture, first: Picture, index: int
) -> None:
    image = picture.image
    if image.shape != first.image.shape or image.dtype != first.image.dtype:
        raise InputError(
            f"{picture.place}: is {_described(picture)} but {first.place} is {_described(first)}; "
            "allowed: one size and type for all"
        )
    if header.bits < 8 * image.itemsize and (highest := int(np.max(image))) >= 2**header.bits:
        raise InputError(f"{picture.place}: has the count {highest}; allowed: {header.bits} bits")
    time = index / header.rate_hz
    writer.add(
        Frame(image, index, time, header.bits), None if labels is None else labels.truth(index, time, header.size)
    )


def _described(picture: Picture) -> str:
    rows, columns = picture.image.shape
    return f"{columns}x{rows}, {8 * picture.image.itemsize} bit"


def _notes(pictures: Pictures, header: Header, labels: Labels | None, done: int, coloured: int) -> Iterator[str]:
    """What was made of the pictures and the truth, where it may not be meant."""
    if labels is not None:
        yield from (*labels.notes, *labels.strays(header.size), *labels.gaps(done))
    if coloured:
        yield f"{coloured} of {counted(done, 'picture')} had colours: made grey by luma (ITU-R BT.601)"
    if isinstance(pictures, Video) and pictures.stated_count not in (None, done):
        yield f"the video states {counted(pictures.stated_count, 'frame')}; {done} could be decoded"
