"""TraX: messages and regions, against vot-trax's own server and against faulty programs."""

from __future__ import annotations

import contextlib
import gc
import importlib.util
import shlex
import sys
from pathlib import Path

import numpy as np
import pytest
from dot_scene import scene
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from processes import runs, wait_until

import irsim
import irtrack
from irsim.types import Box
from irtrack.bench import Entry, parse_tracker_spec
from irtrack.errors import InputError, TrackerError
from irtrack.external import Child, trax
from irtrack.registry.table import make

HERE = Path(__file__).parents[2] / "support"
MODERN = ("trax.version=4", "trax.region=rectangle;", "trax.channels=color;")


def fake(mode: str = "good", at: int = 4, hello: tuple[str, ...] = MODERN, **more: object) -> irtrack.Tracker:
    words = [sys.executable, str(HERE / "fake_trax.py"), mode, str(at), *hello]
    return make("trax", {"command": shlex.join(words), **more})


def dot(source: irsim.Rendering) -> np.ndarray:
    return np.array([target.center for each in source.truths() if (target := each.target("dot"))])


words = st.text(st.characters(exclude_categories=["Cs"]), max_size=12)
keys = st.text("abzAZ059._", min_size=1, max_size=64)


@given(st.lists(words.filter(lambda word: "=" not in word)), st.dictionaries(keys, words))
def test_a_written_message_is_read_back(arguments: list[str], properties: dict[str, str]) -> None:
    line = trax.write("state", arguments, properties)
    assert line.count(b"\n") == 1
    assert trax.read(line) == trax.Message("state", tuple(arguments), properties)


@given(arrays(bool, st.tuples(st.integers(1, 6), st.integers(1, 6))), st.integers(-3, 9), st.integers(-3, 9))
def test_the_box_of_a_mask_is_around_its_ones(mask: np.ndarray, x: int, y: int) -> None:
    """Against runs counted pixel by pixel."""
    runs, value = [0], False
    for pixel in mask.ravel().tolist():
        if pixel != value:
            runs.append(0)
            value = pixel
        runs[-1] += 1
    box = trax.box_of("mask:" + ",".join(map(str, [x, y, mask.shape[1], mask.shape[0], *runs])))
    if not mask.any():
        assert box is None
        return
    rows, columns = np.nonzero(mask)
    assert box == Box.from_edges(
        x + columns.min() - 0.5, y + rows.min() - 0.5, x + columns.max() + 0.5, y + rows.max() + 0.5
    )


@given(st.floats(5, 50), st.floats(5, 40), st.floats(5, 12), st.floats(5, 9))
def test_a_box_comes_back_from_each_kind_of_region(cx: float, cy: float, w: float, h: float) -> None:
    given = Box(cx, cy, w, h)
    for kind, within in (("rectangle", 1e-3), ("polygon", 1e-3), ("mask", 1.5)):
        back = trax.box_of(trax.region(given, kind, (48, 64)))
        assert back is not None
        assert np.abs(np.subtract((back.cx, back.cy, back.w, back.h), (cx, cy, w, h))).max() <= within


@settings(max_examples=100)
@given(st.text(st.sampled_from('0123456789.,-+einfa:mask "\\='), max_size=40))
@example("nan")
@example("inf")
def test_any_region_is_a_valid_box_or_one_error(text: str) -> None:
    with contextlib.suppress(TrackerError):
        box = trax.box_of(text)
        assert box is None or (np.isfinite((box.cx, box.cy)).all() and min(box.w, box.h) > 0)


needs_vot = pytest.mark.skipif(importlib.util.find_spec("trax") is None, reason="vot-trax is not installed")


@needs_vot
@pytest.mark.parametrize(
    ("region", "pictures", "input"),
    [("polygon", "buffer", "counts"), ("mask", "memory", "display"), ("rectangle", "path", "counts")],
)
def test_images_and_regions_pass_vot_trax(region: str, pictures: str, input: irsim.Input) -> None:
    """A tracker on vot-trax: each picture arrives bit for bit (its sum comes back), boxes at their places."""
    source = scene()
    command = shlex.join([sys.executable, str(HERE / "vot_tracker.py"), region, pictures])
    track = irtrack.run(f"trax:{command}", source, input=input)
    assert [each.score for each in track.estimates[1:]] == [
        frame.image.sum() for frame in source.frames(input, start=track.start + 1)
    ]
    assert np.abs(track.centers - dot(source)).max() < 4
    assert track.sizes[5] == pytest.approx(track.sizes[0], abs=1.5 if region == "mask" else 1e-3)
    assert set(track.statuses) == {"tracking"}


