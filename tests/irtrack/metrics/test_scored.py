"""Score of a track against its source by any name; another source is an error."""

from __future__ import annotations

from pathlib import Path

import pytest

import irsim
import irtrack

SCENE = """
frames: 12
camera: {size: [64, 48]}
background: {kind: sky, horizon_k: 280, zenith_k: 260}
targets:
  - {id: a, shape: {kind: point, temperature_k: 400}, path: {kind: straight, start: [20, 20], range_m: 3000}}
"""


def test_score_by_every_kind_of_source(tmp_path: Path) -> None:
    scenario = irsim.loads(SCENE)
    track = irtrack.run("kalman", scenario)
    by_hand = irtrack.score(track, irtrack.Reference.of(irsim.Rendering(scenario).truths(), track.target))
    assert by_hand.frames == 11
    file = tmp_path / "scene.yaml"
    file.write_text(SCENE)
    sources = scenario, irsim.open_source(scenario), file, str(file)
    assert [irtrack.score(track, source).as_dict() for source in sources] == [by_hand.as_dict()] * 4


def test_a_recording_scores_its_own_track(tmp_path: Path) -> None:
    file = tmp_path / "scene.mcap"
    irsim.record(irsim.open_source(irsim.loads(SCENE)), file)
    track = irtrack.run("kalman", file)
    assert irtrack.score(track, file).frames == 11


def test_another_source_is_refused() -> None:
    track = irtrack.run("kalman", irsim.loads(SCENE))
    with pytest.raises(irtrack.InputError, match="not the source of the track; allowed: scenario, unchanged"):
        irtrack.score(track, irsim.loads(SCENE.replace("280", "281")))
    with pytest.raises(irtrack.InputError, match="allowed: scenario with seed 0, not 3, unchanged"):
        irtrack.score(track, irsim.open_source(irsim.loads(SCENE)).with_seed(3))
