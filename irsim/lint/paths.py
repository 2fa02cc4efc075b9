"""Ways that nothing goes."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from irsim.errors import Notice
from irsim.lint.looked import existing, watched
from irsim.motion import MetrePath
from irsim.motion.attitude import STANDARD_GRAVITY
from irsim.scenario.model import Scenario
from irsim.scenario.visibility import LOOKED

NEAR_M = 1.0
"""What comes so near to the camera's place goes through it."""
MOST_G = 60.0
"""A round bound of our own, no figure of any missile: pilots bear some 9 g, and what flies without them pulls tens."""
LASTS_S = 0.25
"""A path that is bent so much for less time has a corner, or is random; whoever is shot pulls more for longer."""


def through_camera(scenario: Scenario) -> Iterator[Notice]:
    """Targets that go through the camera's place, behind which they are not seen any more."""
    context, objects = scenario.context, scenario.context.objects
    looked = watched(scenario.frames, LOOKED)
    apart = np.diff(looked).max(initial=1)
    for index, target in enumerate(scenario.targets):
        frames = existing(target, looked)
        if len(frames) < 2 or objects is None:
            continue
        places = target.path.positions(frames, context, target.id) - objects.camera_positions(frames, context)
        steps = np.diff(places, axis=0)
        lengths = np.maximum(np.sum(steps**2, axis=1), 1e-12)
        share = -np.sum(places[:-1] * steps, axis=1) / lengths  # of each step, where it comes nearest
        nearest = np.linalg.norm(places[:-1] + share[:, None] * steps, axis=1)
        through = (share >= 0) & (share < 1) & (nearest < NEAR_M) & (np.diff(frames) <= apart)
        if through.any():
            at = int(np.argmax(through))
            frame = frames[at] + share[at]
            yield Notice(
                ("targets", index, "path"),
                f"at frame {frame:.0f} {target.id} goes through the camera, and is behind it from then on; try a lower "
                "speed, fewer frames, or a way past the camera",
            )


def pulls(scenario: Scenario) -> Iterator[Notice]:
    """Paths in metres that are bent as nothing can fly: accelerations over three frames, m/s2.

    Of long scenarios, in their first LOOKED frames. Those in pixels are drawn for the picture, and their ranges say
    little: shipped ladders go to 340 g in it.
    """
    rate_hz = scenario.camera.rate_hz
    window, first_ones = max(3, math.ceil(LASTS_S * rate_hz)), np.arange(float(min(scenario.frames, LOOKED)))
    for index, target in enumerate(scenario.targets):
        frames = first_ones[first_ones >= target.path.begins]
        if not isinstance(target.path, MetrePath) or len(frames) < window + 2:
            continue
        places = target.path.positions(frames, scenario.context, target.id)
        bent = np.linalg.norm(places[2:] - 2 * places[1:-1] + places[:-2], axis=1) * rate_hz**2 / STANDARD_GRAVITY
        lasting = np.lib.stride_tricks.sliding_window_view(bent, window).min(axis=1)
        if lasting.max() > MOST_G:
            first = int(np.argmax(lasting > MOST_G))
            yield Notice(
                ("targets", index, "path"),
                f"from frame {frames[first + 1]:.0f} on {target.id} pulls {lasting.max():.0f} g, and "
                f"more than {MOST_G:g} is hardly meant, even of a missile: try less speed, or wider turns",
            )
