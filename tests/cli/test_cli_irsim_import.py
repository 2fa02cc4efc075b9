"""irsim import: recordings of pictures, and what is told of assumptions."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from command_line import Run
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from mcap.writer import Writer

import irsim
from irsim.recording.messages import descriptor_set, encode_image, to_ns


@pytest.mark.parametrize(("agc", "kind"), [("clahe", "clahe"), ("{kind: plateau, time_constant_frames: 3}", "plateau")])
def test_import_says_how_frames_are_shown(run: Run, folder: Path, agc: str, kind: str) -> None:
    (folder / "few").mkdir()
    for index in range(2):
        cv2.imwrite(str(folder / "few" / f"{index}.png"), np.full((20, 20), 100 + index, np.uint8))
    done = run("import", "few", "--agc", agc, cwd=folder)
    assert done.returncode == 0, done.stderr
    assert irsim.open_recording(folder / "few.mcap").header.agc.kind == kind


def test_import_makes_a_recording_of_pictures(run: Run, folder: Path) -> None:
    (folder / "clip").mkdir()
    for index in range(3):
        cv2.imwrite(str(folder / "clip" / f"{index}.png"), np.full((16, 20), 10 * index, np.uint8))
    (folder / "boxes.csv").write_text("frame,x,y,w,h\n0,1,2,5,5\n2,3,4,5,5\n")
    done = run("import", "clip", "--truth", "boxes.csv", "--rate", "25", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[0] == "clip.mcap"
    recording = irsim.open_recording(folder / "clip.mcap")
    assert [int(frame.image[0, 0]) for frame in recording.frames()] == [0, 10, 20]
    assert recording.rate_hz == 25
    assert [len(truth.targets) for truth in recording.truths()] == [1, 0, 1]
    assert done.stderr.splitlines() == [
        "irsim: note: no row for target in 1 of 3 frames: taken as absent there; "
        "write a row for each frame, with blank numbers where a target is absent"
    ]


def test_import_prints_its_assumptions(run: Run, folder: Path) -> None:
    (folder / "clip").mkdir()
    cv2.imwrite(str(folder / "clip" / "0.png"), np.zeros((16, 20), np.uint8))
    (folder / "boxes.csv").write_text("frame,x,y,w,h,id\n0,1,2,5,5,7\n0,9,9,5,5,8\n")
    done = run("import", "clip", "--truth", "boxes.csv", "--follow", "8", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert done.stderr.splitlines() == [
        "irsim: note: no rate was given: 30 Hz assumed",
        "irsim: note: id '7' is called target-7",
        "irsim: note: id '8' is called target-8",
    ]
    facts = run("info", "clip.mcap", cwd=folder).stdout.splitlines()
    assert "follow     target-8" in facts
    assert "topic      /ir/image: 1 message" in facts
    assert "target     target-7: 1 frame from 0 on" in facts


def test_import_with_bits_and_accuracy(run: Run, folder: Path) -> None:
    (folder / "clip").mkdir()
    cv2.imwrite(str(folder / "clip" / "0.png"), np.full((16, 20), 4095, np.uint16))
    (folder / "boxes.csv").write_text("frame,x,y,w,h\n0,1,2,5,5\n")
    done = run("import", "clip", "--truth", "boxes.csv", "--bits", "12", "--accuracy", "2.5", cwd=folder)
    assert done.returncode == 0, done.stderr
    recording = irsim.open_recording(folder / "clip.mcap")
    assert (recording.bits, recording.header.accuracy_px) == (12, 2.5)


def test_import_of_a_recording_to_itself(run: Run, folder: Path) -> None:
    """The command in the message recovers the recording, which is cut short."""
    whole = irsim.record(irsim.Rendering(irsim.load(folder / "scene.yaml")), folder / "cut1.mcap").read_bytes()
    (folder / "cut1.mcap").write_bytes(whole[:-200])
    done = run("import", "cut1.mcap", cwd=folder)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.splitlines() == [
        "irsim: cut1.mcap: would replace cut1.mcap, a recording; allowed: irsim import cut1.mcap -o NEW.mcap, which "
        "recovers its intact frames"
    ]
    done = run("import", "cut1.mcap", "-o", "new.mcap", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert len(irsim.open_recording(folder / "new.mcap")) > 0


def test_other_programs_mcap_is_read_by_its_topic(run: Run, folder: Path) -> None:
    writer = Writer(str(folder / "cam.mcap"))
    writer.start()
    schema = writer.register_schema("foxglove.RawImage", "protobuf", descriptor_set(RawImage.DESCRIPTOR))
    for topic in ("/left", "/right"):
        channel = writer.register_channel(topic, "protobuf", schema)
        for index in range(3):
            image = encode_image(np.full((12, 16), 100 * len(topic) + index, np.uint16), to_ns(index / 20))
            writer.add_message(channel, to_ns(index / 20), image, to_ns(index / 20))
    writer.finish()  # type: ignore[no-untyped-call]  # mcap leaves it untyped
    done = run("info", "cam.mcap", cwd=folder)
    assert done.stderr.endswith("it has no metadata record 'irsim'; irsim import makes one of its images\n")
    done = run("import", "cam.mcap", cwd=folder)
    assert done.stderr.endswith("allowed: irsim import cam.mcap -o NEW.mcap\n")
    done = run("import", "cam.mcap", "-o", "new.mcap", cwd=folder)
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
    assert done.stderr.endswith("/right (foxglove.RawImage, 3 messages); allowed: one of them (--topic NAME)\n")
    done = run("import", "cam.mcap", "--topic", "/right", "-o", "new.mcap", cwd=folder)
    assert done.stderr == "irsim: note: no rate was given: 20 Hz, from the times of the messages, which are kept\n"
    assert int(irsim.open_recording(folder / "new.mcap").frame(1).image[0, 0]) == 601


def test_raw_file_with_its_layout(run: Run, folder: Path) -> None:
    (folder / "clip.raw").write_bytes(np.arange(2 * 12 * 16, dtype="<u2").tobytes())
    done = run("import", "clip.raw", "--rate", "9", cwd=folder)
    assert "cannot be opened as a video; allowed: " in done.stderr
    assert "or a raw file with its layout" in done.stderr
    done = run("import", "clip.raw", "--layout", "12,16", cwd=folder)
    assert done.stderr.startswith("irsim: --layout 12,16: allowed: ROWS,COLUMNS,TYPE")
    done = run("import", "clip.raw", "--layout", "12,16,uint16", "--rate", "9", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert int(irsim.open_recording(folder / "clip.mcap").frame(1).image[0, 0]) == 192
