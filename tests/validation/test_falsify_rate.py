"""The planted failure is found in nine of ten searches."""

from __future__ import annotations

from pathlib import Path

import planted_failure

import irsim
from irtrack.falsify import Failure, find_failure


def test_failure_is_found_in_nine_of_ten_searches(tmp_path: Path) -> None:
    """20 searches of at most 500 runs; all failures are shrunk to the minimal number of frames."""
    scene = irsim.loads(planted_failure.SCENE)
    found = [find_failure(scene, "planted_failure:Blind", tmp_path / str(seed), seed=seed) for seed in range(20)]
    failures = [each for each in found if isinstance(each, Failure)]
    assert len(failures) >= 18
    assert all(each.least.frames == 11 and each.sensitivity.is_structural and each.repeats for each in failures)
