"""Wrong arguments of measurements and pictures: one line with the allowed values."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import irsim
import irsim.calibration
from irsim.cli.figures import contact_sheet
from irsim.cli.video import write_video
from irsim.errors import InputError

SCENE = irsim.loads(
    "frames: 3\ncamera: {size: [32, 24]}\nbackground: {kind: ground}\n"
    "targets: [{id: jet, shape: {kind: point}, path: {kind: straight, start: [9, 9]}}]\n"
)
FRAMES = np.zeros((8, 32, 32), np.uint16)
NO_PATH = "is no path; allowed: text or a path"


def anything(value: object) -> Any:
    """Return a value as of any type."""
    return value


CALLS: dict[str, tuple[Callable[[], object], str]] = {
    "measure_realism": (
        lambda: irsim.measure_realism(anything("sky")),
        "a comparison of a str; allowed: a Source, such as irsim.open_source gives",
    ),
    "a class in a list": (
        lambda: irsim.measure_realism(irsim.Rendering(SCENE), anything(["cloud"])),
        r"like \['cloud'\]: no such class; allowed: cloud, ",
    ),
    "a camera of three frames": (
        lambda: irsim.measure_realism(irsim.Rendering(SCENE), camera="cooled"),
        "3 frames are too few to measure noise; allowed: at least 4",
    ),
    "a fit of no frames": (
        lambda: irsim.fit(SCENE, start=2, stop=2),
        "there are no frames 2:2; allowed: one or more of its 3",
    ),
    "contact_sheet": (lambda: contact_sheet(irsim.Rendering(SCENE), anything(None)), NO_PATH),
    "write_video": (lambda: write_video(irsim.Rendering(SCENE), anything(None)), NO_PATH),
    "no rate": (lambda: irsim.measure_noise(FRAMES, 0), "rate_hz 0: allowed: a number above 0, frames a second"),
    "frames in a list": (
        lambda: irsim.measure_noise(anything(FRAMES.tolist()), 30.0),
        "frames: a list; allowed: an",
    ),
    "numbers that fall": (
        lambda: irsim.calibration.temporal_noise(FRAMES, 30.0, np.arange(8)[::-1]),
        r"number: an array of int64 of shape \(8,\); allowed: None, or an array of whole numbers of shape \(8,\) that",
    ),
    "numbers of which none follows another": (
        lambda: irsim.calibration.temporal_noise(FRAMES, 30.0, 2 * np.arange(8)),
        "number: .* that rise, somewhere by 1",
    ),
    "masked frames": (
        lambda: irsim.measure_noise(anything(np.ma.masked_greater(np.ones((8, 32, 32)), 2)), 30.0),
        "frames: a masked array, whose mask would be lost; allowed: an array",
    ),
    "a highest count": (lambda: irsim.measure_noise(FRAMES, 30.0, top=0), "top 0: allowed: a number above 0"),
    "targets' places": (
        lambda: irsim.measure_noise(FRAMES, 30.0, taken=np.zeros((3, 3), np.bool_)),
        r"taken: .* of shape \(3, 3\); allowed: None, or an array of bool of shape \(32, 32\)",
    ),
    "a region of noise": (
        lambda: irsim.measure_noise(FRAMES, 30.0, anything("0,0,9,9")),
        "region '0,0,9,9': allowed",
    ),
    "a region beyond": (
        lambda: irsim.measure_noise(FRAMES, 30.0, (0, 0, 99, 9)),
        r"region \(0, 0, 99, 9\): does not",
    ),
}


@pytest.mark.parametrize("call", CALLS)
def test_a_wrong_argument_is_one_line(call: str) -> None:
    run, message = CALLS[call]
    with pytest.raises(InputError, match=message) as caught:
        run()
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize(
    ("frames", "message"),
    [
        (FRAMES.tolist(), "frames: a list; allowed: an array of whole numbers, float32 or float64, "),
        (FRAMES[0], r"frames: an array of uint16 of shape \(32, 32\); allowed: an array of whole numbers"),
        (FRAMES.astype(complex), "frames: an array of complex128 of .*; allowed: an array of whole numbers"),
        (FRAMES[:0], r"frames: an array of uint16 of shape \(0, 32, 32\); allowed: one or more frames of"),
        (np.where(FRAMES == 0, np.nan, 1.0), "frames: 8 of 8 hold values that are not finite, frame 0 first; allowed"),
    ],
)
@pytest.mark.parametrize(
    "measure",
    [
        irsim.calibration.noise_3d,
        irsim.calibration.find_bad_pixels,
        irsim.calibration.texture_figures,
        lambda frames: irsim.calibration.temporal_noise(frames, 30.0),
        lambda frames: irsim.calibration.flattest(frames, 255.0),
    ],
)
def test_every_measurement_checks_its_frames(measure: Callable[[Any], object], frames: object, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        measure(frames)
    assert len(str(caught.value).splitlines()) == 1
