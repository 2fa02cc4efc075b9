"""Importing pictures, videos and boxes."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from irsim.convert import import_frames
from irsim.display import AGCS
from irsim.errors import InputError
from irsim.recording import open_recording, record
from irsim.types import Box, TargetTruth


def pictures(count: int = 4, dtype: type = np.uint8, size: tuple[int, int] = (32, 24)) -> list[np.ndarray]:
    rng = np.random.default_rng(0)
    return [rng.integers(0, np.iinfo(dtype).max + 1, size[::-1]).astype(dtype) for _ in range(count)]


def folder_of(path: Path, images: list[np.ndarray]) -> Path:
    path.mkdir()
    for index, image in enumerate(images):
        assert cv2.imwrite(str(path / f"frame_{index}.png"), image)
    return path


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


@pytest.mark.parametrize(("dtype", "bits", "agc"), [(np.uint8, 8, "none"), (np.uint16, 16, "linear")])
def test_a_folder_comes_in_bit_for_bit(tmp_path: Path, dtype: type, bits: int, agc: str) -> None:
    images = pictures(12, dtype)
    folder = folder_of(tmp_path / "clip", images)  # frame_2 must come before frame_10
    recording = open_recording(import_frames(folder, tmp_path / "r.mcap", rate_hz=25))
    assert (recording.bits, recording.size, recording.rate_hz) == (bits, (32, 24), 25.0)
    assert recording.agc == AGCS.parse({"kind": agc})
    assert not recording.has_truth
    for index, frame in enumerate(recording.frames()):
        assert frame.time == index / 25
        assert frame.image.dtype == dtype
        assert np.array_equal(frame.image, images[index])
    assert recording.contents.notes == ()


def test_an_import_can_be_recorded_again(tmp_path: Path, folder: Path) -> None:
    first = import_frames(folder, tmp_path / "a.mcap")
    assert record(open_recording(first), tmp_path / "b.mcap").exists()
    assert open_recording(tmp_path / "b.mcap").header.input == "imported"


def test_true_depth_of_16_bit_pictures(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "clip", [image >> 2 for image in pictures(2, np.uint16)])
    assert open_recording(import_frames(folder, tmp_path / "r.mcap", bits=14)).bits == 14
    with pytest.raises(InputError, match=r"frame_0\.png: has the count 16\d\d\d; allowed: 13 bits"):
        import_frames(folder, tmp_path / "s.mcap", bits=13)
    with pytest.raises(InputError, match="17 bits do not fit; allowed: 1 to 16"):
        import_frames(folder, tmp_path / "s.mcap", bits=17)


def test_an_agc_may_be_chosen(tmp_path: Path, folder: Path) -> None:
    linear = AGCS.parse({"kind": "linear"})
    recording = open_recording(import_frames(folder, tmp_path / "r.mcap", agc=linear))  # type: ignore[arg-type]
    wanted = linear.display(pictures()[1], 8)  # type: ignore[attr-defined]
    assert np.array_equal(recording.frame(1, "display").image, wanted)


def test_without_a_rate_the_assumption_is_noted(tmp_path: Path, folder: Path) -> None:
    recording = open_recording(import_frames(folder, tmp_path / "r.mcap"))
    assert recording.rate_hz == 30
    assert recording.contents.notes == ("no rate was given: 30 Hz assumed",)


def test_colours_become_grey_and_grey_stored_as_colour_is_kept(tmp_path: Path) -> None:
    grey = pictures(1)[0]
    green = np.zeros((24, 32, 3), np.uint8)
    green[..., 1] = 100
    folder = folder_of(tmp_path / "clip", [np.dstack([grey] * 3), green])
    recording = open_recording(import_frames(folder, tmp_path / "r.mcap", rate_hz=30))
    assert np.array_equal(recording.frame(0).image, grey)
    assert (recording.frame(1).image == 59).all()  # BT.601 luma: 0.587 * 100
    assert recording.contents.notes == ("1 of 2 pictures had colours: made grey by luma (ITU-R BT.601)",)


def test_a_video(tmp_path: Path) -> None:
    path = tmp_path / "clip.avi"
    images = [cv2.GaussianBlur(image, (0, 0), 3) for image in pictures(6, size=(64, 48))]
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 12.5, (64, 48))
    for image in images:
        writer.write(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR))
    writer.release()
    recording = open_recording(import_frames(path, tmp_path / "r.mcap"))
    assert (recording.size, recording.bits, recording.rate_hz, len(recording)) == ((64, 48), 8, 12.5, 6)
    for frame, image in zip(recording.frames(), images, strict=True):
        assert np.abs(frame.image.astype(int) - image).mean() < 3  # MJPG is lossy
    assert open_recording(import_frames(path, tmp_path / "s.mcap", rate_hz=50)).rate_hz == 50
    past = tmp_path / "gt.csv"
    past.write_text("frame,x,y,w,h\n6,1,1,2,2\n")
    with pytest.raises(InputError, match=r"gt\.csv:2: frame 6 is past the end; allowed: 0 to 5"):
        import_frames(path, tmp_path / "t.mcap", truth=past)
    assert not (tmp_path / "t.mcap").exists()


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
    table = truth("frame,x,y,w,h,id\n0,1,1,2,2,0\n0,1,1,2,2,big bird\n0,1,1,2,2,ok-1\n")
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
    with pytest.raises(InputError, match=r"allowed with truth only \(--truth CSV\)"):
        import_frames(folder, tmp_path / "r.mcap", follow="jet")


def test_a_folder_gives_its_whole_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = folder_of(tmp_path / "flight.2", pictures(1))
    assert open_recording(import_frames(made, tmp_path / "a.mcap")).header.name == "flight.2"
    monkeypatch.chdir(made)
    assert open_recording(import_frames(".", tmp_path / "b.mcap")).header.name == "flight.2"


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


def test_pictures_must_be_alike(tmp_path: Path) -> None:
    sizes = folder_of(tmp_path / "sizes", [*pictures(2), *pictures(1, size=(30, 24))])
    with pytest.raises(InputError, match=r"frame_2\.png: is 30x24, 8 bit but .*frame_0\.png is 32x24, 8 bit; allowed"):
        import_frames(sizes, tmp_path / "r.mcap")
    types = folder_of(tmp_path / "types", [*pictures(1), *pictures(1, np.uint16)])
    with pytest.raises(InputError, match=r"frame_1\.png: is 32x24, 16 bit"):
        import_frames(types, tmp_path / "r.mcap")
    assert not list(tmp_path.glob("*.mcap"))


def test_broken_pictures_are_named(tmp_path: Path, folder: Path) -> None:
    third = folder / "frame_2.png"
    whole = third.read_bytes()
    huge = bytearray(whole)
    huge[16:20] = (2**31 - 1).to_bytes(4, "big")  # IHDR: columns; its CRC made right again
    huge[29:33] = zlib.crc32(huge[12:29]).to_bytes(4, "big")
    flipped = bytearray(whole)
    flipped[len(whole) // 2] ^= 4
    for broken in (b"", b"text", whole[:-20], whole[: len(whole) // 2], bytes(flipped), bytes(huge)):
        third.write_bytes(broken)
        with pytest.raises(InputError, match=r"frame_2\.png: is not a PNG picture, or is cut short or damaged"):
            import_frames(folder, tmp_path / "r.mcap")
    assert not list(tmp_path.glob("*.mcap"))


def test_sources_that_are_none(tmp_path: Path, folder: Path) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "text.mp4").write_text("hello " * 100)
    for source, says in (
        (tmp_path / "empty", r"holds no \.png"),
        (tmp_path / "nowhere", "no such file or folder"),
        (tmp_path / "text.mp4", "cannot be opened as a video"),
        (folder / "frame_0.png", "is one picture"),
    ):
        with pytest.raises(InputError, match=says) as error:
            import_frames(source, tmp_path / "r.mcap")
        assert str(source) in str(error.value)


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan"), float("inf")])
def test_impossible_rates(tmp_path: Path, folder: Path, rate: float) -> None:
    with pytest.raises(InputError, match=r"allowed: from 0\.001 to 10000 Hz"):
        import_frames(folder, tmp_path / "r.mcap", rate_hz=rate)


def test_the_output_is_checked_first(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"the folder .*nowhere does not exist"):
        import_frames(tmp_path / "no source either", tmp_path / "nowhere" / "r.mcap")


def test_a_damaged_recording_is_imported_for_what_is_whole(tmp_path: Path, folder: Path) -> None:
    whole = import_frames(folder, tmp_path / "r.mcap", rate_hz=10)
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole.read_bytes()[:-2000])
    recording = open_recording(import_frames(cut, tmp_path / "rescued.mcap"))
    assert 0 < len(recording) <= 4
    assert np.array_equal(recording.frame(0).image, pictures()[0])


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"rate_hz": 5.0}, "no rate"),
        ({"truth": "gt.csv"}, "no truth"),
        ({"name": "x"}, "no name"),
        ({"bits": 12, "agc": AGCS.parse({"kind": "linear"})}, "no agc, no bits"),
        ({"accuracy_px": 1.0}, "no accuracy"),
        ({"compression": "none"}, "no compression"),
        ({"follow": "jet"}, "no follow"),
    ],
)
def test_what_a_recording_has_of_its_own_is_not_silently_ignored(
    tmp_path: Path, folder: Path, given: dict[str, Any], says: str
) -> None:
    whole = import_frames(folder, tmp_path / "r.mcap", rate_hz=10)
    with pytest.raises(InputError, match=rf"r\.mcap: is a recording and is kept as it is; allowed: {says}$"):
        import_frames(whole, tmp_path / "again.mcap", **given)
    assert not (tmp_path / "again.mcap").exists()


def test_an_accuracy_must_mean_something(tmp_path: Path, folder: Path, truth: Callable[[str], Path]) -> None:
    with pytest.raises(InputError, match="allowed with truth only"):
        import_frames(folder, tmp_path / "r.mcap", accuracy_px=2.0)
    table = truth("frame,x,y,w,h\n0,1,1,3,3\n")
    for wrong in (-1.0, float("nan"), float("inf")):
        with pytest.raises(InputError, match="allowed: 0 px or more"):
            import_frames(folder, tmp_path / "r.mcap", truth=table, accuracy_px=wrong)
