"""TraX: what is written and read, against vot-trax's own server and against trackers that do all things wrong."""

from __future__ import annotations

import contextlib
import gc
import importlib.util
import shlex
import signal
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from processes import runs, wait_until
from test_peers import scene

import irsim
import irtrack
from irsim.types import Box
from irtrack.bench import Entry, parse_tracker_spec, run_bench
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
def test_what_is_written_is_read(arguments: list[str], properties: dict[str, str]) -> None:
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


@settings(max_examples=300)
@given(st.text(st.sampled_from('0123456789.,-+einfa:mask "\\='), max_size=40))
@example("nan")
@example("inf")
def test_any_region_gives_a_sound_box_or_none_or_one_clear_error(text: str) -> None:
    with contextlib.suppress(TrackerError):
        box = trax.box_of(text)
        assert box is None or (np.isfinite((box.cx, box.cy)).all() and min(box.w, box.h) > 0)


@settings(max_examples=300)
@given(st.binary(max_size=60))
def test_any_line_is_a_message_or_one_clear_error(line: bytes) -> None:
    with contextlib.suppress(TrackerError):
        message = trax.read(trax.PREFIX + line)
        again = trax.write(message.kind, message.arguments, message.properties)
        assert trax.read(again).properties == message.properties


needs_vot = pytest.mark.skipif(importlib.util.find_spec("trax") is None, reason="vot-trax is not installed")


@needs_vot
@pytest.mark.parametrize(
    ("region", "pictures", "input"),
    [
        ("rectangle", "path", "display"),
        ("polygon", "buffer", "counts"),
        ("mask", "memory", "display"),
        ("rectangle", "path", "counts"),
    ],
)
def test_the_reference_implementation_understands_and_is_understood(
    region: str, pictures: str, input: irsim.Input
) -> None:
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
    [
        (),
        ("trax.version=1", "trax.name=old"),
        ("trax.version=2", "trax.region=rectangle;polygon", "trax.channels=ir"),
        ("trax.version=3", "trax.region=rectangle", "trax.channels=color"),
        MODERN,
    ],
    ids=["bare", "1", "2", "3", "4"],
)
def test_each_version_is_spoken(hello: tuple[str, ...]) -> None:
    """The fake takes a picture and a region in one message before version 4, in two from then on."""
    track = irtrack.run(fake(hello=hello), scene())
    assert np.abs(track.centers - dot(scene())).max() < 4


@pytest.mark.parametrize(
    ("hello", "said"),
    [
        (("trax.version=9",), "its program speaks TraX '9'; allowed: versions 1 to 4"),
        (("trax.version=four",), "its program speaks TraX 'four'; allowed: versions 1 to 4"),
        (("trax.region=cube;",), "its program wants regions cube; allowed: rectangle, polygon, mask"),
        (("trax.version=3", "trax.channels=color;depth;"), "its program wants the channel depth; allowed: color, ir"),
    ],
)
def test_what_irtrack_has_not_got_is_refused(hello: tuple[str, ...], said: str) -> None:
    with pytest.raises(TrackerError) as raised:
        irtrack.run(fake(hello=hello), scene())
    assert str(raised.value) == f"trax: frame 0: {said}"


@pytest.mark.parametrize(
    ("mode", "said"),
    [
        *(
            (mode, "its program answered the region")
            for mode in ("nan", "inf", "flat", "words", "ellipse", "odd", "mask")
        ),
        ("none", "its program answered a state of 0 regions; allowed: one"),
        ("several", "its program answered a state of 2 regions; allowed: one"),
        ("unclosed", "its program answered b'@@TRAX:state \"1,2,3,4\\n'; allowed: a TraX message"),
        ("sure", "its program says the confidence 'very'; allowed: a number"),
        ("unsure", "the score nan; allowed: finite numbers"),
        ("hello", "its program answered b'@@TRAX:hello\\n'; allowed: @@TRAX:state"),
        ("quit", "its program quit: no more luck"),
        ("die", "its program ended with status 3; it last wrote: out of luck"),
    ],
)
def test_what_a_program_does_wrong_is_one_line_with_its_place(mode: str, said: str) -> None:
    with pytest.raises(TrackerError) as raised:
        irtrack.run(fake(mode), scene())
    assert str(raised.value).startswith(f"trax: frame 4: {said}")
    assert "\n" not in str(raised.value)


