"""Real sensors and annotated sequences, which are no part of the project: import, noise, fit and realism."""

from __future__ import annotations

import csv
from pathlib import Path

import cv2
import numpy as np
import pytest
from calibration_clips import REAL, real_counts

import irsim
from irsim.calibration import Estimate, compare_noise, compare_texture, measure_figures, measure_noise, texture_figures
from irsim.calibration.background import background_pictures
from irsim.calibration.fit import fit
from irsim.calibration.stretch import jumps
from irsim.recording import Recording, open_recording
from irsim.recording.importers import import_frames

pytestmark = pytest.mark.skipif(not REAL.is_dir(), reason=f"real recordings are not there: {REAL}")

SENSORS = {
    "raw14_lwir": (30.0, 14, "cooled"),
    "raw14_mwir": (30.0, 14, "uncorrected"),
    "raw16_lepton": (9.0, 16, "uncooled"),
}
"""Rate, Hz, bits and sort of camera."""
TERMS = {
    "raw14_lwir": {"tvh": (1.52, 1.78), "vh": (0.59, 0.73)},
    "raw14_mwir": {"tvh": (3.0, 3.6), "vh": (14.4, 17.6)},
    "raw16_lepton": {"tvh": (1.4, 3.5), "vh": (2.5, 6.4)},
}
"""Counts: README of the data."""
FIGURES = {
    "raw14_lwir": {"pixel": (0.6, 0.7), "row": (0, 0.25), "column": (0.03, 0.2), "noise": (1.6, 1.8)},
    "raw14_mwir": {"pixel": (14, 18), "column": (1.5, 4.3), "even_rows": (-52, -26)},
    "raw16_lepton": {"pixel": (2, 6.4), "column": (-0.1, 1.4), "row": (0.4, 1.3), "noise": (1.4, 3.5)},
}
"""Counts; pixel, column, row in the README: .66, .14, .20 (LWIR); 16, 3, 52 (MWIR); 4, 1, 1 (Lepton)."""
SEQUENCES = {
    "sky_airplane_cirrus": (326, 1, {"cloud", "treeline"}),
    "drone_treeline": (312, 1, {"treeline"}),
    "birds_crossing": (319, 9, {"trees"}),
}
"""Frames and targets, from the README and gt.csv, and classes of background."""


@pytest.mark.parametrize("name", SENSORS)
def test_noise_of_a_real_sensor(name: str) -> None:
    rate_hz, bits, sort = SENSORS[name]
    counts = real_counts(name)
    assert jumps(list(counts)) == []
    report = measure_noise(counts, rate_hz, top=2.0**bits - 1)
    for term, (low, high) in TERMS[name].items():
        assert low < getattr(report.terms, term).value < high, term
    memory = report.temporal.memory
    assert (memory is not None) == (sort == "uncooled")
    if memory is not None:
        assert memory.rho.value == pytest.approx(0.9, abs=0.03)
    assert compare_noise(measure_figures(counts, rate_hz, points=False)).fitting == (sort,)


@pytest.mark.parametrize("name", SENSORS)
def test_fit_of_a_real_sensor(name: str, tmp_path: Path) -> None:
    rate_hz, bits, _ = SENSORS[name]
    for k, image in enumerate(real_counts(name)):
        cv2.imwrite(str(tmp_path / f"{k:04}.png"), image)
    found = fit(irsim.import_frames(tmp_path, tmp_path / "real.mcap", rate_hz=rate_hz, bits=bits))
    for figure, (low, high) in FIGURES[name].items():
        estimate: Estimate = getattr(found.figures, figure)
        assert low <= estimate.value <= high, figure
    assert found.scenario.frames == len(real_counts(name))


@pytest.fixture(scope="module", params=SEQUENCES)
def imported(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Recording]:
    folder = REAL / request.param
    out = tmp_path_factory.mktemp("real") / f"{request.param}.mcap"
    return request.param, open_recording(import_frames(folder / "frames.mp4", out, truth=folder / "gt.csv"))


def test_frames_targets_and_boxes_are_complete(imported: tuple[str, Recording]) -> None:
    name, recording = imported
    frames, targets, _ = SEQUENCES[name]
    assert (len(recording), len(recording.targets)) == (frames, targets)
    assert (recording.size, recording.bits, recording.rate_hz) == ((320, 256), 8, 30.0)
    assert all(int(frame.image.max()) - int(frame.image.min()) > 20 for frame in recording.frames("display"))
    with (REAL / name / "gt.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["x"]]
    boxes = {(truth.index, target.id): target.box.pixels for truth in recording.truths() for target in truth.targets}
    assert len(boxes) == len(rows)
    for row in rows:
        wanted = [float(row[key]) for key in ("x", "y", "w", "h")]
        assert boxes[int(row["frame"]), f"target-{row['id']}"] == pytest.approx(wanted, abs=1e-9)


def test_sequences_are_of_their_class(imported: tuple[str, Recording]) -> None:
    name, recording = imported
    assert set(compare_texture(texture_figures(background_pictures(recording, 9))).fitting) == SEQUENCES[name][2]


def test_the_plane_is_hot_in_its_box(imported: tuple[str, Recording]) -> None:
    name, recording = imported
    if name == "sky_airplane_cirrus":
        for frame, truth in list(zip(recording.frames(), recording.truths(), strict=True))[::25]:
            x, y = (round(at) for at in truth.targets[0].center)
            inside = frame.image[max(y - 5, 0) : y + 6, max(x - 5, 0) : x + 6].astype(float)
            assert inside.max() - np.median(frame.image) > 30
