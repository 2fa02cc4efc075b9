"""Compensation of the camera's motion keeps identities of targets that a panning, shaking camera sees."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest

import irsim
from irtrack.metrics.tasks import task_scores
from irtrack.registry.table import MULTI_TRACKERS
from irtrack.replay.many import ManyPlayer
from irtrack.replay.replay import named, replay

SEEDS = 12
WAYS = ("none", "pose", "image")


@pytest.mark.slow
@pytest.mark.parametrize("kind", MULTI_TRACKERS)
def test_compensation_keeps_identities(kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Of a camera that pans and shakes by 4 px: fewer switches of identity, lower GOSPA in every scene."""
    found = []
    for seed in range(SEEDS):
        source = irsim.open_source("many/moving", ["severity=3"]).with_seed(seed)
        players = [ManyPlayer(cast(Any, named(kind, {"ego_motion": way}))) for way in WAYS]
        truths = replay(source, [player.see for player in players], "display", 0)
        scores = [task_scores(player.result(source, "display"), truths, source.rate_hz)[0] for player in players]
        found.append([(each["switches"], each["gospa"]) for each in scores])
    switches, gospa = np.moveaxis(np.array(found, dtype=np.float64), -1, 0)
    with capsys.disabled():
        print(f"\n{kind}: switches {switches.mean(axis=0)}, GOSPA {gospa.mean(axis=0)} px of {WAYS}")
    for way in (1, 2):
        assert (gospa[:, way] < gospa[:, 0]).all()
        assert switches[:, way].sum() < switches[:, 0].sum()
        assert (switches[:, way] <= switches[:, 0]).mean() > 0.9
