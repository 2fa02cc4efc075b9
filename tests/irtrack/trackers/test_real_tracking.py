"""Shipped trackers on the three real sequences, from the first labelled frame of the first target."""

from __future__ import annotations

from pathlib import Path

import pytest

import irsim
import irtrack

REAL = Path(__file__).parents[4] / "shared" / "real"

pytestmark = pytest.mark.skipif(not REAL.is_dir(), reason=f"there are no real sequences at {REAL}")


@pytest.mark.parametrize("name", ["sky_airplane_cirrus", "drone_treeline", "birds_crossing"])
def test_correlation_with_a_kalman_filter_holds_the_first_target(name: str, tmp_path: Path) -> None:
    folder = REAL / name
    path = irsim.import_frames(folder / "frames.mp4", tmp_path / f"{name}.mcap", truth=folder / "gt.csv")
    recording = irsim.open_recording(path)
    track = irtrack.run(irtrack.make("kalman", {"measurement": "ncc"}), recording)
    score = irtrack.score(track, irtrack.Reference.of(recording.truths(), track.target or ""))
    assert score.lost is False
    assert score.frames > 50
    assert score.precision_20 is not None
    assert score.precision_20 > 0.9  # labels are loose: 2 to 6 px off at their 95th percentile
