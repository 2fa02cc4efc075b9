"""A bird in flapping flight."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, ClassVar

from pydantic import Field

from irsim.config.base import Switches
from irsim.config.quantities import Kelvin, Length, NotNegative
from irsim.motion.attitude import BIRD, Posture
from irsim.targets.base import Angles
from irsim.targets.body import Body
from irsim.targets.joints import Rigid, Turn, hinge, turned
from irsim.targets.solids import Solid, ball, limb, mirrored, on, plate, tube

# A gull: span 2.2 times the length from bill to tail.
_ELBOW = 0.5
_ARM = plate(((0.19, 0.06), (0.24, _ELBOW), (0.02, _ELBOW), (-0.08, 0.06)), -0.035, -0.015, "wings_k")
_HAND = plate(((0.24, _ELBOW), (0.1, 0.95), (-0.02, 1.1), (-0.03, 0.9), (0.02, _ELBOW)), -0.032, -0.018, "wings_k")


class Bird(Body):
    """A gull-like bird: warm head and body, cooler wings that beat and bend, a fan of a tail."""

    lies: ClassVar[Posture] = BIRD
    switches: ClassVar[Switches] = {"beat": ("beat_hz", 0.0)}
    alike: ClassVar[Mapping[str, int]] = {"beat_hz": 1}
    poses: ClassVar[tuple[Angles, ...]] = ((55.0, 15.0, 15.0), (90.0, 0.0, 0.0), (20.0, 5.0, 0.0))
    # A peregrine's stoop: 242 mph, 108 m/s (K. Franklin's Frightful, 1999).
    fastest_m_s: ClassVar[float | None] = 110.0
    solids: ClassVar[tuple[Solid, ...]] = (
        tube(
            (0.32, -0.01, 0.06, 0.06),
            (0.2, 0.0, 0.095, 0.095),
            (0.0, 0.005, 0.1, 0.1),
            (-0.22, 0.0, 0.05, 0.045),
        ),
        ball((0.38, 0.0, -0.015), (0.085, 0.07, 0.07), "head_k"),
        limb((0.467, 0.0, 0.005), (0.54, 0.0, 0.017), 0.03, 0.006),
        plate(((-0.22, -0.05), (-0.22, 0.05), (-0.5, 0.13), (-0.5, -0.13)), -0.02, 0.005, "wings_k"),
        *on("left_arm", mirrored(_ARM)),
        *on("right_arm", _ARM),
        *on("left_hand", mirrored(_HAND)),
        *on("right_hand", _HAND),
    )

    length_m: Length = 0.6
    """Length from bill to tail, m; the wings span 2.2 times that."""
    temperature_k: Kelvin = 300.0
    """Temperature of the plumage of the body, kelvin."""
    head_k: Kelvin = 307.0
    """Temperature of the head, kelvin."""
    wings_k: Kelvin = 290.0
    """Temperature of wings and tail, kelvin."""
    beat_hz: NotNegative = 3.0
    """Wing beats a second."""
    beat_deg: Annotated[float, Field(ge=0, le=80)] = 38.0
    """The wings' angle above and below level at the ends of a beat, degrees."""
    phase_deg: Turn = 70.0
    """Place in the beat in frame 0, degrees; at 90 the wings are up."""

    def joints(self, time: float) -> Mapping[str, Rigid]:
        phase = turned(self.phase_deg, self.beat_hz, time)
        lift = math.radians(self.beat_deg) * math.sin(phase)
        # The outer wing lags behind, and bends down more than up.
        bend = math.radians(self.beat_deg) * (0.6 * math.sin(phase - 1.2) - 0.25)
        right = hinge((0.0, 0.05, -0.025), (1.0, 0.0, 0.0), -lift)
        left = hinge((0.0, -0.05, -0.025), (1.0, 0.0, 0.0), lift)
        return {
            "right_arm": right,
            "left_arm": left,
            "right_hand": right @ hinge((0.0, _ELBOW, -0.025), (1.0, 0.0, 0.0), -bend),
            "left_hand": left @ hinge((0.0, -_ELBOW, -0.025), (1.0, 0.0, 0.0), bend),
        }
