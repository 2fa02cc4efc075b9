"""A single-engined jet fighter."""

from __future__ import annotations

from typing import ClassVar

from irsim.config.quantities import Kelvin, Length
from irsim.motion.attitude import AEROPLANE, Posture
from irsim.targets.base import Angles
from irsim.targets.body import Body
from irsim.targets.solids import Solid, mirrored, plate, profile, tube

_WING = plate(((0.13, 0.02), (-0.13, 0.32), (-0.20, 0.32), (-0.23, 0.02)), -0.006, 0.006)
_TAILPLANE = plate(((-0.32, 0.02), (-0.43, 0.18), (-0.49, 0.18), (-0.47, 0.02)), -0.005, 0.005)


class Fighter(Body):
    """A jet with cropped delta wings, one fin and a hot nozzle that only its tail shows."""

    lies: ClassVar[Posture] = AEROPLANE
    poses: ClassVar[tuple[Angles, ...]] = ((70.0, 10.0, -50.0), (90.0, 0.0, 0.0), (20.0, 10.0, -60.0))
    # The MiG-25 at its limit for short dashes, Mach 3 at height (Mach 2.83 for longer): 885 m/s.
    fastest_m_s: ClassVar[float | None] = 900.0
    solids: ClassVar[tuple[Solid, ...]] = (
        tube((0.5, 0.01, 0.004, 0.004), (0.41, 0.005, 0.02, 0.02), (0.22, 0.0, 0.043, 0.043)),
        tube(
            (0.30, 0.0, 0.036, 0.036), (0.08, 0.0, 0.056, 0.053), (-0.22, 0.0, 0.056, 0.053), (-0.42, 0.0, 0.042, 0.042)
        ),
        tube(
            (0.33, -0.035, 0.008, 0.008),
            (0.22, -0.05, 0.027, 0.03),
            (0.14, -0.045, 0.02, 0.02),
            (0.06, -0.035, 0.01, 0.01),
        ),
        plate(((0.20, -0.035), (0.20, 0.035), (-0.1, 0.03), (-0.1, -0.03)), 0.02, 0.085),
        _WING,
        mirrored(_WING),
        _TAILPLANE,
        mirrored(_TAILPLANE),
        profile(((-0.20, -0.03), (-0.40, -0.23), (-0.47, -0.23), (-0.45, -0.03)), -0.006, 0.006),
        tube((-0.40, 0.0, 0.041, 0.041), (-0.5, 0.0, 0.033, 0.033), heat="engine_k"),
    )

    length_m: Length = 15.0
    """Length, m."""
    engine_k: Kelvin = 400.0
    """Temperature of the nozzle's outside, kelvin."""