@pytest.mark.parametrize(
    "hello",
    [(), ("trax.version=2", "trax.region=rectangle;polygon", "trax.channels=ir"), MODERN],
    ids=["bare", "2", "4"],
)
def test_every_version_of_the_protocol(hello: tuple[str, ...]) -> None:
    """The fake takes a picture and a region in one message before version 4, in two from then on."""
    track = irtrack.run(fake(hello=hello), scene())
    assert np.abs(track.centers - dot(scene())).max() < 4


@pytest.mark.parametrize(
    ("hello", "said"),
    [
        (("trax.version=9",), "its program speaks TraX '9'; allowed: versions 1 to 4"),
        (("trax.region=cube;",), "its program wants regions cube; allowed: rectangle, polygon, mask"),
        (("trax.version=3", "trax.channels=color;depth;"), "its program wants the channel depth; allowed: color, ir"),
    ],
)
def test_unknown_versions_and_forms_are_refused(hello: tuple[str, ...], said: str) -> None:
    with pytest.raises(TrackerError) as raised:
        irtrack.run(fake(hello=hello), scene())
    assert str(raised.value) == f"trax: frame 0: {said}"


@pytest.mark.parametrize(
    ("mode", "said"),
    [
        *((mode, "its program answered the region") for mode in ("nan", "flat", "words")),
        ("several", "its program answered a state of 2 regions; allowed: one"),
        ("unclosed", "its program answered b'@@TRAX:state \"1,2,3,4\\n'; allowed: a TraX message"),
        ("sure", "its program says the confidence 'very'; allowed: a number"),
        ("hello", "its program answered b'@@TRAX:hello\\n'; allowed: @@TRAX:state"),
        ("quit", "its program quit: no more luck"),
        ("twice", "its program answered b'@@TRAX:state"),
    ],
)
def test_a_faulty_answer_is_one_line_with_its_frame(mode: str, said: str) -> None:
    with pytest.raises(TrackerError) as raised:
        irtrack.run(fake(mode), scene())
    assert str(raised.value).startswith(f"trax: frame 4: {said}")
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("mode", ["hang", "endless"])
def test_a_program_that_gives_no_answer_is_ended(mode: str) -> None:
    """At frame 4, or before on a slow machine."""
    with pytest.raises(TrackerError, match=r"trax: frame \d: its program gave no answer in 1 s"):
        irtrack.run(fake(mode, timeout_s=1.0), scene())


def test_other_output_does_not_disturb_the_answers() -> None:
    """Six megabytes at each frame; a message begins its line."""
    quiet, loud = irtrack.run(fake(), scene()), irtrack.run(fake("flood"), scene())
    assert loud.centers.tolist() == quiet.centers.tolist()


def test_a_program_without_a_target_is_lost() -> None:
    track = irtrack.run(fake("special"), scene())
    assert track.statuses[:4] == ("tracking",) * 4
    assert set(track.statuses[4:]) == {"lost"}
    assert (track.centers[4:] == track.centers[3]).all()


def test_every_track_has_a_program_that_ends_with_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Many trackers of VOT can be initialised only once. The fake's confidence is its process id."""
    monkeypatch.setenv("FAREWELL", str(tmp_path / "farewell"))
    first, second = (irtrack.run(fake(), scene()).estimates[3].score for _ in range(2))
    assert first != second
    gc.collect()
    assert (tmp_path / "farewell").read_text() == "farewell"


def test_a_program_ends_with_its_children(tmp_path: Path) -> None:
    """The shell waits for the sleeper that it started, and hangs."""
    note = tmp_path / "pid"
    child = Child(["sh", "-c", f"sleep 600 & echo $! > {note}; wait"], trax.PREFIX, greets=True)
    wait_until(lambda: note.exists() and note.read_text().endswith("\n"))
    sleeper = int(note.read_text())
    assert runs(sleeper)
    with pytest.raises(TrackerError, match="no answer"):
        child.greeting(0.01)
    wait_until(lambda: not runs(sleeper))


def test_a_name_may_hold_the_command() -> None:
    entry = parse_tracker_spec("T=trax:python3 mine.py:timeout_s=5")
    assert entry == Entry("T", make("trax", {"command": "python3 mine.py", "timeout_s": 5}))
    assert make("program:./mine --fast") == make("program", {"command": "./mine --fast"})


def test_commands_and_starts_that_are_refused() -> None:
    for command, said in (("", "is empty"), ("cat '", "No closing quotation"), ("/nowhere", "cannot be started")):
        with pytest.raises(InputError, match=said):
            irtrack.run(make(f"trax:{command}"), scene())
    with pytest.raises(InputError, match="outside the frame"):
        irtrack.run(fake(), scene(), init=(Box(500.0, 500.0, 9.0, 9.0), 0))
