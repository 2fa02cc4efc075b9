"""Wrong arguments of public functions of irsim: one line that says what is allowed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import irsim
import irsim.calibration
from irsim.errors import InputError
from irsim.recording import TrackHeader, recover, write_tracks

SCENE = irsim.loads(
    "frames: 3\ncamera: {size: [32, 24]}\nbackground: {kind: ground}\n"
    "targets: [{id: jet, shape: {kind: point}, path: {kind: straight, start: [9, 9]}}]\n"
)
SPACE = irsim.variations(
    irsim.loads(
        "background: {kind: ground}\n"
        "vary: {camera.bits: {kind: choice, values: [14, 8]}, frames: {kind: integers, low: 1, high: 9}}\n"
    )
)
TRACK = TrackHeader(tracker="kalman", source="sky", source_hash="abc", rate_hz=30.0)
A_SCENARIO = r"of a str; allowed: a Scenario \(irsim\.load\('sky'\)\)"
NO_REGION = r"region: .* is no region; allowed: whole numbers \(column, row, columns, rows\)"
NO_PATH = "is no path; allowed: text or a path"


def anything(value: object) -> Any:
    """Return the value with any type, as in an untyped program."""
    return value


def endless() -> list[object]:
    """Return a list that holds itself."""
    values: list[object] = []
    values.append(values)
    return values


CALLS: dict[str, tuple[Callable[[], object], str]] = {
    "Moments": (lambda: irsim.Moments(anything("sky")), A_SCENARIO),
    "Rendering": (lambda: irsim.Rendering(anything("sky")), A_SCENARIO),
    "half a sample": (lambda: irsim.sample(SCENE, anything(1.5)), "n 1.5: allowed: a whole number, 0 or more"),
    "fewer samples than none": (lambda: irsim.sample(SCENE, -1), "n -1: allowed: 0 or more"),
    "a point that is a number": (
        lambda: SPACE.concrete(anything(5)),
        "point 5: allowed: a mapping of override keys to",
    ),
    "a share alone": (lambda: SPACE.at(anything(5)), "shares 5: allowed: a list of 2, for camera.bits, frames"),
    "a share in words": (
        lambda: SPACE.at(anything(["a", 0.5])),
        "no place in the unit cube; allowed: shares from 0 to",
    ),
    "a severity in words": (
        lambda: SPACE.at_severities(anything(["a", 0])),
        "vary: camera.bits: there is no severity 'a'; allowed: 0 to 1",
    ),
    "change": (lambda: irsim.change(anything("sky"), {}), A_SCENARIO),
    "record": (lambda: irsim.record(anything("sky"), "x.mcap"), "of a str; allowed: a Source, such as irsim.open_sou"),
    "a compression": (
        lambda: irsim.record(irsim.Rendering(SCENE), "x.mcap", compression=anything("zip")),
        "compression 'zip': allowed: none, lz4, zstd, archive",
    ),
    "a region of two": (lambda: irsim.Moments(SCENE).mean(0, anything((1, 2))), NO_REGION),
    "half a frame": (lambda: irsim.Rendering(SCENE).frame(anything(0.5)), "frame 0.5: allowed: a whole number, 0 to 2"),
    "load": (lambda: irsim.load(anything(None)), NO_PATH),
    "write_tracks": (lambda: write_tracks(anything(None), TRACK, ()), NO_PATH),
    "recover": (lambda: recover(anything(None), "x.mcap"), NO_PATH),
    "import_frames": (lambda: irsim.import_frames(anything(None), "x.mcap"), NO_PATH),
    "loads": (lambda: irsim.loads(anything(None)), "<text>: a NoneType is no text; allowed: the YAML text"),
    "changes in a list": (
        lambda: irsim.change(SCENE, anything(["seed=1"])),
        r"values \['seed=1'\]: allowed: a map",
    ),
    "a change to an array": (
        lambda: irsim.change(SCENE, {"camera.size": np.array([40, 30])}),
        r"camera\.size: a numpy\.ndarray cannot be written as YAML; allowed: text, a number, True, False, None, ",
    ),
    "a change to a list that holds itself": (
        lambda: irsim.change(SCENE, {"camera.size": endless()}),
        r"camera\.size: nested too deeply, or in itself; allowed: 100 levels",
    ),
    "a change to two lines": (
        lambda: irsim.change(SCENE, {"frames": "a\nb"}),
        r"^frames='a\\nb': frames: expected a whole number, not 'a\\nb'; allowed: ",
    ),
    "an override of a key of two lines": (
        lambda: irsim.load("sky", ["camera.a\nb=1"]),
        r"^override camera\.'a\\nb': unknown key 'a\\nb'; allowed: preset, ",
    ),
    "overrides in a mapping": (
        lambda: irsim.load("sky", anything({"camera.netd_mk": 80})),
        r"overrides \{.*\}: is a mapping; allowed: a list of texts, .* or irsim\.change\(scenario, ",
    ),
    "True for a frame": (lambda: irsim.Rendering(SCENE).frame(True), "frame True: allowed: a whole number, 0 to 2"),
    "a seed": (lambda: irsim.Rendering(SCENE).with_seed(anything("a")), "seed 'a': allowed: a whole number, 0 or more"),
    "neither fixed nor not": (
        lambda: irsim.Moments(SCENE).variance(0, fixed=anything("no")),
        "fixed 'no': allowed: True or False",
    ),
    "a name": (lambda: irsim.Moments(SCENE, "jet"), r"without 'jet': allowed: a list of names, such as \['jet'\]"),
}


@pytest.mark.parametrize("call", CALLS)
def test_a_wrong_argument_is_one_line(call: str) -> None:
    run, message = CALLS[call]
    with pytest.raises(InputError, match=message) as caught:
        run()
    assert len(str(caught.value).splitlines()) == 1


def test_a_frame_number_is_an_integer(tmp_path: Path) -> None:
    recording = irsim.open_recording(irsim.record(irsim.Rendering(SCENE), tmp_path / "a.mcap"))
    with pytest.raises(InputError, match="frame '1': allowed: a whole number, 0 to 2"):
        recording.frame(anything("1"))
    for source in (recording, irsim.Rendering(SCENE)):
        assert source.frame(anything(np.int64(1))).index == 1
        truth = source.truth(anything(np.int64(1)))
        assert truth is not None
        assert [truth] == list(source.truths(1, 2))
        with pytest.raises(InputError, match="frame '1': allowed: a whole number, 0 to 2"):
            source.truth(anything("1"))
        for read, index in ((source.frame, 3), (source.truth, 3), (source.truth, -1)):
            with pytest.raises(IndexError, match=f"frame {index}: .* has frames 0 to 2"):
                read(index)


def test_an_unknown_switch_lists_the_names_that_exist() -> None:
    for word in ("gost", "white,gost"):
        with pytest.raises(InputError, match=r"there is no 'gost'; allowed: .*\bjet\b"):
            irsim.load("sky", [f"without={word}"])
    with pytest.raises(InputError, match=r"there is no 'far\.textur'; allowed: far\.texture, near\.texture, "):
        irsim.Moments(irsim.load("sky"), ["far.textur"])


def test_names_with_commas_are_a_list() -> None:
    whole = irsim.load("sky", ["without=[jet, white]"])
    assert irsim.load("sky", ["without=jet, white"]) == whole
    text = irsim.dumps(whole)
    assert irsim.loads(text) == whole
    assert "\nwithout: [jet, white]\n" in text
    for short, same in (("jet, white", whole), ("jet", irsim.load("sky", ["without=[jet]"]))):
        assert irsim.loads(text.replace("[jet, white]", short)) == same
    with pytest.raises(InputError, match=r"without.0: there is no 'yet'; allowed: .*; did you mean 'jet'\?$"):
        irsim.loads(text.replace("[jet, white]", "yet"))
