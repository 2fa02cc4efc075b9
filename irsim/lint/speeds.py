"""Targets that are faster than anything of their kind."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from irsim.errors import Notice, decimal_text
from irsim.lint.looked import existing
from irsim.lint.standing import FARTHER
from irsim.motion import CrossesM, MetrePath
from irsim.scenario.model import Scenario
from irsim.scenario.visibility import LOOKED


def too_fast(scenario: Scenario) -> Iterator[Notice]:
    """Targets whose own way in space, wherever the camera goes, is from one frame to another longer than the fastest of
    their kind go. Of long scenarios, in their first LOOKED frames."""
    rate_hz = scenario.camera.rate_hz
    first_ones = np.arange(float(min(scenario.frames, LOOKED)))
    for index, target in enumerate(scenario.targets):
        fastest_m_s, frames = target.shape.max_speed_m_s, existing(target, first_ones)
        if fastest_m_s is None or len(frames) < 2:
            continue
        in_metres = isinstance(target.path, MetrePath | CrossesM)
        # A range beside a path in pixels is written by eye, and the speed is as much too high as it is too far.
        allowed_m_s = fastest_m_s if in_metres else FARTHER * fastest_m_s
        places = target.path.positions(frames, scenario.context, target.id)
        speeds_m_s = np.linalg.norm(np.diff(places, axis=0), axis=1) / np.diff(frames) * rate_hz
        if speeds_m_s.max() > allowed_m_s:
            first = int(np.argmax(speeds_m_s > allowed_m_s))
            most = decimal_text(float(speeds_m_s.max()), 4)
            instead = "a lower speed" if in_metres else "a lower speed, or nearer to the camera"
            yield Notice(
                ("targets", index, "path"),
                f"from frame {frames[first]:.0f} on {target.id} goes at up to {most} m/s, and more than "
                f"{fastest_m_s:g} is hardly meant, even of the fastest {target.shape.kind}: try {instead}",
            )
