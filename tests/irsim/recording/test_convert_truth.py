"""Importing boxes: how they become truth, who is followed, and what is wrong with them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from frame_folders import folder_of, pictures

from irsim.errors import InputError
from irsim.recording import open_recording
from irsim.recording.importers import import_frames
from irsim.recording.labels import read_labels
from irsim.types import Box, TargetTruth


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return folder_of(tmp_path / "clip", pictures())


@pytest.fixture
def truth(tmp_path: Path) -> Callable[[str], Path]:
    def write(text: str) -> Path:
        path = tmp_path / "gt.csv"
        path.write_text(text)
        return path

    return write


def test_boxes_become_truth(tmp_path: Path, folder: Path, truth: Callable[[str], Path]) -> None:
    table = truth("frame,x,y,w,h,id,cls\n0,10,5,4,3,jet,plane\n0,1.5,2,2.5,2,,\n1,,,,,jet,plane\n3,0,0,1,1,jet,plane\n")
    recording = open_recording(import_frames(folder, tmp_path / "r.mcap", truth=table, rate_hz=30))
    first, second, third, fourth = recording.truths()
    # Pixels 10, 11, 12, 13 have their middle at 11.5; rows 5, 6, 7 at 6.
    jet = TargetTruth("jet", (11.5, 6.0), Box(11.5, 6.0, 4.0, 3.0), cls="plane", in_view=True, accuracy_px=1.0)
    other = TargetTruth("target", (2.25, 2.5), Box(2.25, 2.5, 2.5, 2.0), in_view=True, accuracy_px=1.0)
    assert first.targets == (jet, other)
    assert second.targets == third.targets == ()
    assert fourth.targets[0].center == (0.0, 0.0)
    assert fourth.time == 3 / 30
    assert recording.follow == "jet"
    assert recording.header.accuracy_px == 1.0


def test_truth_knows_whether_its_centre_is_in_view(tmp_path: Path, folder: Path, truth: Callable[[str], Path]) -> None:
    # The picture is 32x24: centres from -0.5 to 31.5 and 23.5 lie in it.
    table = truth("frame,x,y,w,h\n0,100,5,4,3\n1,-4,2,7,2\n2,-4,2,8,2\n3,30,23,4,2\n")
    recording = open_recording(import_frames(folder, tmp_path / "r.mcap", truth=table, rate_hz=30))
    assert [truth.targets[0].in_view for truth in recording.truths()] == [False, False, True, True]


def test_boxes_outside_the_picture_are_told(tmp_path: Path, folder: Path, truth: Callable[[str], Path]) -> None:
    """The picture is 32x24: the pixel before it, or after it, is outside; a box that shares an edge of it too."""
    within = "frame,x,y,w,h\n0,-3,5,4,3\n1,31,23,4,2\n"
    ended = truth(within + "2,,,,\n3,,,,\n")
    recording = open_recording(import_frames(folder, tmp_path / "r.mcap", truth=ended, rate_hz=30))
    assert recording.contents.notes == ()
    beyond = truth(within + "2,-4,5,4,3\n3,5,24,4,2\n")
    recording = open_recording(import_frames(folder, tmp_path / "s.mcap", truth=beyond, rate_hz=30))
    assert recording.contents.notes == ("boxes outside the picture of 32x24 px: 2 of 4, first in frame 2",)


def gaps(truth: Callable[[str], Path], rows: str, frames: int = 8) -> tuple[str, ...]:
    return read_labels(truth("frame,x,y,w,h,id\n" + rows), 1.0).gaps(frames)


def test_frames_without_a_row_are_told(tmp_path: Path, folder: Path, truth: Callable[[str], Path]) -> None:
    note = "no row for target in 2 of 4 frames: taken as absent there; "
    advice = "write a row for each frame, with blank numbers where a target is absent"
    table = truth("frame,x,y,w,h\n0,3,5,4,3\n3,4,5,4,3\n")
    recording = open_recording(import_frames(folder, tmp_path / "r.mcap", truth=table, rate_hz=30))
    assert recording.contents.notes == (note + advice,)
    assert [len(truth.targets) for truth in recording.truths()] == [1, 0, 0, 1]
    every_third = "".join(f"{frame},3,5,4,3,7\n" for frame in (0, 3, 6))
    assert gaps(truth, every_third) == ("no row for target-7 in 5 of 8 frames: taken as absent there; " + advice,)


def test_only_gaps_between_a_targets_rows_are_told(truth: Callable[[str], Path]) -> None:
    """One that comes late or leaves early has no rows before and after; blank rows, its own or of no id, are rows."""
    assert gaps(truth, "2,3,5,4,3,a\n3,3,5,4,3,a\n4,3,5,4,3,b\n", 5) == ()
    assert gaps(truth, "2,3,5,4,3,a\n3,,,,,a\n4,3,5,4,3,a\n", 5) == ()
    assert gaps(truth, "2,3,5,4,3,a\n3,,,,,\n4,3,5,4,3,a\n", 5) == ()
    many = gaps(truth, "".join(f"{frame},3,5,4,3,{name}\n" for name in "abcde" for frame in (0, 2)), 3)
    named = "for a in 1 of 3 frames, for b in 1 of 3 frames, for c in 1 of 3 frames, for 2 more targets"
    assert len(many) == 1
    assert many[0].startswith(f"no row {named}: ")


def test_rows_that_all_end_early_are_told(truth: Callable[[str], Path]) -> None:
    note = "the rows end at frame 3 of 0 to 7: after it, in 4 frames, nothing is taken to be there; "
    advice = "write rows with blank numbers where that is so"
    assert gaps(truth, "2,3,5,4,3,a\n3,3,5,4,3,b\n") == (note + advice,)
    assert "after it, in 1 frame, nothing" in gaps(truth, "6,3,5,4,3,a\n")[0]
    assert gaps(truth, "2,3,5,4,3,a\n7,,,,,b\n") == ()


def test_numbers_are_read_as_they_are_usually_written(
    tmp_path: Path, folder: Path, truth: Callable[[str], Path]
) -> None:
    table = truth("frame,x,y,w,h\n0,1e1,+2.5,.5,3.\n")
    recording = open_recording(import_frames(folder, tmp_path / "r.mcap", truth=table, rate_hz=30))
    (target,) = next(recording.truths()).targets
    assert target.box.pixels == (10.0, 2.5, 0.5, 3.0)


def test_accuracy_may_be_told(tmp_path: Path, folder: Path, truth: Callable[[str], Path]) -> None:
    table = truth("frame,x,y,w,h\n2,1,1,3,3\n")
    recording = open_recording(import_frames(folder, tmp_path / "r.mcap", truth=table, accuracy_px=0.25))
    (target,) = list(recording.truths())[2].targets
    assert (target.id, target.accuracy_px) == ("target", 0.25)


def test_ids_become_names(tmp_path: Path, folder: Path, truth: Callable[[str], Path]) -> None:
    rows = "frame,x,y,w,h,id\n0,1,1,2,2,0\n0,1,1,2,2,big bird\n0,1,1,2,2,ok-1\n"
    table = truth(rows + "1,,,,,\n2,,,,,\n3,,,,,\n")
    recording = open_recording(import_frames(folder, tmp_path / "r.mcap", truth=table, rate_hz=1))
    assert recording.targets == ("target-0", "big_bird", "ok-1")
    assert recording.contents.notes == ("id '0' is called target-0", "id 'big bird' is called big_bird")


@pytest.mark.parametrize(("asked", "followed"), [(None, "target-0"), ("3", "target-3"), ("target-3", "target-3")])
def test_who_is_followed_may_be_told(
    tmp_path: Path, folder: Path, truth: Callable[[str], Path], asked: str | None, followed: str
) -> None:
    table = truth("frame,x,y,w,h,id\n0,1,1,2,2,0\n0,9,9,2,2,3\n")
    recording = open_recording(import_frames(folder, tmp_path / "r.mcap", truth=table, follow=asked))
    assert recording.follow == followed


def test_nobody_of_that_name_to_follow(tmp_path: Path, folder: Path, truth: Callable[[str], Path]) -> None:
    table = truth("frame,x,y,w,h,id\n0,1,1,2,2,jet\n")
    with pytest.raises(InputError, match=r"gt\.csv: there is no target 'jat'; allowed: jet; did you mean 'jet'\?"):
        import_frames(folder, tmp_path / "r.mcap", truth=table, follow="jat")
    with pytest.raises(InputError, match=r"allowed with truth only \(truth=CSV\)"):
        import_frames(folder, tmp_path / "r.mcap", follow="jet")


def test_an_import_replaces_nothing_that_it_reads(tmp_path: Path, folder: Path, truth: Callable[[str], Path]) -> None:
    table = truth("frame,x,y,w,h\n0,1,1,2,2\n")
    for out in (table, folder / "frame_0.png"):
        before = out.read_bytes()
        with pytest.raises(InputError, match="would replace"):
            import_frames(folder, out, truth=table)
        assert out.read_bytes() == before


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (
            "0,10,20,5,5\n1,11,20,5,5\n",
            "gt.csv:1: the header is missing: the first line names the columns; allowed: frame,x,y,w,h[,id,cls]",
        ),
        (
            "frame;x;y;w;h\n0;1;1;2;2\n",
            "gt.csv:1: ';' stands between the columns; allowed: frame,x,y,w,h[,id,cls], with commas",
        ),
        ("0\t1\t1\t2\t2\n", "gt.csv:1: '\\t' stands between the columns"),
        ("t,left,top,width,height\n", "gt.csv:1: unknown column 't'; allowed: frame,x,y,w,h[,id,cls]"),
        ("Frame,X,Y,W,H\n", "gt.csv:1: unknown column 'Frame'; allowed: frame,x,y,w,h[,id,cls]; did you mean 'frame'?"),
        ("", "gt.csv:1: missing frame, x, y, w, h; allowed: frame,x,y,w,h[,id,cls]"),
        ("frame,x,y,w\n", "gt.csv:1: missing h"),
        (
            "frame,x,y,w,h,clas\n",
            "gt.csv:1: unknown column 'clas'; allowed: frame,x,y,w,h[,id,cls]; did you mean",
        ),
        ("frame,x,y,w,h,x\n", "gt.csv:1: the column 'x' is there twice"),
        ("frame,x,y,w,h\n", "gt.csv: holds no row"),
        ("frame,x,y,w,h\n0,1,1,2,2,3\n", "gt.csv:2: 6 fields for 5 columns"),
        ("frame,x,y,w,h\n\n1.5,1,1,2,2\n", "gt.csv:3: frame: '1.5' is not a frame number"),
        ("frame,x,y,w,h\n-1,1,1,2,2\n", "gt.csv:2: frame: '-1' is not a frame number"),
        ("frame,x,y,w,h\n0,one,1,2,2\n", "gt.csv:2: x: 'one' is not a number"),
        ("frame,x,y,w,h\n0,1_0,1,2,2\n", "gt.csv:2: x: '1_0' is not a number"),
        ("frame,x,y,w,h\n0,\u0661,1,2,2\n", "gt.csv:2: x: '\u0661' is not a number"),
        ("frame,x,y,w,h\n0,1e999,1,2,2\n", "gt.csv:2: x: '1e999' is not a number"),
        ("frame,x,y,w,h\n0,1,nan,2,2\n", "gt.csv:2: y: 'nan' is not a number"),
        ("frame,x,y,w,h\n0,1,,2,2\n", "gt.csv:2: y: '' is not a number; allowed: px, or all four blank for absent"),
        ("frame,x,y,w,h\n0,1,1,-2,2\n", "gt.csv:2: w: -2 is not a size"),
        ("frame,x,y,w,h\n0,1,1,2,0\n", "gt.csv:2: h: 0 is not a size"),
        ("frame,x,y,w,h\n0,1,1,2,2\n4,1,1,2,2\n", "gt.csv:3: frame 4 is past the end; allowed: 0 to 3"),
        ("frame,x,y,w,h\n1,1,1,2,2\n1,1,1,2,2\n", "gt.csv:3: frame 1 has 'target' in line 2 already"),
        (
            "frame,x,y,w,h,id\n1,1,1,2,2,a b\n2,1,1,2,2,a_b\n",
            "gt.csv:3: id: 'a_b' and 'a b' would both be called 'a_b'",
        ),
        ("frame,x,y,w,h,id\n1,1,1,2,2," + "a" * 65 + "\n", "is too long; allowed: 64 characters"),
    ],
)
def test_wrong_truth(tmp_path: Path, folder: Path, truth: Callable[[str], Path], text: str, says: str) -> None:
    with pytest.raises(InputError) as error:
        import_frames(folder, tmp_path / "r.mcap", truth=truth(text))
    assert says in str(error.value)
    assert "\n" not in str(error.value)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["clip", "gt.csv"]


def test_truth_that_is_no_text_or_not_there(tmp_path: Path, folder: Path) -> None:
    (tmp_path / "gt.csv").write_bytes(b"frame,\xff\xfe")
    with pytest.raises(InputError, match="not a text file"):
        import_frames(folder, tmp_path / "r.mcap", truth=tmp_path / "gt.csv")
    with pytest.raises(InputError, match="no such file"):
        import_frames(folder, tmp_path / "r.mcap", truth=tmp_path / "no.csv")


def test_an_accuracy_must_mean_something(tmp_path: Path, folder: Path, truth: Callable[[str], Path]) -> None:
    with pytest.raises(InputError, match="allowed with truth only"):
        import_frames(folder, tmp_path / "r.mcap", accuracy_px=2.0)
    table = truth("frame,x,y,w,h\n0,1,1,3,3\n")
    for wrong in (-1.0, float("nan"), float("inf")):
        with pytest.raises(InputError, match=r"^accuracy .*: allowed: a number, 0 px or more$"):
            import_frames(folder, tmp_path / "r.mcap", truth=table, accuracy_px=wrong)
