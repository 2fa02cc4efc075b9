"""Ground truth from a CSV of boxes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from frame_folders import folder_of, pictures

from irsim.errors import InputError
from irsim.recording import Recording, open_recording
from irsim.recording.importers import import_frames
from irsim.recording.labels import read_labels
from irsim.types import Box, TargetTruth

Import = Callable[..., Recording]


@pytest.fixture
def imported(tmp_path: Path) -> Import:
    """Import four pictures of 32x24 px with a truth: `imported("frame,x,y,w,h\\n...", rate_hz=30)`."""
    folder = folder_of(tmp_path / "clip", pictures())

    def call(text: str, **options: object) -> Recording:
        (tmp_path / "gt.csv").write_text(text)
        out = import_frames(folder, tmp_path / "r.mcap", truth=tmp_path / "gt.csv", **{"rate_hz": 30, **options})  # type: ignore[arg-type]  # options of any type
        return open_recording(out)

    return call


def test_boxes_become_truth(imported: Import) -> None:
    rows = "0,10,5,4,3,jet,plane\n0,1.5,2,2.5,2,,\n1,,,,,jet,plane\n3,0,0,1,1,jet,plane\n"
    recording = imported("frame,x,y,w,h,id,cls\n" + rows)
    first, second, third, fourth = recording.truths()
    # The centre of pixels 10, 11, 12, 13 is 11.5; that of rows 5, 6, 7 is 6.
    jet = TargetTruth("jet", (11.5, 6.0), Box(11.5, 6.0, 4.0, 3.0), cls="plane", in_view=True, accuracy_px=1.0)
    other = TargetTruth("target", (2.25, 2.5), Box(2.25, 2.5, 2.5, 2.0), in_view=True, accuracy_px=1.0)
    assert first.targets == (jet, other)
    assert second.targets == third.targets == ()
    assert (fourth.targets[0].center, fourth.time) == ((0.0, 0.0), 3 / 30)
    assert (recording.follow, recording.header.accuracy_px) == ("jet", 1.0)
    recording = imported("frame,x,y,w,h\n2,1e1,+2.5,.5,3.\n", accuracy_px=0.25)
    (target,) = list(recording.truths())[2].targets
    assert (target.id, target.accuracy_px, target.box.pixels) == ("target", 0.25, (10.0, 2.5, 0.5, 3.0))


def test_centres_in_view(imported: Import) -> None:
    # Centres from -0.5 to 31.5 and 23.5 are in the picture of 32x24.
    recording = imported("frame,x,y,w,h\n0,100,5,4,3\n1,-4,2,7,2\n2,-4,2,8,2\n3,30,23,4,2\n")
    assert [truth.targets[0].in_view for truth in recording.truths()] == [False, False, True, True]


def test_note_of_boxes_outside_the_picture(imported: Import) -> None:
    """A box that touches an edge of the picture from outside is outside."""
    inside = "frame,x,y,w,h\n0,-3,5,4,3\n1,31,23,4,2\n"
    assert imported(inside + "2,,,,\n3,,,,\n").contents.notes == ()
    recording = imported(inside + "2,-4,5,4,3\n3,5,24,4,2\n")
    assert recording.contents.notes == ("boxes outside the picture of 32x24 px: 2 of 4, first in frame 2",)


def gaps(folder: Path, rows: str, frames: int = 8) -> tuple[str, ...]:
    path = folder / "gt.csv"
    path.write_text("frame,x,y,w,h,id\n" + rows)
    return read_labels(path, 1.0).gap_note(frames)


def test_note_of_frames_without_a_row(imported: Import, tmp_path: Path) -> None:
    """Frames before a target's first row and after its last need no row; a blank row, also without id, is a row."""
    advice = "write a row for each frame, with blank numbers where a target is absent"
    recording = imported("frame,x,y,w,h\n0,3,5,4,3\n3,4,5,4,3\n")
    assert recording.contents.notes == (f"no row for target in 2 of 4 frames: taken as absent there; {advice}",)
    assert [len(truth.targets) for truth in recording.truths()] == [1, 0, 0, 1]
    assert gaps(tmp_path, "2,3,5,4,3,a\n3,3,5,4,3,a\n4,3,5,4,3,b\n", 5) == ()
    assert gaps(tmp_path, "2,3,5,4,3,a\n3,,,,,a\n4,3,5,4,3,a\n", 5) == ()
    assert gaps(tmp_path, "2,3,5,4,3,a\n3,,,,,\n4,3,5,4,3,a\n", 5) == ()
    (note,) = gaps(tmp_path, "".join(f"{frame},3,5,4,3,{name}\n" for name in "abcde" for frame in (0, 2)), 3)
    named = "for a in 1 of 3 frames, for b in 1 of 3 frames, for c in 1 of 3 frames, for 2 more targets"
    assert note.startswith(f"no row {named}: ")


