"""What a track looks like on paper."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from bench_fakes import Strip, Walker

import irsim
import irtrack
from irtrack.cli.track_files import track_as_dict, track_to_csv


def test_a_track_as_csv_and_json(tmp_path: Path) -> None:
    track = irtrack.run(Walker(), Strip(), frames=3)
    path = track_to_csv(track, tmp_path / "track.csv")
    rows = list(csv.DictReader(path.open()))
    assert [row["frame"] for row in rows] == ["0", "1", "2"]
    assert [float(row["cx"]) for row in rows] == [10.0, 11.0, 12.0]
    assert [row["score"] for row in rows] == ["", "0.5", "0.5"]
    assert {row["status"] for row in rows} == {"tracking"}
    document = json.loads(json.dumps(track_as_dict(track), allow_nan=False))
    assert document["start"] == {"frame": 0, "cx": 10.0, "cy": 20.0, "w": 5.0, "h": 5.0}
    assert document["frames"][2]["cx"] == 12.0
    assert document["frames"][0]["neff"] is None
    assert sorted(path.name for path in tmp_path.iterdir()) == ["track.csv"]


def test_a_folder_that_does_not_exist_is_one_line(tmp_path: Path) -> None:
    track = irtrack.run(Walker(), Strip(), frames=2)
    with pytest.raises(irsim.InputError, match=r"the folder .*absent does not exist"):
        track_to_csv(track, tmp_path / "absent" / "track.csv")
