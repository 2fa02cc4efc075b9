"""Ranges of frames, views and jobs of scenarios and recordings."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import irsim
from irsim.errors import parse_frame_range
from irsim.types import frame_range


@pytest.mark.parametrize(
    ("start", "stop", "expected"),
    [
        (0, None, range(5)),
        (2, 4, range(2, 4)),
        (np.int64(3), np.int64(99), range(3, 5)),
        (7, None, range(7, 5)),
    ],
)
def test_a_range_is_cut_at_the_end(start: int, stop: int | None, expected: range) -> None:
    assert frame_range(start, stop, 5) == expected


@pytest.mark.parametrize(("text", "expected"), [("10", range(10)), ("5:9", range(5, 9)), ("49:50", range(49, 50))])
def test_a_range_is_parsed(text: str, expected: range) -> None:
    assert parse_frame_range(text) == parse_frame_range(text, 50) == expected


WORDS = ["", "0", "-3", "9:5", ":9", "1:2:3", "all", "1.5"]


@pytest.mark.parametrize("text", [*WORDS, "51", "40:70"])
def test_a_wrong_range_is_an_input_error(text: str) -> None:
    allowed = "no such range; allowed: N above 0, or A:B with A below B"
    with pytest.raises(irsim.InputError) as caught:
        parse_frame_range(text, 50)
    assert str(caught.value) == f"--frames {text}: {allowed}, within 0:50"
    if text in WORDS:
        with pytest.raises(irsim.InputError) as caught:
            parse_frame_range(text)
        assert str(caught.value) == f"--frames {text}: {allowed}"
    else:
        assert parse_frame_range(text).stop > 50  # a scenario is rendered beyond its own number


@pytest.fixture(params=["scenario", "recording"])
def source(request: pytest.FixtureRequest, tmp_path: Path) -> irsim.Source:
    scene = irsim.Rendering(irsim.load("sky", ["frames=4", "camera.size=[48, 32]"]))
    if request.param == "scenario":
        return scene
    irsim.record(scene, tmp_path / "sky.mcap")
    return irsim.open_recording(tmp_path / "sky.mcap")


@pytest.mark.parametrize("asked", [{"start": -1}, {"stop": -1}])
def test_a_negative_frame_is_an_input_error(source: irsim.Source, asked: dict[str, int]) -> None:
    for items in (source.frames(**asked), source.truths(**asked)):
        with pytest.raises(irsim.InputError, match=r"^(start|stop) -1: allowed: 0 or more$"):
            list(items)


@pytest.mark.parametrize("input", ["Counts", None])
def test_an_unknown_view_is_an_input_error(source: irsim.Source, input: Any) -> None:
    line = rf"^input {input!r}: allowed: 'display' .* or 'counts' .*$"
    for look in (
        source.frame,
        lambda index, view: list(source.frames(view)),
        lambda index, view: list(source.pairs(input=view)),
    ):
        with pytest.raises(irsim.InputError, match=line):
            look(1, input)


@pytest.mark.parametrize("jobs", ["2", 0])
def test_a_wrong_number_of_jobs_is_an_input_error(tmp_path: Path, jobs: Any) -> None:
    scene = irsim.load("sky", ["frames=4", "camera.size=[48, 32]"])
    line = f"jobs {jobs!r}: allowed: " + ("1 or more" if isinstance(jobs, int) else "a whole number, 1 or more")
    for render in (
        lambda: list(irsim.frames(scene, jobs=jobs)),
        lambda: irsim.record(irsim.Rendering(scene), tmp_path / "a.mcap", jobs=jobs),
    ):
        with pytest.raises(irsim.InputError) as caught:
            render()
        assert str(caught.value) == line
    assert list(tmp_path.iterdir()) == []


def test_a_fraction_of_a_frame_is_an_input_error(source: irsim.Source, tmp_path: Path) -> None:
    with pytest.raises(irsim.InputError, match=r"^start 0\.5: allowed: a whole number, 0 or more$"):
        list(source.frames(start=0.5))
    with pytest.raises(irsim.InputError, match=r"^stop 'all': allowed: a whole number, 0 or more$"):
        irsim.record(source, tmp_path / "b.mcap", stop="all")
    with pytest.raises(irsim.InputError, match=r"^frame 1\.5: allowed: a whole number, 0 to 3$"):
        source.frame(1.5)


def test_overrides_are_a_list() -> None:
    with pytest.raises(irsim.InputError, match=r"overrides 'frames=3': allowed: a list of them, \['frames=3'\]"):
        irsim.load("sky", "frames=3")
