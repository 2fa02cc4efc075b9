"""Import of real annotated sequences, which are no part of the project."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from irsim.recording import Recording, open_recording
from irsim.recording.importers import import_frames

REAL = Path(__file__).resolve().parents[4] / "shared" / "real"

pytestmark = pytest.mark.skipif(not REAL.is_dir(), reason=f"real recordings are not there: {REAL}")

# Frames, targets: from the data's own README and the number of ids in gt.csv.
SEQUENCES = {"sky_airplane_cirrus": (326, 1), "drone_treeline": (312, 1), "birds_crossing": (319, 9)}


@pytest.fixture(scope="module", params=SEQUENCES)
def imported(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Recording]:
    folder = REAL / request.param
    out = tmp_path_factory.mktemp("real") / f"{request.param}.mcap"
    return request.param, open_recording(import_frames(folder / "frames.mp4", out, truth=folder / "gt.csv"))


def test_frames_and_targets_are_complete(imported: tuple[str, Recording]) -> None:
    name, recording = imported
    frames, targets = SEQUENCES[name]
    assert (len(recording), len(recording.targets)) == (frames, targets)
    assert (recording.size, recording.bits, recording.rate_hz) == ((320, 256), 8, 30.0)
    images = [frame.image for frame in recording.frames("display")]
    assert len(images) == frames
    assert all(image.shape == (256, 320) and image.dtype == np.uint8 for image in images)
    assert all(int(image.max()) - int(image.min()) > 20 for image in images)


def test_every_box_is_the_labelled_one(imported: tuple[str, Recording]) -> None:
    name, recording = imported
    with (REAL / name / "gt.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["x"]]
    boxes = {(truth.index, target.id): target.box.pixels for truth in recording.truths() for target in truth.targets}
    assert len(boxes) == len(rows)
    for row in rows:
        wanted = [float(row[key]) for key in ("x", "y", "w", "h")]
        assert boxes[int(row["frame"]), f"target-{row['id']}"] == pytest.approx(wanted, abs=1e-9)


def test_the_plane_is_in_its_box(tmp_path: Path) -> None:
    folder = REAL / "sky_airplane_cirrus"
    path = import_frames(folder / "frames.mp4", tmp_path / "plane.mcap", truth=folder / "gt.csv")
    recording = open_recording(path)
    for frame, truth in list(zip(recording.frames(), recording.truths(), strict=True))[::25]:
        box = truth.targets[0].box
        x, y = round(box.cx), round(box.cy)
        inside = frame.image[max(y - 5, 0) : y + 6, max(x - 5, 0) : x + 6].astype(float)
        assert inside.max() - np.median(frame.image) > 30  # hot against the sky
