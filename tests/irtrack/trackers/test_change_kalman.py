"""`change_kalman` on a target that passes behind a bar."""

from __future__ import annotations

import numpy as np
import pytest
from tracker_scenes import follow, hiding

from irsim.types import Box
from irtrack.registry.table import make


@pytest.mark.parametrize("pan", [0.0, 0.7], ids=["still", "panned"])
def test_the_target_is_found_again_after_occlusion(pan: float) -> None:
    frames, at, seen = hiding(0, pan)
    estimates = follow(make("change_kalman"), frames, Box(*at[0], 9, 9))
    errors = np.hypot(*(np.array([e.center for e in estimates]) - at[1:]).T)
    assert errors[np.array(seen[1:])].max() < 3
    hidden = [e.status for e, (x, _) in zip(estimates, at[1:], strict=True) if abs(x - 75 + pan * 30) < 2]
    assert hidden
    assert "tracking" not in hidden[1:]


def test_a_panned_scene_needs_registration() -> None:
    frames, at, _ = hiding(0, 0.7)
    estimates = follow(make("change_kalman", {"register_frames": False}), frames, Box(*at[0], 9, 9))
    assert np.hypot(*np.subtract(estimates[-1].center, at[-1])) > 5