def test_an_answer_too_many_does_not_shift_the_track() -> None:
    with pytest.raises(TrackerError, match=r"frame 4: its program answered .* without being asked"):
        irtrack.run(fake("twice"), scene())


@pytest.mark.parametrize("mode", ["hang", "endless"])
def test_a_program_that_gives_no_answer_is_ended(mode: str) -> None:
    """At frame 4, unless the machine is so slow that it comes late before."""
    with pytest.raises(TrackerError, match=r"trax: frame \d: its program gave no answer in 1 s"):
        irtrack.run(fake(mode, timeout_s=1.0), scene())


def test_talk_beside_the_answers_is_no_harm() -> None:
    """Six megabytes of it at each frame; 'x...x @@TRAX:state' is none, a message begins its line."""
    quiet, loud = irtrack.run(fake(), scene()), irtrack.run(fake("flood"), scene())
    assert loud.centers.tolist() == quiet.centers.tolist()


@pytest.mark.parametrize("mode", ["special", "gone"])
def test_a_program_that_has_no_target_says_lost(mode: str) -> None:
    track = irtrack.run(fake(mode), scene())
    assert track.statuses[:4] == ("tracking",) * 4
    assert set(track.statuses[4:]) == {"lost"}
    assert (track.centers[4:] == track.centers[3]).all()


def test_a_program_is_told_goodbye(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FAREWELL", str(tmp_path / "farewell"))
    irtrack.run(fake(), scene())
    gc.collect()
    assert (tmp_path / "farewell").read_text() == "farewell"


def test_every_track_has_a_program_of_its_own() -> None:
    """Many trackers of VOT can be initialised once only. The fake tells its process id as its confidence."""
    first, second = (irtrack.run(fake(), scene()).estimates[3].score for _ in range(2))
    assert first != second


def test_a_program_ends_with_all_that_it_started(tmp_path: Path) -> None:
    """The shell waits for the sleeper that it started, and hangs."""
    note = tmp_path / "pid"
    child = Child(["sh", "-c", f"sleep 600 & echo $! > {note}; wait"], trax.PREFIX, greets=True)
    wait_until(lambda: note.exists() and note.read_text().endswith("\n"))
    sleeper = int(note.read_text())
    assert runs(sleeper)
    with pytest.raises(TrackerError, match="no answer"):
        child.hear(0.01)
    wait_until(lambda: not runs(sleeper))


def test_one_killed_from_outside_fails_its_own_cell_and_no_other(tmp_path: Path) -> None:
    killed = f"sh -c 'kill -{int(signal.SIGKILL)} $$'"
    trackers = [Entry("dies", fake("die")), Entry("killed", make(f"trax:{killed}")), Entry("good", fake())]
    with run_bench([scene()], trackers, results=tmp_path / "r.db", seeds=1) as results:
        cells = {cell.label: cell for cell in results.cells()}
    assert cells["good"].status == "ok"
    assert "out of luck" in (cells["dies"].failure or "")
    assert "was ended by SIGKILL" in (cells["killed"].failure or "")


def test_a_command_may_stand_in_the_name() -> None:
    entry = parse_tracker_spec("T=trax:python3 mine.py:timeout_s=5")
    assert entry == Entry("T", make("trax", {"command": "python3 mine.py", "timeout_s": 5}))
    assert make("program:./mine --fast") == make("program", {"command": "./mine --fast"})


@pytest.mark.parametrize(
    ("command", "said"),
    [("", "is empty"), ("cat '", "No closing quotation"), ("/nowhere/at/all", "cannot be started")],
)
def test_a_command_that_is_none_is_bad_input(command: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        irtrack.run(make(f"trax:{command}"), scene())


def test_a_start_outside_the_frame_is_bad_input() -> None:
    with pytest.raises(InputError, match="outside the frame"):
        irtrack.run(fake(), scene(), init=(Box(500.0, 500.0, 9.0, 9.0), 0))