def test_note_of_rows_that_end_early(tmp_path: Path) -> None:
    note = "the rows end at frame 3 of 0 to 7: after it, in 4 frames, nothing is taken to be there; "
    advice = "write rows with blank numbers where that is so"
    assert gaps(tmp_path, "2,3,5,4,3,a\n3,3,5,4,3,b\n") == (note + advice,)
    assert gaps(tmp_path, "2,3,5,4,3,a\n7,,,,,b\n") == ()


def test_ids_become_names(imported: Import) -> None:
    rows = "frame,x,y,w,h,id\n0,1,1,2,2,0\n0,1,1,2,2,big bird\n0,1,1,2,2,ok-1\n1,,,,,\n2,,,,,\n3,,,,,\n"
    recording = imported(rows)
    assert recording.targets == ("target-0", "big_bird", "ok-1")
    assert recording.contents.notes == ("id '0' is called target-0", "id 'big bird' is called big_bird")
    for follow, name in ((None, "target-0"), ("big bird", "big_bird"), ("big_bird", "big_bird")):
        assert imported(rows, follow=follow).follow == name
    with pytest.raises(InputError, match=r"gt\.csv: there is no target 'ok-2'; allowed: .*; did you mean 'ok-1'\?"):
        imported(rows, follow="ok-2")


HEADER = "frame,x,y,w,h\n"
WRONG = [
    ("0,10,20,5,5\n", "gt.csv:1: the header is missing: the first line names the columns; allowed: frame,x,y,w,h[,id"),
    ("frame;x;y;w;h\n0;1;1;2;2\n", "gt.csv:1: the columns are separated by ';'; allowed: frame,x,y,w,h[,id,cls], with"),
    ("Frame,X,Y,W,H\n", "gt.csv:1: unknown column 'Frame'; allowed: frame,x,y,w,h[,id,cls]; did you mean 'frame'?"),
    ("", "gt.csv:1: missing frame, x, y, w, h; allowed: frame,x,y,w,h[,id,cls]"),
    ("frame,x,y,w,h,x\n", "gt.csv:1: the column 'x' is there twice"),
    (HEADER, "gt.csv: holds no row"),
    (HEADER + "0,1,1,2,2,3\n", "gt.csv:2: 6 fields for 5 columns"),
    (HEADER + "\n1.5,1,1,2,2\n", "gt.csv:3: frame: '1.5' is not a frame number"),
    (HEADER + "0,1_0,1,2,2\n", "gt.csv:2: x: '1_0' is not a number"),
    (HEADER + "0,1.7e308,1,2,2\n", "gt.csv:2: x: 1.7e308 is out of range; allowed: -1e+12 to 1e+12 px"),
    (HEADER + "0,1e999,1,2,2\n", "gt.csv:2: x: '1e999' is not a number"),
    (HEADER + "0,1,,2,2\n", "gt.csv:2: y: '' is not a number; allowed: px, or all four blank for absent"),
    (HEADER + "0,1,1,-2,2\n", "gt.csv:2: w: -2 is not a size"),
    (HEADER + "0,1,1,2,2\n4,1,1,2,2\n", "gt.csv:3: frame 4 is past the end; allowed: 0 to 3"),
    (HEADER + "1,1,1,2,2\n1,1,1,2,2\n", "gt.csv:3: frame 1 has 'target' in line 2 already"),
    ("frame,x,y,w,h,id\n1,1,1,2,2,a b\n2,1,1,2,2,a_b\n", "gt.csv:3: id: 'a_b' and 'a b' would both be called 'a_b'"),
    ("frame,x,y,w,h,id\n1,1,1,2,2," + "a" * 65 + "\n", "is too long; allowed: 64 characters"),
]


@pytest.mark.parametrize(("text", "message"), WRONG)
def test_wrong_truth(tmp_path: Path, imported: Import, text: str, message: str) -> None:
    with pytest.raises(InputError) as error:
        imported(text)
    assert message in str(error.value)
    assert "\n" not in str(error.value)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["clip", "gt.csv"]


def test_truth_that_cannot_be_read(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "clip", pictures())
    (tmp_path / "gt.csv").write_bytes(b"frame,\xff\xfe")
    with pytest.raises(InputError, match="not a text file"):
        import_frames(folder, tmp_path / "r.mcap", truth=tmp_path / "gt.csv")
    with pytest.raises(InputError, match="no such file"):
        import_frames(folder, tmp_path / "r.mcap", truth=tmp_path / "no.csv")
    for options in ({"accuracy_px": 2.0}, {"follow": "jet"}):
        with pytest.raises(InputError, match="allowed only with truth=LABELS"):
            import_frames(folder, tmp_path / "r.mcap", **options)
